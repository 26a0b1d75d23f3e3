/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SHARED_BYTES_H
#define PEN_SERVER_SHARED_BYTES_H

#include <stddef.h>
#include <stdint.h>

/*
 * Bytes in memory that several answers carry at the same time, freed with the last of them. All
 * that come from one pool are bounded together, whoever still holds them.
 */
struct pen_shared_pool;

struct pen_shared_bytes {
	struct pen_shared_pool *pool;
	unsigned holders;
	size_t size;
	char data[];
};

/* NULL without memory. It may be let go of while its bytes are held. */
struct pen_shared_pool *pen_shared_pool_create(uint64_t bytes_max);
void pen_shared_pool_destroy(struct pen_shared_pool *pool);

/* The first size bytes of a file, held once; NULL when the pool is full or they cannot be read. */
struct pen_shared_bytes *pen_shared_bytes_read(struct pen_shared_pool *pool, int fd, size_t size);

struct pen_shared_bytes *pen_shared_bytes_hold(struct pen_shared_bytes *bytes);

/* NULL is fine. */
void pen_shared_bytes_release(struct pen_shared_bytes *bytes);

#endif
