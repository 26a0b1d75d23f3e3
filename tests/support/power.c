/* SPDX-License-Identifier: Apache-2.0 */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/*
 * A power cut, to be preloaded (LD_PRELOAD) into the coordinator: every call that changes a file or
 * a name below PEN_POWER_DIR, or brings it onto the disk, is counted, and the process dies at the
 * PEN_POWER_AT-th. With PEN_POWER_SEED the disk then holds what it might hold after a power cut: of
 * each page written since the last fsync of its file the old or the new content, or, torn, some
 * sectors of both; file sizes likewise; and changes of names since the last fsync of their
 * directory up to some moment only. PEN_POWER_COUNT names a file for the number of calls at the
 * end.
 *
 * SQLite goes through the same calls: what it has not synced is lost with the rest.
 */

#define EXPORT __attribute__((visibility("default")))

enum { PAGE = 4096, SECTOR = 512 };

/* A page that differs from what is on the disk. */
struct page {
	struct page *next;
	ino_t inode;
	off_t number;
	ssize_t size; /* bytes that were there */
	char *path;   /* /proc/self/fd would close with it */
	char bytes[PAGE];
};

struct length {
	struct length *next;
	ino_t inode;
	off_t size;
	char path[PATH_MAX];
};

enum change_type { CREATED, RENAMED, REMOVED };

