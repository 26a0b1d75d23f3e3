/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CACHE_H
#define PEN_SERVER_CACHE_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "server/shared_bytes.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * The encoded images that were asked for last, as open files without a name: they need no clean-up
 * after a crash and vanish with the coordinator. At most PEN_CACHE_FILES and, but for the newest,
 * PEN_CACHE_BYTES; the least recently used goes first. A small one that is asked for again is held
 * in memory too, from which it goes out faster.
 */
enum { PEN_CACHE_KEY = 192 };

struct pen_cache_file {
	char key[PEN_CACHE_KEY]; /* "" when the place is free */
	int fd;
	uint64_t size;
	uint64_t used; /* rises with each use */
	bool was_found;
	struct pen_shared_bytes *bytes; /* NULL: not in memory */
};

struct pen_cache {
	char *directory;
	struct pen_cache_file files[PEN_CACHE_FILES];
	uint64_t bytes;
	uint64_t uses;
	struct pen_shared_pool *pool;
};

int pen_cache_init(struct pen_cache *cache, const char *directory, struct pen_error *err);
void pen_cache_finish(struct pen_cache *cache);

/* A new file in the cache's directory, without a name; one descriptor to fill it, one to read it.
 */
int pen_cache_file_create(
	const struct pen_cache *cache, int *ret_write_fd, int *ret_read_fd, struct pen_error *err);

/* A descriptor of the caller's own, or -1. */
int pen_cache_find(struct pen_cache *cache, const char *key, uint64_t *ret_size);

/* The whole file, which the caller releases; NULL when it is not in memory. */
struct pen_shared_bytes *pen_cache_hold(struct pen_cache *cache, const char *key);

/* Keeps read_fd, which passes to the cache, in place of what it had under this key. */
void pen_cache_put(struct pen_cache *cache, const char *key, int read_fd, uint64_t size);

/* Drops every file whose key starts with prefix. */
void pen_cache_forget(struct pen_cache *cache, const char *prefix);

#endif
