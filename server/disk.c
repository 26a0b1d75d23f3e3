/* SPDX-License-Identifier: Apache-2.0 */
#include "server/disk.h"

#include "core/base/limits.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

enum { SMALL_DISK_SHARE = 16, BALLAST_SHARE = 4 /* of the reserve */ };

static uint64_t reserve_of(const struct statvfs *disk)
{
	const uint64_t share = (uint64_t)disk->f_blocks * disk->f_frsize / SMALL_DISK_SHARE;

	return share < PEN_DISK_RESERVE_BYTES ? share : PEN_DISK_RESERVE_BYTES;
}

static int check(
	const struct statvfs *disk, enum pen_disk_use use, uint64_t bytes, struct pen_error *err)
{
	const uint64_t reserve = reserve_of(disk) / (use == PEN_DISK_ACCEPT ? 1 : 2);

	if ((uint64_t)disk->f_bavail * disk->f_frsize < bytes + reserve)
		return pen_error_set(err, PEN_ENOSPACE, "the disk of the data directory is full");
	return 0;
}

int pen_disk_check(int dir, enum pen_disk_use use, uint64_t bytes, struct pen_error *err)
{
	struct statvfs disk;

	if (fstatvfs(dir, &disk) < 0)
		return pen_error_system(err, errno, "cannot look at the disk");
	return check(&disk, use, bytes, err);
}

int pen_disk_check_path(
	const char *path, enum pen_disk_use use, uint64_t bytes, struct pen_error *err)
{
	struct statvfs disk;

	if (statvfs(path, &disk) < 0)
		return pen_error_system(err, errno, "cannot look at the disk");
	return check(&disk, use, bytes, err);
}

static int format_path(const char *dir, char *ret_path)
{
	return snprintf(ret_path, PATH_MAX, "%s/ballast", dir) < PATH_MAX ? 0 : -1;
}

void pen_ballast_fill(const char *dir)
{
	char path[PATH_MAX];
	struct statvfs disk;
	struct stat status;
	uint64_t size;
	int fd;

	if (format_path(dir, path) < 0 || statvfs(dir, &disk) < 0)
		return;
	size = reserve_of(&disk) / BALLAST_SHARE;
	if (stat(path, &status) == 0 && (uint64_t)status.st_size >= size)
		return;
	if (check(&disk, PEN_DISK_ACCEPT, 2 * size, NULL) < 0)
		return;
	fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
	if (fd < 0)
		return;
	if (posix_fallocate(fd, 0, (off_t)size) != 0)
		(void)!ftruncate(fd, 0);
	(void)close(fd);
}

int pen_ballast_drop(const char *dir)
{
	char path[PATH_MAX];
	struct stat status;

	if (format_path(dir, path) < 0 || stat(path, &status) < 0 || status.st_size == 0)
		return PEN_ENOTFOUND;
	return truncate(path, 0) < 0 ? PEN_EIO : 0;
}
