/* SPDX-License-Identifier: Apache-2.0 */
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

/*
 * The nth allocation, or the nth call that changes a file below PEN_TORTURE_DIR or brings it onto
 * the disk, fails. To be preloaded (LD_PRELOAD) into the coordinator. PEN_TORTURE_CONTROL names a
 * file of struct control, which the test maps, too: it arms the shim while the coordinator runs, as
 * often as it likes.
 */

#define EXPORT __attribute__((visibility("default")))

enum kind { KIND_NONE, KIND_MEMORY, KIND_SPACE /* of what grows a file */, KIND_IO };

enum { FRAMES_MAX = 24 };

struct control {
	_Atomic uint32_t kind;	/* what is counted; written last to arm, first to disarm */
	_Atomic uint32_t stays; /* all that follow fail, too */
	_Atomic uint64_t at;	/* counts from 1 */
	_Atomic uint64_t count, fired;
	uint32_t depth; /* of the call that failed first, as addresses within its program or library
			 */
	uint32_t unused;
	uint64_t frames[FRAMES_MAX];
	char names[FRAMES_MAX][64];
};

static struct control *control;
static pid_t self;
static char root[PATH_MAX];

/* glibc's own, which need no look-up: that would allocate. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *block, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

#define REAL(name) ((__typeof__(&name))real(#name))

static void *real(const char *name)
{
	return dlsym(RTLD_NEXT, name);
}

__attribute__((constructor)) static void begin(void)
{
	const char *path = getenv("PEN_TORTURE_CONTROL"), *dir = getenv("PEN_TORTURE_DIR");
	char program[PATH_MAX] = "";
	void *warm[1];
	void *map;
	int fd;

	/* Workers and encoders inherit the variables, and are of no concern. */
	if (!path || !dir || readlink("/proc/self/exe", program, sizeof program - 1) < 0 ||
		strcmp(strrchr(program, '/'), "/penumbra") != 0)
		return;
	(void)snprintf(root, sizeof root, "%s/", dir);
	(void)backtrace(warm, 1); /* it loads a library the first time */
	fd = REAL(open)(path, O_RDWR | O_CLOEXEC);
	map = fd < 0 ? MAP_FAILED
		     : mmap(NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
	if (map == MAP_FAILED)
		abort();
	(void)close(fd);
	self = getpid();
	control = map;
}

/* Where it was, for whoever mends it. */
static void note_place(void)
{
	void *frames[FRAMES_MAX];
	int depth = backtrace(frames, FRAMES_MAX);

	for (int i = 0; i < depth; i++) {
		Dl_info info = {0};
		const char *name =
			dladdr(frames[i], &info) && info.dli_fname ? info.dli_fname : "?";
		const char *slash = strrchr(name, '/');

		control->frames[i] = (uintptr_t)frames[i] - (uintptr_t)info.dli_fbase;
		(void)snprintf(control->names[i], sizeof control->names[i], "%s",
			slash ? slash + 1 : name);
	}
	control->depth = (uint32_t)depth;
}

/* Whether this call is one that fails. A child between fork and exec is no coordinator. */
static bool strikes(enum kind kind)
{
	static _Thread_local bool is_inside;
	uint64_t number;

	if (!control || control->kind != kind || is_inside || getpid() != self)
		return false;
	number = ++control->count;
	if (number != control->at && !(control->stays && number > control->at))
		return false;
	if (control->fired++ == 0) {
		is_inside = true;
		note_place();
		is_inside = false;
	}
	return true;
}

static bool fails_memory(void)
{
	if (!strikes(KIND_MEMORY))
		return false;
	errno = ENOMEM;
	return true;
}

EXPORT void *malloc(size_t size)
{
	return fails_memory() ? NULL : __libc_malloc(size);
}

EXPORT void *calloc(size_t count, size_t size)
{
	return fails_memory() ? NULL : __libc_calloc(count, size);
}

EXPORT void *realloc(void *block, size_t size)
{
	return fails_memory() ? NULL : __libc_realloc(block, size);
}

EXPORT void *aligned_alloc(size_t alignment, size_t size)
{
	return fails_memory() ? NULL : __libc_memalign(alignment, size);
}

