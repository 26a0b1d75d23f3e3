/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/folder.h"

#include "server/cli/interrupt.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/openat2.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

int pen_folder_open(const char *file, int *ret_folder, struct pen_error *err)
{
	const char *end = strcmp(file, "-") == 0 ? NULL : strrchr(file, '/');
	char *path = end ? strndup(file, end > file ? (size_t)(end - file) : 1) : strdup(".");
	int fd;

	if (!path)
		return pen_error_memory(err);
	fd = open(path, O_PATH | O_DIRECTORY | O_CLOEXEC);
	free(path);
	if (fd < 0)
		return pen_error_system(err, errno, "open the folder of %s", file);
	*ret_folder = fd;
	return 0;
}

static bool climbs(const char *path)
{
	for (const char *step = path; step; step = strchr(step, '/')) {
		step += *step == '/';
		if (strncmp(step, "..", 2) == 0 && (step[2] == '/' || step[2] == '\0'))
			return true;
	}
	return false;
}

/* Only what is said in the path itself; what links say the kernel checks. */
static int path_check(const char *path, struct pen_error *err)
{
	if (strstr(path, "://"))
		return pen_error_set(err, PEN_EINVALID,
			"'%.200s' is a URL, and nothing is fetched: save the file beside the scene",
			path);
	if (path[0] == '/')
		return pen_error_set(err, PEN_EINVALID,
			"'%.200s' is an absolute path: files must lie below the scene's folder",
			path);
	if (climbs(path))
		return pen_error_set(err, PEN_EINVALID,
			"'%.200s' has '..' in it: files must lie below the scene's folder", path);
	return path[0] ? 0 : pen_error_set(err, PEN_EINVALID, "a file's path is empty");
}

static int open_beneath(int folder, const char *path)
{
	/* A FIFO must not make the command wait. */
	struct open_how how = {
		.flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK,
		.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS,
	};

	return (int)syscall(SYS_openat2, folder, path, &how, sizeof how);
}

static int file_open(int folder, const char *path, int *ret_fd, struct pen_error *err)
{
	struct stat stat;
	int fd = open_beneath(folder, path);

	if (fd < 0 && errno == EXDEV)
		return pen_error_set(err, PEN_EINVALID,
			"'%.200s' leads out of the scene's folder by a symbolic link", path);
	if (fd < 0 && (errno == ENOENT || errno == ENOTDIR))
		return pen_error_set(err, PEN_ENOTFOUND,
			"there is no file '%.200s' in the scene's folder", path);
	if (fd < 0)
		return pen_error_system(err, errno, "open %.200s", path);
	if (fstat(fd, &stat) < 0 || !S_ISREG(stat.st_mode)) {
		close(fd);
		return pen_error_set(err, PEN_EINVALID, "'%.200s' is no regular file", path);
	}
	*ret_fd = fd;
	return 0;
}

int pen_folder_drain(int fd, const char *name, struct pen_buf *out, struct pen_error *err)
{
	char bytes[65536];
	ssize_t n;

	while ((n = read(fd, bytes, sizeof bytes)) != 0) {
		if (n < 0 && errno != EINTR)
			return pen_error_system(err, errno, "read %.200s", name);
		if (n > 0 && pen_buf_append(out, bytes, (size_t)n) < 0)
			return pen_error_set(err, PEN_ELIMIT, "%.200s is larger than %zu MiB", name,
				out->max >> 20);
		if (pen_interrupted())
			return pen_error_set(err, PEN_ECLOSED, "interrupted");
	}
	return 0;
}

int pen_folder_read(int folder, const char *path, struct pen_buf *out, struct pen_error *err)
{
	int fd = -1, r = path_check(path, err);

	if (r == 0)
		r = file_open(folder, path, &fd, err);
	if (r < 0)
		return r;
	r = pen_folder_drain(fd, path, out, err);
	close(fd);
	return r;
}