/* A change of a name, newest first. */
struct change {
	struct change *next;
	enum change_type type;
	ino_t dir;
	char path[PATH_MAX], from[PATH_MAX],
		saved[PATH_MAX]; /* saved: what the name was of before */
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static bool is_active, loses;
static char root[PATH_MAX];
static uint64_t calls, calls_max, random_state, saved_count;
static struct page *pages;
static struct length *lengths;
static struct change *changes;

#define REAL(name) ((__typeof__(&name))real(#name))

static void *real(const char *name)
{
	return dlsym(RTLD_NEXT, name);
}

static uint32_t draw(uint32_t below)
{
	random_state ^= random_state << 13;
	random_state ^= random_state >> 7;
	random_state ^= random_state << 17;
	return (uint32_t)(random_state >> 33) % below;
}

__attribute__((constructor)) static void begin(void)
{
	const char *dir = getenv("PEN_POWER_DIR"), *at = getenv("PEN_POWER_AT");
	const char *seed = getenv("PEN_POWER_SEED");
	char self[PATH_MAX] = "";

	/* Its workers and encoders inherit the variables, but have no business in the directory. */
	if (!dir || readlink("/proc/self/exe", self, sizeof self - 1) < 0 ||
		strcmp(strrchr(self, '/'), "/penumbra") != 0)
		return;
	(void)snprintf(root, sizeof root, "%s/", dir);
	calls_max = at ? strtoull(at, NULL, 10) : UINT64_MAX;
	loses = seed != NULL;
	random_state = (seed ? strtoull(seed, NULL, 10) : 1) * 0x9e3779b97f4a7c15u + 1;
	is_active = true;
}

__attribute__((destructor)) static void end(void)
{
	const char *path = getenv("PEN_POWER_COUNT");
	FILE *file = is_active && path ? fopen(path, "w") : NULL;

	if (!file)
		return;
	(void)fprintf(file, "%llu\n", (unsigned long long)calls);
	(void)fclose(file);
}

static bool is_below(const char *path)
{
	return strncmp(path, root, strlen(root)) == 0;
}

/* The path of a name, or of a descriptor when name is NULL; false when it is not below the root. */
static bool find_path(int dir, const char *name, char *ret_path)
{
	char link[64];
	ssize_t size;

	if (!is_active)
		return false;
	if (name && name[0] == '/') {
		(void)snprintf(ret_path, PATH_MAX, "%s", name);
		return is_below(ret_path);
	}
	(void)snprintf(link, sizeof link, "/proc/self/fd/%d", dir);
	size = readlink(link, ret_path, PATH_MAX - 1);
	if (size < 0)
		return false;
	ret_path[size] = '\0';
	if (name)
		(void)snprintf(ret_path + size, (size_t)(PATH_MAX - size), "/%s", name);
	return is_below(ret_path);
}

static ino_t inode_of_dir(const char *path)
{
	char dir[PATH_MAX];
	struct stat status;

	(void)snprintf(dir, sizeof dir, "%s", path);
	*strrchr(dir, '/') = '\0';
	return stat(dir, &status) == 0 ? status.st_ino : 0;
}

/* What a power cut leaves */

static void put_back_page(const struct page *page)
{
	int fd = REAL(open)(page->path, O_WRONLY | O_CLOEXEC);
	const uint32_t fate = draw(3);

	/* 0: the new content has come; 1: it has not; 2: some sectors have. */
	for (off_t at = 0; fd >= 0 && fate > 0 && at < page->size; at += SECTOR) {
		size_t size = page->size - at < SECTOR ? (size_t)(page->size - at) : SECTOR;

		if (fate == 1 || draw(2) == 0)
			(void)!REAL(pwrite)(fd, page->bytes + at, size, page->number * PAGE + at);
	}
	if (fd >= 0)
		(void)close(fd);
}

static void put_back_name(const struct change *change)
{
	switch (change->type) {
	case CREATED: (void)REAL(unlink)(change->path); break;
	case RENAMED:
		(void)REAL(rename)(change->path, change->from);
		if (change->saved[0])
			(void)REAL(rename)(change->saved, change->path);
		break;
	case REMOVED: (void)REAL(rename)(change->saved, change->path); break;
	}
}

static void lose(void)
{
	uint32_t count = 0, kept;

	for (const struct page *page = pages; page; page = page->next)
		put_back_page(page);
	for (const struct length *length = lengths; length; length = length->next)
		if (draw(2) == 0)
			(void)REAL(truncate)(length->path, length->size);
	for (const struct change *change = changes; change; change = change->next)
		count++;
	kept = draw(count + 1);
	for (const struct change *change = changes; change && count > kept;
		change = change->next, count--)
		put_back_name(change);
}

/* To be called under the lock, before each call that counts. */
static void tick(void)
{
	if (++calls < calls_max)
		return;
	if (loses)
		lose();
	(void)kill(getpid(), SIGKILL);
	for (;;)
		(void)pause();
}

/* What is remembered */

static void remember_length(const char *path, const struct stat *status)
{
	struct length *length;

	for (length = lengths; length; length = length->next)
		if (length->inode == status->st_ino)
			return;
	length = calloc(1, sizeof *length);
	if (!length)
		abort();
	length->inode = status->st_ino;
	length->size = status->st_size;
	(void)snprintf(length->path, sizeof length->path, "%s", path);
	length->next = lengths;
	lengths = length;
}

static void remember_page(const char *path, const struct stat *status, off_t number)
{
	struct page *page;
	int fd;

	for (page = pages; page; page = page->next)
		if (page->inode == status->st_ino && page->number == number)
			return;
	page = calloc(1, sizeof *page);
	if (!page || !(page->path = strdup(path)))
		abort();
	page->inode = status->st_ino;
	page->number = number;
	fd = REAL(open)(path, O_RDONLY | O_CLOEXEC);
	if (fd >= 0) {
		page->size = pread(fd, page->bytes, PAGE, number * PAGE);
		(void)close(fd);
	}
	page->next = pages;
	pages = page;
}

/* Bytes of the file are about to change, its size perhaps. */
static void remember(int fd, const char *path, off_t offset, size_t size)
{
	struct stat status;

	if (!loses || size == 0 || fstat(fd, &status) < 0)
		return;
	if (offset + (off_t)size > status.st_size)
		remember_length(path, &status);
	for (off_t page = offset / PAGE; page <= (offset + (off_t)size - 1) / PAGE; page++)
		remember_page(path, &status, page);
}

static void forget(ino_t inode)
{
	for (struct page **place = &pages; *place;) {
		struct page *page = *place;

		if (page->inode != inode) {
			place = &page->next;
			continue;
		}
		*place = page->next;
		free(page->path);
		free(page);
	}
	for (struct length **place = &lengths; *place;) {
		struct length *length = *place;

		if (length->inode != inode) {
			place = &length->next;
			continue;
		}
		*place = length->next;
		free(length);
	}
	for (struct change **place = &changes; *place;) {
		struct change *change = *place;

		if (change->dir != inode) {
			place = &change->next;
			continue;
		}
		*place = change->next;
		if (change->saved[0])
			(void)REAL(unlink)(change->saved);
		free(change);
	}
}

/* The file that a name is of stays reachable, under a name that nobody looks for. */
static void save(struct change *change)
{
	(void)snprintf(change->saved, sizeof change->saved, "%.*s.power-%llu",
		(int)strlen(root) - 1, root, (unsigned long long)saved_count++);
	if (REAL(link)(change->path, change->saved) < 0)
		change->saved[0] = '\0';
}

static struct change *note_change(enum change_type type, const char *path)
{
	struct change *change = calloc(1, sizeof *change);

