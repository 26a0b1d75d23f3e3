/* SPDX-License-Identifier: Apache-2.0 */
#include "server/backup.h"

#include "server/archive.h"
#include "server/frame_file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct backup {
	const char *source;
	char target[PATH_MAX]; /* under the name that it has until it is whole */
	struct pen_archive *copy;
	uint64_t *vanished; /* numbers of renders whose files have gone meanwhile */
	size_t count;
};

static int copy_bytes(int from, int to)
{
	ssize_t n;

	while ((n = copy_file_range(from, NULL, to, NULL, 1 << 30, 0)) > 0)
		;
	return n < 0 || fsync(to) < 0 ? -errno : 0;
}

/* PEN_ENOTFOUND when it has gone. */
static int copy_file(const char *from, const char *to, struct pen_error *err)
{
	int in = open(from, O_RDONLY | O_CLOEXEC), out, r;

	if (in < 0)
		return errno == ENOENT ? pen_error_set(err, PEN_ENOTFOUND, "%s is gone", from)
				       : pen_error_system(err, errno, "cannot read %s", from);
	out = open(to, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	r = out < 0 ? -errno : copy_bytes(in, out);
	if (r < 0)
		r = pen_error_system(err, -r, "cannot write %s", to);
	if (out >= 0)
		(void)close(out);
	(void)close(in);
	return r;
}

static int sync_dir(const char *path, struct pen_error *err)
{
	int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	int r = fd < 0 || fsync(fd) < 0 ? pen_error_system(err, errno, "cannot write %s", path) : 0;

	if (fd >= 0)
		(void)close(fd);
	return r;
}

static int join(char *ret_path, const char *dir, const char *name, struct pen_error *err)
{
	if (snprintf(ret_path, PATH_MAX, "%s/%s", dir, name) >= PATH_MAX)
		return pen_error_set(err, PEN_EINVALID, "%s/%s is too long a path", dir, name);
	return 0;
}

/* NULL at the end, and, with r < 0, when the directory cannot be read on. */
static const struct dirent *next_entry(DIR *dir, const char *path, int *r, struct pen_error *err)
{
	const struct dirent *entry;

	errno = 0;
	entry = readdir(dir);
	if (!entry && errno != 0)
		*r = pen_error_system(err, errno, "cannot read %s", path);
	return entry;
}

/* The files of a directory whose names begin so; those that go meanwhile are left out. */
static int copy_files(
	struct backup *backup, const char *name, const char *prefix, struct pen_error *err)
{
	char from[PATH_MAX], to[PATH_MAX], file[PATH_MAX], copy[PATH_MAX];
	const struct dirent *entry;
	int r = join(from, backup->source, name, err);
	DIR *dir;

	if (r == 0)
		r = join(to, backup->target, name, err);
	if (r < 0)
		return r;
	if (mkdir(to, 0700) < 0 && errno != EEXIST)
		return pen_error_system(err, errno, "cannot make %s", to);
	dir = opendir(from);
	/* An old data directory may lack one; one that cannot be read must not be left out. */
	if (!dir && errno != ENOENT)
		r = pen_error_system(err, errno, "cannot read %s", from);
	while (r == 0 && dir && (entry = next_entry(dir, from, &r, err)) != NULL) {
		if (entry->d_name[0] == '.' || strncmp(entry->d_name, prefix, strlen(prefix)) != 0)
			continue;
		r = join(file, from, entry->d_name, err);
		if (r == 0)
			r = join(copy, to, entry->d_name, err);
		if (r == 0)
			r = copy_file(file, copy, err);
		if (r == PEN_ENOTFOUND)
			r = 0;
	}
	if (dir)
		(void)closedir(dir);
	return r < 0 ? r : sync_dir(to, err);
}

static int copy_frames(void *user, const struct pen_job *job, struct pen_error *err)
{
	struct backup *backup = user;
	uint64_t *grown;
	char path[PATH_MAX];

	for (uint32_t i = 0; job && i < job->frames_done; i++) {
		pen_frame_file_path(backup->target, job, job->frame_first + i, path);
		if (access(path, F_OK) == 0)
			continue;
		grown = reallocarray(backup->vanished, backup->count + 1, sizeof *grown);
		if (!grown)
			return pen_error_memory(err);
		backup->vanished = grown;
		backup->vanished[backup->count++] = job->number;
		return 0;
	}
	return 0;
}

/* Renders that were removed while their files were being copied. */
static int forget_vanished(struct backup *backup, struct pen_error *err)
{
	int r = pen_archive_open(backup->target, true, &backup->copy, err);

	if (r == 0)
		r = pen_archive_jobs(backup->copy, copy_frames, backup, err);
	for (size_t i = 0; r == 0 && i < backup->count; i++)
		r = pen_archive_forget(backup->copy, backup->vanished[i], err);
	pen_archive_close(backup->copy);
	free(backup->vanished);
	return r;
}

static int copy_all(struct backup *backup, struct pen_error *err)
{
	static const char *const names[] = {"scenes", "assets", "kept", "frames"};
	struct pen_archive *archive = NULL;
	char path[PATH_MAX];
	int r = pen_archive_open(backup->source, false, &archive, err);

	if (r == 0)
		r = join(path, backup->target, "penumbra.db", err);
	if (r == 0)
		r = pen_archive_copy(archive, path, err);
	pen_archive_close(archive);
	for (size_t i = 0; r == 0 && i < sizeof names / sizeof *names; i++)
		r = copy_files(backup, names[i], "", err);
	if (r == 0)
		r = forget_vanished(backup, err);
	return r < 0 ? r : sync_dir(backup->target, err);
}

int pen_backup(const char *source, const char *target, struct pen_error *err)
{
	struct backup backup = {.source = source};
	char parent[PATH_MAX];
	struct stat status;
	char *slash;
	int r;

	if (lstat(target, &status) == 0)
		return pen_error_set(err, PEN_ECONFLICT, "%s is there already", target);
	if (snprintf(backup.target, sizeof backup.target, "%s.partial", target) >=
		(int)sizeof backup.target)
		return pen_error_set(err, PEN_EINVALID, "%s is too long a path", target);
	if (mkdir(backup.target, 0700) < 0)
		return pen_error_system(err, errno, "cannot make %s", backup.target);
	r = copy_all(&backup, err);
	if (r == 0 && rename(backup.target, target) < 0)
		r = pen_error_system(err, errno, "cannot make %s", target);
	if (r < 0)
		return r;
	(void)snprintf(parent, sizeof parent, "%s", target);
	slash = strrchr(parent, '/');
	if (slash)
		slash[slash == parent] = '\0';
	return sync_dir(slash ? parent : ".", err);
}
