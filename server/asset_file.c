/* SPDX-License-Identifier: Apache-2.0 */
#include "server/asset_file.h"

#include "core/base/limits.h"
#include "server/disk.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

struct pen_asset_upload {
	int dir, fd;
	uint64_t size;
	struct pen_sha256_stream *stream;
};

static int format_path(const char *dir, const struct pen_sha256 *sha256, char *ret_path)
{
	char name[PEN_SHA256_TEXT];

	pen_sha256_format(sha256, name);
	return snprintf(ret_path, PATH_MAX, "%s/%s", dir, name) < PATH_MAX ? 0 : -1;
}

bool pen_asset_file_touch(const char *dir, const struct pen_sha256 *sha256)
{
	char path[PATH_MAX];

	return format_path(dir, sha256, path) == 0 && utimensat(AT_FDCWD, path, NULL, 0) == 0;
}

int pen_asset_file_open(const char *dir, const struct pen_sha256 *sha256, int *ret_fd,
	uint64_t *ret_size, struct pen_error *err)
{
	char path[PATH_MAX];
	struct stat status;
	int fd;

	if (format_path(dir, sha256, path) < 0)
		return pen_error_set(err, PEN_EINVALID, "the data directory's path is too long");
	fd = open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0)
		return pen_error_set(err, PEN_ENOTFOUND, "no such asset");
	if (fstat(fd, &status) < 0) {
		(void)close(fd);
		return pen_error_system(err, errno, "cannot read the asset");
	}
	*ret_fd = fd;
	*ret_size = (uint64_t)status.st_size;
	return 0;
}

/* A file without a name: whatever ends the coordinator also ends it. */
static int open_unnamed(const char *dir, int *ret_fd, struct pen_error *err)
{
	int fd = open(dir, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);

	if (fd < 0)
		return pen_error_system(err, errno, "cannot store an asset");
	*ret_fd = fd;
	return 0;
}

int pen_asset_upload_create(
	const char *dir, uint64_t size, struct pen_asset_upload **ret_upload, struct pen_error *err)
{
	struct pen_asset_upload *upload = calloc(1, sizeof *upload);
	int r = 0;

	if (!upload)
		return pen_error_memory(err);
	upload->fd = -1;
	upload->dir = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (upload->dir < 0)
		r = pen_error_system(err, errno, "cannot open the directory of assets");
	if (r == 0)
		r = pen_disk_check(upload->dir, PEN_DISK_ACCEPT, size, err);
	if (r == 0)
		r = open_unnamed(dir, &upload->fd, err);
	if (r == 0)
		r = pen_sha256_stream_create(&upload->stream, err);
	if (r < 0)
		pen_asset_upload_destroy(upload);
	else
		*ret_upload = upload;
	return r;
}

void pen_asset_upload_destroy(struct pen_asset_upload *upload)
{
	if (!upload)
		return;
	pen_sha256_stream_destroy(upload->stream);
	if (upload->fd >= 0)
		(void)close(upload->fd);
	if (upload->dir >= 0)
		(void)close(upload->dir);
	free(upload);
}

int pen_asset_upload_append(
	struct pen_asset_upload *upload, const void *data, size_t size, struct pen_error *err)
{
	const char *bytes = data;
	int r;

	if (size > PEN_ASSET_BYTES_MAX - upload->size)
		return pen_error_set(err, PEN_ELIMIT, "an asset has at most %llu bytes",
			(unsigned long long)PEN_ASSET_BYTES_MAX);
	r = pen_sha256_stream_append(upload->stream, data, size, err);
	if (r < 0)
		return r;
	upload->size += size;
	while (size > 0) {
		ssize_t n = write(upload->fd, bytes, size);

		if (n < 0 && errno != EINTR)
			return pen_error_system(err, errno, "cannot store an asset");
		bytes += n > 0 ? n : 0;
		size -= n > 0 ? (size_t)n : 0;
	}
	return 0;
}

/* The same asset may have come in another way meanwhile: it is the same. */
static int give_name(const struct pen_asset_upload *upload, const struct pen_sha256 *sha256)
{
	char name[PEN_SHA256_TEXT], unnamed[64];

	pen_sha256_format(sha256, name);
	(void)snprintf(unnamed, sizeof unnamed, "/proc/self/fd/%d", upload->fd);
	if (linkat(AT_FDCWD, unnamed, upload->dir, name, AT_SYMLINK_FOLLOW) == 0 || errno == EEXIST)
		return 0;
	return -1;
}

int pen_asset_upload_finish(struct pen_asset_upload *upload, const struct pen_sha256 *expected,
	struct pen_sha256 *ret_sha256, struct pen_error *err)
{
	struct pen_sha256 found;

	pen_sha256_stream_take(upload->stream, &found);
	if (expected && !pen_sha256_equal(&found, expected))
		return pen_error_set(
			err, PEN_EINVALID, "the bytes have another SHA-256 than the path says");
	if (fsync(upload->fd) < 0 || give_name(upload, &found) < 0 || fsync(upload->dir) < 0)
		return pen_error_system(err, errno, "cannot store an asset");
	*ret_sha256 = found;
	return 0;
}
