/* SPDX-License-Identifier: Apache-2.0 */
#include "server/durable.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char suffix[] = ".tmp";

static int write_all(int fd, const char *data, size_t size)
{
	while (size > 0) {
		ssize_t n = write(fd, data, size);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0)
			return -1;
		data += n;
		size -= (size_t)n;
	}
	return 0;
}

static int write_temporary(int dir, const char *name, const void *data, size_t size)
{
	int fd = openat(dir, name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	int r;

	if (fd < 0)
		return -1;
	r = write_all(fd, data, size);
	if (r == 0)
		r = fsync(fd);
	if (close(fd) < 0)
		r = -1;
	return r;
}

int pen_durable_write(
	const char *dir, const char *name, const void *data, size_t size, struct pen_error *err)
{
	int fd = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	char temporary[128];
	int r = 0;

	if (fd < 0)
		return pen_error_system(err, errno, "cannot open the directory of %s", name);
	(void)snprintf(temporary, sizeof temporary, "%s%s", name, suffix);
	if (write_temporary(fd, temporary, data, size) < 0 ||
		renameat(fd, temporary, fd, name) < 0 || fsync(fd) < 0) {
		r = pen_error_system(err, errno, "cannot write %s", name);
		(void)unlinkat(fd, temporary, 0);
	}
	(void)close(fd);
	return r;
}

void pen_durable_sweep(const char *dir)
{
	DIR *stream = opendir(dir);
	const struct dirent *entry;

	if (!stream)
		return;
	while ((entry = readdir(stream)) != NULL) {
		size_t length = strlen(entry->d_name);

		if (length >= sizeof suffix &&
			strcmp(entry->d_name + length - strlen(suffix), suffix) == 0)
			(void)unlinkat(dirfd(stream), entry->d_name, 0);
	}
	(void)fsync(dirfd(stream));
	(void)closedir(stream);
}
