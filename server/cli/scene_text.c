/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/scene_text.h"

#include "core/base/limits.h"
#include "server/cli/interrupt.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <stdbool.h>
#include <string.h>
#include <unistd.h>

static int bytes_read(int fd, const char *path, struct pen_buf *out, struct pen_error *err)
{
	char bytes[65536];
	ssize_t n;

	while ((n = read(fd, bytes, sizeof bytes)) != 0) {
		if (n < 0 && errno != EINTR)
			return pen_error_system(err, errno, "read %s", path);
		if (n > 0 && pen_buf_append(out, bytes, (size_t)n) < 0)
			return pen_error_set(err, PEN_ELIMIT, "%s is larger than %u MiB", path,
				PEN_SCENE_BYTES_MAX >> 20);
		if (pen_interrupted())
			return pen_error_set(err, PEN_ECLOSED, "interrupted");
	}
	return 0;
}

static int file_read(const char *path, struct pen_buf *out, struct pen_error *err)
{
	bool standard_input = strcmp(path, "-") == 0;
	int fd = standard_input ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
	int r;

	if (fd < 0)
		return pen_error_system(err, errno, "open %s", path);
	r = bytes_read(fd, path, out, err);
	if (!standard_input)
		close(fd);
	return r;
}

static int text_check(const char *path, const struct pen_buf *text, struct pen_error *err)
{
	json_error_t where;
	json_t *tree = json_loadb(
		text->size ? text->data : "", text->size, JSON_REJECT_DUPLICATES, &where);

	if (!tree)
		return pen_error_set(err, PEN_EINVALID, "%s: line %d, column %d, byte %d: %s", path,
			where.line, where.column, where.position, where.text);
	json_decref(tree);
	return 0;
}

int pen_scene_text_read(const char *path, struct pen_buf *text, struct pen_error *err)
{
	int r = file_read(path, text, err);

	return r < 0 ? r : text_check(path, text, err);
}
