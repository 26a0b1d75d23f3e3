/* SPDX-License-Identifier: Apache-2.0 */
#include "server/durable.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
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

static int write_temporary(
	int dir, const char *name, const void *data, size_t size, bool is_durable)
{
	int fd = openat(dir, name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	int r;

	if (fd < 0)
		return -1;
	r = write_all(fd, data, size);
	if (r == 0 && is_durable)
		r = fsync(fd);
	if (close(fd) < 0)
		r = -1;
	return r;
}

static int open_directory(const char *dir, struct pen_error *err)
{
	int fd = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

	return fd < 0 ? pen_error_system(err, errno, "cannot open the directory %s", dir) : fd;
}

static int replace(const char *dir, const char *name, const void *data, size_t size,
	bool is_durable, struct pen_error *err)
{
	int fd = open_directory(dir, err);
	char temporary[128];
	int r = 0;

	if (fd < 0)
		return fd;
	(void)snprintf(temporary, sizeof temporary, "%s%s", name, suffix);
	if (write_temporary(fd, temporary, data, size, is_durable) < 0 ||
		renameat(fd, temporary, fd, name) < 0) {
		r = pen_error_system(err, errno, "cannot write %s", name);
		(void)unlinkat(fd, temporary, 0);
	}
	(void)close(fd);
	return r;
}

int pen_durable_place(
	const char *dir, const char *name, const void *data, size_t size, struct pen_error *err)
{
	return replace(dir, name, data, size, false, err);
}

int pen_durable_put(
	const char *dir, const char *name, const void *data, size_t size, struct pen_error *err)
{
	return replace(dir, name, data, size, true, err);
}

int pen_durable_settle(const char *dir, struct pen_error *err)
{
	int fd = open_directory(dir, err);
	int r = 0;

	if (fd < 0)
		return fd;
	if (fsync(fd) < 0)
		r = pen_error_system(err, errno, "cannot write to the directory %s", dir);
	(void)close(fd);
	return r;
}

int pen_durable_write(
	const char *dir, const char *name, const void *data, size_t size, struct pen_error *err)
{
	int r = pen_durable_put(dir, name, data, size, err);

	return r < 0 ? r : pen_durable_settle(dir, err);
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
