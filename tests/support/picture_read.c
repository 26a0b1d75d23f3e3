/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/text.h"
#include "core/image/mipmap.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/*
 * Decodes images and averages them as a scene process does, each in a process of its own. For each
 * "decoded WIDTHxHEIGHT MILLISECONDS MEBIBYTES", "refused MILLISECONDS MEBIBYTES REASON" or
 * "crashed STATUS": processor time and the most memory at a time.
 */

enum { REFUSED = 3 };

static void *read_file(const char *path, size_t *ret_size)
{
	FILE *file = fopen(path, "rb");
	char *bytes;
	long size;

	if (!file || fseek(file, 0, SEEK_END) != 0 || (size = ftell(file)) < 0) {
		(void)fprintf(stderr, "picture-read: cannot open %s\n", path);
		exit(2);
	}
	rewind(file);
	/* Exactly as large as the file, so that a sanitizer sees what reads beyond. */
	bytes = malloc(size > 0 ? (size_t)size : 1);
	if (!bytes || fread(bytes, 1, (size_t)size, file) != (size_t)size || fclose(file) != 0)
		exit(2);
	*ret_size = (size_t)size;
	return bytes;
}

/* Writes what came of it, without the figures; tells the exit code. */
static int decode(const void *bytes, size_t size, int output)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_picture picture = {0};
	struct pen_mipmap *mipmap = NULL;
	uint32_t width, height;

	if (pen_picture_decode(bytes, size, &picture, &err) < 0) {
		(void)dprintf(output, "%s", err.text);
		return REFUSED;
	}
	width = picture.width;
	height = picture.height;
	if (pen_mipmap_create(&picture, picture.is_encoded, &mipmap, &err) < 0) {
		(void)dprintf(output, "%s", err.text);
		return REFUSED;
	}
	pen_mipmap_destroy(mipmap);
	(void)dprintf(output, "%ux%u", width, height);
	return 0;
}

static void report(const char *text, int status, const struct rusage *usage)
{
	const long ms = usage->ru_utime.tv_sec * 1000 + usage->ru_utime.tv_usec / 1000 +
			usage->ru_stime.tv_sec * 1000 + usage->ru_stime.tv_usec / 1000;
	const long mebibytes = usage->ru_maxrss >> 10;

	if (!WIFEXITED(status) || (WEXITSTATUS(status) != 0 && WEXITSTATUS(status) != REFUSED))
		printf("crashed %d\n", status);
	else if (WEXITSTATUS(status) == REFUSED)
		printf("refused %ld %ld %s\n", ms, mebibytes, text);
	else
		printf("decoded %s %ld %ld\n", text, ms, mebibytes);
	(void)fflush(stdout);
}

static void run(const char *path)
{
	char text[1024];
	size_t size, length = 0;
	void *bytes = read_file(path, &size);
	struct rusage usage;
	int output[2], status;
	ssize_t got;
	pid_t pid;

	if (pipe(output) < 0 || (pid = fork()) < 0)
		exit(2);
	/* Without what libraries do at exit: they would wait for threads that were not forked. */
	if (pid == 0)
		_exit(decode(bytes, size, output[1]));
	(void)close(output[1]);
	while ((got = read(output[0], text + length, sizeof text - 1 - length)) > 0)
		length += (size_t)got;
	text[length] = '\0';
	pen_text_clean(text);
	(void)close(output[0]);
	if (wait4(pid, &status, 0, &usage) != pid)
		exit(2);
	free(bytes);
	report(text, status, &usage);
}

int main(int argc, char **argv)
{
	for (int i = 1; i < argc; i++)
		run(argv[i]);
	return 0;
}