EXPORT int posix_memalign(void **ret_block, size_t alignment, size_t size)
{
	void *block = fails_memory() ? NULL : __libc_memalign(alignment, size);

	if (!block)
		return ENOMEM;
	*ret_block = block;
	return 0;
}

static bool is_below(int dir, const char *name)
{
	char link[64], path[PATH_MAX];
	ssize_t size;

	if (name && name[0] == '/')
		return strncmp(name, root, strlen(root)) == 0;
	(void)snprintf(link, sizeof link, "/proc/self/fd/%d", dir);
	size = readlink(link, path, sizeof path - 1);
	if (size < 0)
		return false;
	path[size] = '\0';
	return strncmp(path, root, strlen(root)) == 0 ||
	       ((size_t)size + 1 == strlen(root) && strncmp(path, root, (size_t)size) == 0);
}

/* grows: a full disk refuses it, too. */
static bool fails_file(int dir, const char *name, bool grows)
{
	if (!control || control->kind < KIND_SPACE || !is_below(dir, name))
		return false;
	if (grows && strikes(KIND_SPACE)) {
		errno = ENOSPC;
		return true;
	}
	if (!strikes(KIND_IO))
		return false;
	errno = EIO;
	return true;
}

EXPORT ssize_t write(int fd, const void *data, size_t size)
{
	return fails_file(fd, NULL, true) ? -1 : REAL(write)(fd, data, size);
}

EXPORT ssize_t pwrite(int fd, const void *data, size_t size, off_t offset)
{
	return fails_file(fd, NULL, true) ? -1 : REAL(pwrite)(fd, data, size, offset);
}

EXPORT ssize_t pwrite64(int fd, const void *data, size_t size, off_t offset)
	__attribute__((alias("pwrite")));

EXPORT int ftruncate(int fd, off_t size)
{
	return fails_file(fd, NULL, true) ? -1 : REAL(ftruncate)(fd, size);
}

EXPORT int ftruncate64(int fd, off_t size) __attribute__((alias("ftruncate")));

EXPORT int posix_fallocate(int fd, off_t offset, off_t size)
{
	return fails_file(fd, NULL, true) ? errno : REAL(posix_fallocate)(fd, offset, size);
}

EXPORT int posix_fallocate64(int fd, off_t offset, off_t size)
	__attribute__((alias("posix_fallocate")));

EXPORT int fsync(int fd)
{
	return fails_file(fd, NULL, false) ? -1 : REAL(fsync)(fd);
}

EXPORT int fdatasync(int fd)
{
	return fails_file(fd, NULL, false) ? -1 : REAL(fdatasync)(fd);
}

EXPORT int openat(int dir, const char *name, int flags, ...)
{
	mode_t mode = 0;
	va_list args;

	va_start(args, flags);
	if (flags & (O_CREAT | O_TMPFILE))
		mode = (mode_t)va_arg(args, int);
	va_end(args);
	if ((flags & O_CREAT) && fails_file(dir, name, true))
		return -1;
	return REAL(openat)(dir, name, flags, mode);
}

EXPORT int openat64(int dir, const char *name, int flags, ...) __attribute__((alias("openat")));

EXPORT int open(const char *name, int flags, ...)
{
	mode_t mode = 0;
	va_list args;

	va_start(args, flags);
	if (flags & (O_CREAT | O_TMPFILE))
		mode = (mode_t)va_arg(args, int);
	va_end(args);
	return openat(AT_FDCWD, name, flags, mode);
}

EXPORT int open64(const char *name, int flags, ...) __attribute__((alias("open")));

EXPORT int renameat(int from_dir, const char *from, int to_dir, const char *to)
{
	return fails_file(to_dir, to, true) ? -1 : REAL(renameat)(from_dir, from, to_dir, to);
}

EXPORT int rename(const char *from, const char *to)
{
	return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

EXPORT int linkat(int from_dir, const char *from, int to_dir, const char *to, int flags)
{
	return fails_file(to_dir, to, true) ? -1 : REAL(linkat)(from_dir, from, to_dir, to, flags);
}

EXPORT int unlinkat(int dir, const char *name, int flags)
{
	return fails_file(dir, name, false) ? -1 : REAL(unlinkat)(dir, name, flags);
}

EXPORT int unlink(const char *name)
{
	return unlinkat(AT_FDCWD, name, 0);
}
