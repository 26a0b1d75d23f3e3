/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/output.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool pen_output_format(const char *path, enum pen_image_format *ret_format)
{
	const char *extension = strrchr(path, '.');

	return extension && pen_image_format_parse(extension + 1, ret_format);
}

/* The mode that a plain open() would have given: mkostemp asks for 0600. */
static mode_t usual_mode(void)
{
	mode_t mask = umask(0);

	(void)umask(mask);
	return 0666 & ~mask;
}

int pen_output_open(struct pen_output *output, const char *path, struct pen_error *err)
{
	*output = (struct pen_output){.path = path, .fd = -1};
	if (!pen_output_format(path, &output->format))
		return pen_error_set(err, PEN_EUNSUPPORTED, "%s: no such format", path);
	if (asprintf(&output->temporary, "%s.XXXXXX", path) < 0) {
		output->temporary = NULL;
		return pen_error_memory(err);
	}
	output->fd = mkostemp(output->temporary, O_CLOEXEC);
	if (output->fd < 0) {
		free(output->temporary);
		output->temporary = NULL;
		return pen_error_system(err, errno, "create %s", path);
	}
	(void)fchmod(output->fd, usual_mode());
	return 0;
}

int pen_output_commit(struct pen_output *output, struct pen_error *err)
{
	int fd = output->fd;

	output->fd = -1;
	if (close(fd) < 0)
		return pen_error_system(err, errno, "write %s", output->path);
	if (rename(output->temporary, output->path) < 0)
		return pen_error_system(err, errno, "rename to %s", output->path);
	free(output->temporary);
	output->temporary = NULL;
	return 0;
}

void pen_output_finish(struct pen_output *output)
{
	if (output->fd >= 0)
		close(output->fd);
	if (output->temporary)
		(void)unlink(output->temporary);
	free(output->temporary);
	*output = (struct pen_output){.fd = -1};
}

/* The first # of the run; NULL without one. */
static const char *find_run(const char *path)
{
	const char *slash = strrchr(path, '/');

	return strchr(slash ? slash : path, '#');
}

bool pen_output_has_frames(const char *path)
{
	return find_run(path) != NULL;
}

char *pen_output_frame_path(const char *path, uint32_t frame)
{
	const char *run = find_run(path);
	size_t digits = strspn(run, "#");
	char *text;

	if (asprintf(&text, "%.*s%0*u%s", (int)(run - path), path, (int)digits, frame,
		    run + digits) < 0)
		return NULL;
	return text;
}
