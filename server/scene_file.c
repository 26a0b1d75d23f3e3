/* SPDX-License-Identifier: Apache-2.0 */
#include "server/scene_file.h"

#include "server/durable.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NAME_SIZE = PEN_SHA256_TEXT + sizeof ".json" };

static void format_name(const struct pen_sha256 *sha256, char *ret_name)
{
	pen_sha256_format(sha256, ret_name);
	(void)snprintf(ret_name + PEN_SHA256_TEXT - 1, sizeof ".json", ".json");
}

static int format_path(
	const char *dir, const struct pen_sha256 *sha256, char *ret_path, size_t size)
{
	char name[NAME_SIZE];

	format_name(sha256, name);
	return snprintf(ret_path, size, "%s/%s", dir, name) < (int)size ? 0 : -1;
}

int pen_scene_file_write(const char *dir, const struct pen_sha256 *sha256, const void *text,
	size_t size, bool is_durable, struct pen_error *err)
{
	char name[NAME_SIZE], path[PATH_MAX];

	if (format_path(dir, sha256, path, sizeof path) == 0 && access(path, F_OK) == 0)
		return 0;
	format_name(sha256, name);
	return is_durable ? pen_durable_put(dir, name, text, size, err)
			  : pen_durable_place(dir, name, text, size, err);
}

int pen_scene_file_open(const char *dir, const struct pen_sha256 *sha256, int *ret_fd,
	uint64_t *ret_size, struct pen_error *err)
{
	char path[PATH_MAX];
	struct stat status;
	int fd;

	if (format_path(dir, sha256, path, sizeof path) < 0)
		return pen_error_set(err, PEN_EINVALID, "the data directory's path is too long");
	fd = open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0)
		return pen_error_set(err, PEN_ENOTFOUND, "no such scene");
	if (fstat(fd, &status) < 0) {
		(void)close(fd);
		return pen_error_system(err, errno, "cannot read the scene");
	}
	*ret_fd = fd;
	*ret_size = (uint64_t)status.st_size;
	return 0;
}

static bool is_text_of(int fd, uint64_t size, const struct pen_sha256 *sha256)
{
	struct pen_sha256 found;
	void *text;
	bool whole;

	if (size == 0)
		return false;
	text = mmap(NULL, size, PROT_READ, MAP_PRIVATE, fd, 0);
	if (text == MAP_FAILED)
		return false;
	whole = pen_sha256_of(text, size, &found, NULL) == 0 && pen_sha256_equal(&found, sha256);
	(void)munmap(text, size);
	return whole;
}

bool pen_scene_file_is_whole(const char *dir, const struct pen_sha256 *sha256)
{
	uint64_t size;
	bool whole;
	int fd;

	if (pen_scene_file_open(dir, sha256, &fd, &size, NULL) < 0)
		return false;
	whole = is_text_of(fd, size, sha256);
	(void)close(fd);
	return whole;
}

void pen_scene_file_remove(const char *dir, const struct pen_sha256 *sha256)
{
	char path[PATH_MAX];

	if (format_path(dir, sha256, path, sizeof path) == 0)
		(void)unlink(path);
}
