/* SPDX-License-Identifier: Apache-2.0 */
#include "server/data_dir.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

int pen_data_dir_make(const char *path, struct pen_error *err)
{
	char prefix[PATH_MAX];

	(void)snprintf(prefix, sizeof prefix, "%s", path);
	for (char *slash = strchr(prefix + 1, '/');; slash = strchr(slash + 1, '/')) {
		if (slash)
			*slash = '\0';
		if (mkdir(prefix, 0700) < 0 && errno != EEXIST)
			return pen_error_system(err, errno, "cannot make %s", prefix);
		if (!slash)
			return 0;
		*slash = '/';
	}
}

static int make_inside(const char *path, const char *name, char *ret_path, struct pen_error *err)
{
	if (snprintf(ret_path, PATH_MAX, "%s/%s", path, name) >= PATH_MAX)
		return pen_error_set(err, PEN_EINVALID, "%s is too long a path", path);
	if (mkdir(ret_path, 0700) < 0 && errno != EEXIST)
		return pen_error_system(err, errno, "cannot make %s", ret_path);
	return 0;
}

static int lock(struct pen_data_dir *data, struct pen_error *err)
{
	char path[PATH_MAX];

	if (snprintf(path, sizeof path, "%s/lock", data->path) >= (int)sizeof path)
		return pen_error_set(err, PEN_EINVALID, "%s is too long a path", data->path);
	data->lock_fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
	if (data->lock_fd < 0)
		return pen_error_system(err, errno, "cannot open %s", path);
	if (flock(data->lock_fd, LOCK_EX | LOCK_NB) == 0)
		return 0;
	if (errno == EWOULDBLOCK)
		return pen_error_set(err, PEN_ECONFLICT,
			"another coordinator uses %s: stop it, or name another directory with "
			"--data",
			data->path);
	return pen_error_system(err, errno, "cannot lock %s", path);
}

/* Those of an earlier coordinator: whoever waits for ours must not find them. */
static int forget_ports(const char *path, struct pen_error *err)
{
	char ports[PATH_MAX];

	if (snprintf(ports, sizeof ports, "%s/ports", path) >= (int)sizeof ports)
		return pen_error_set(err, PEN_EINVALID, "%s is too long a path", path);
	if (unlink(ports) < 0 && errno != ENOENT)
		return pen_error_system(err, errno, "cannot remove %s", ports);
	return 0;
}

int pen_data_dir_lock(struct pen_data_dir *data, const char *path, struct pen_error *err)
{
	*data = (struct pen_data_dir){.path = path, .lock_fd = -1};
	if (access(path, F_OK) < 0)
		return pen_error_set(err, PEN_ENOTFOUND, "%s is no data directory", path);
	return lock(data, err);
}

int pen_data_dir_open(struct pen_data_dir *data, const char *path, struct pen_error *err)
{
	char frames[PATH_MAX];
	int r;

	*data = (struct pen_data_dir){.path = path, .lock_fd = -1};
	r = pen_data_dir_make(path, err);
	if (r == 0)
		r = lock(data, err);
	if (r == 0)
		r = make_inside(path, "scenes", data->scenes, err);
	if (r == 0)
		r = make_inside(path, "assets", data->assets, err);
	if (r == 0)
		r = make_inside(path, "kept", data->kept, err);
	if (r == 0)
		r = make_inside(path, "frames", frames, err);
	if (r == 0)
		r = make_inside(path, "cache", data->cache, err);
	if (r == 0)
		r = forget_ports(path, err);
	if (r < 0)
		pen_data_dir_close(data);
	return r;
}

void pen_data_dir_close(struct pen_data_dir *data)
{
	if (data->lock_fd >= 0)
		(void)close(data->lock_fd);
	data->lock_fd = -1;
}