	if (!change)
		abort();
	change->type = type;
	change->dir = inode_of_dir(path);
	(void)snprintf(change->path, sizeof change->path, "%s", path);
	if (type != CREATED)
		save(change);
	change->next = changes;
	changes = change;
	return change;
}

/* The calls */

static int open_any(int dir, const char *name, int flags, mode_t mode)
{
	char path[PATH_MAX];
	int fd;

	if ((flags & (O_CREAT | O_TRUNC)) == 0 || !find_path(dir, name, path))
		return REAL(openat)(dir, name, flags, mode);
	(void)pthread_mutex_lock(&lock);
	tick();
	if (loses && (flags & O_CREAT) && REAL(access)(path, F_OK) < 0)
		(void)note_change(CREATED, path);
	fd = REAL(openat)(dir, name, flags, mode);
	(void)pthread_mutex_unlock(&lock);
	return fd;
}

static mode_t mode_of(int flags, va_list args)
{
	return flags & (O_CREAT | O_TMPFILE) ? (mode_t)va_arg(args, int) : 0;
}

EXPORT int open(const char *name, int flags, ...)
{
	va_list args;
	mode_t mode;

	va_start(args, flags);
	mode = mode_of(flags, args);
	va_end(args);
	return open_any(AT_FDCWD, name, flags, mode);
}

EXPORT int open64(const char *name, int flags, ...) __attribute__((alias("open")));

EXPORT int openat(int dir, const char *name, int flags, ...)
{
	va_list args;
	mode_t mode;

	va_start(args, flags);
	mode = mode_of(flags, args);
	va_end(args);
	return open_any(dir, name, flags, mode);
}

EXPORT int openat64(int dir, const char *name, int flags, ...) __attribute__((alias("openat")));

EXPORT ssize_t pwrite(int fd, const void *data, size_t size, off_t offset)
{
	char path[PATH_MAX];
	ssize_t n;

	if (!find_path(fd, NULL, path))
		return REAL(pwrite)(fd, data, size, offset);
	(void)pthread_mutex_lock(&lock);
	tick();
	remember(fd, path, offset, size);
	n = REAL(pwrite)(fd, data, size, offset);
	(void)pthread_mutex_unlock(&lock);
	return n;
}

EXPORT ssize_t pwrite64(int fd, const void *data, size_t size, off_t offset)
	__attribute__((alias("pwrite")));

EXPORT ssize_t write(int fd, const void *data, size_t size)
{
	char path[PATH_MAX];
	ssize_t n;

	if (!find_path(fd, NULL, path))
		return REAL(write)(fd, data, size);
	(void)pthread_mutex_lock(&lock);
	tick();
	remember(fd, path, lseek(fd, 0, SEEK_CUR), size);
	n = REAL(write)(fd, data, size);
	(void)pthread_mutex_unlock(&lock);
	return n;
}

EXPORT int ftruncate(int fd, off_t size)
{
	char path[PATH_MAX];
	struct stat status;
	int r;

	if (!find_path(fd, NULL, path))
		return REAL(ftruncate)(fd, size);
	(void)pthread_mutex_lock(&lock);
	tick();
	if (fstat(fd, &status) == 0 && status.st_size > size)
		remember(fd, path, size, (size_t)(status.st_size - size));
	if (loses && fstat(fd, &status) == 0)
		remember_length(path, &status);
	r = REAL(ftruncate)(fd, size);
	(void)pthread_mutex_unlock(&lock);
	return r;
}

EXPORT int ftruncate64(int fd, off_t size) __attribute__((alias("ftruncate")));

EXPORT int posix_fallocate(int fd, off_t offset, off_t size)
{
	char path[PATH_MAX];
	struct stat status;
	int r;

	if (!find_path(fd, NULL, path))
		return REAL(posix_fallocate)(fd, offset, size);
	(void)pthread_mutex_lock(&lock);
	tick();
	if (loses && fstat(fd, &status) == 0)
		remember_length(path, &status);
	r = REAL(posix_fallocate)(fd, offset, size);
	(void)pthread_mutex_unlock(&lock);
	return r;
}

static int sync_any(int (*sync)(int fd), int fd)
{
	char path[PATH_MAX];
	struct stat status;
	int r;

	if (!find_path(fd, NULL, path) && strncmp(path, root, strlen(root) - 1) != 0)
		return sync(fd);
	(void)pthread_mutex_lock(&lock);
	tick();
	r = sync(fd);
	if (r == 0 && fstat(fd, &status) == 0)
		forget(status.st_ino);
	(void)pthread_mutex_unlock(&lock);
	return r;
}

EXPORT int fsync(int fd)
{
	return is_active ? sync_any(REAL(fsync), fd) : REAL(fsync)(fd);
}

EXPORT int fdatasync(int fd)
{
	return is_active ? sync_any(REAL(fdatasync), fd) : REAL(fdatasync)(fd);
}

static int rename_any(const char *from, const char *to)
{
	struct change *change;

	(void)pthread_mutex_lock(&lock);
	tick();
	if (loses) {
		change = note_change(RENAMED, to);
		(void)snprintf(change->from, sizeof change->from, "%s", from);
		for (struct page *page = pages; page; page = page->next)
			if (strcmp(page->path, from) == 0) {
				free(page->path);
				page->path = strdup(to);
			}
		for (struct length *length = lengths; length; length = length->next)
			if (strcmp(length->path, from) == 0)
				(void)snprintf(length->path, sizeof length->path, "%s", to);
	}
	{
		int r = REAL(rename)(from, to);

		(void)pthread_mutex_unlock(&lock);
		return r;
	}
}

EXPORT int renameat(int from_dir, const char *from, int to_dir, const char *to)
{
	char old[PATH_MAX], new[PATH_MAX];

	if (!find_path(from_dir, from, old) || !find_path(to_dir, to, new))
		return REAL(renameat)(from_dir, from, to_dir, to);
	return rename_any(old, new);
}

EXPORT int rename(const char *from, const char *to)
{
	return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

EXPORT int unlinkat(int dir, const char *name, int flags)
{
	char path[PATH_MAX];
	int r;

	if (!find_path(dir, name, path) || REAL(access)(path, F_OK) < 0)
		return REAL(unlinkat)(dir, name, flags);
	(void)pthread_mutex_lock(&lock);
	tick();
	if (loses)
		(void)note_change(REMOVED, path);
	r = REAL(unlinkat)(dir, name, flags);
	(void)pthread_mutex_unlock(&lock);
	return r;
}

EXPORT int unlink(const char *name)
{
	return unlinkat(AT_FDCWD, name, 0);
}
