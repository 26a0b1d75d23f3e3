/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_SANDBOX_H
#define PEN_BASE_SANDBOX_H

#include "core/base/error.h"

#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

/*
 * What a process gives up before it reads bytes from outside: file system and network (Landlock),
 * every system call that it does not need (seccomp), capabilities, core dumps, memory and
 * descriptors beyond a limit.
 */

enum pen_sandbox_profile {
	/* Reads inherited descriptors, receives new ones, starts threads, forks, waits. */
	PEN_SANDBOX_SCENE,
	/* Stacked on SCENE after the fork: computes, reads and writes its descriptors; no more. */
	PEN_SANDBOX_RENDER,
	/* Memory, and read, write, pread, pwrite and ftruncate on inherited descriptors. */
	PEN_SANDBOX_ENCODER
};

enum pen_sandbox_mode {
	PEN_SANDBOX_REQUIRE,	 /* fail when the kernel lacks Landlock or seccomp */
	PEN_SANDBOX_BEST_EFFORT, /* take what it has */
	PEN_SANDBOX_OFF		 /* limits only */
};

struct pen_sandbox_limits {
	uint64_t memory_bytes; /* address space; 0 = unlimited */
	uint32_t cpu_s;	       /* processor seconds of one process; 0 = unlimited */
	uint32_t files;	       /* highest descriptor + 1; 0 = 64 */
};

/* From "require", "best-effort" or "off"; PEN_EINVALID names the choices. */
int pen_sandbox_mode_parse(
	const char *name, enum pen_sandbox_mode *ret_mode, struct pen_error *err);

const char *pen_sandbox_mode_name(enum pen_sandbox_mode mode);

/* False in builds with a sanitizer: see pen_sandbox_enter. */
bool pen_sandbox_is_built(void);

/*
 * Confines the calling process for good. Call it before any thread exists: threads and children
 * made afterwards inherit it. Inside, opening and stat of a path fail with EACCES; anything else
 * forbidden ends the process with SIGSYS. A failure may leave it half confined: leave then; with
 * PEN_EUNSUPPORTED the text names what the kernel lacks.
 *
 * Sanitizers open files, trace and map without bounds: in their builds every mode means OFF and
 * the memory limit is not set.
 */
int pen_sandbox_enter(enum pen_sandbox_profile profile, enum pen_sandbox_mode mode,
	const struct pen_sandbox_limits *limits, struct pen_error *err);

/*
 * What this process may compute from now on, all its threads together, before the kernel ends it by
 * SIGXCPU; 0: without bound, as far as pen_sandbox_enter left it so. Nothing in builds with a
 * sanitizer. It can be called within the sandbox of a scene process.
 */
int pen_sandbox_allow_cpu(uint32_t seconds, struct pen_error *err);

/*
 * Has the kernel send signal_number when parent ends, and ends the process at once when it already
 * has. parent is what getpid() gave before the fork. Not inherited: each child calls it anew.
 */
int pen_process_bind(pid_t parent, int signal_number, struct pen_error *err);

/* Closes every descriptor but 0, 1, 2 and those in keep. */
int pen_process_close_except(const int *keep, size_t count, struct pen_error *err);

#endif
