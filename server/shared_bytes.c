/* SPDX-License-Identifier: Apache-2.0 */
#include "server/shared_bytes.h"

#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

struct pen_shared_pool {
	uint64_t bytes, bytes_max;
	unsigned holders; /* its owner, and all bytes that came from it */
};

struct pen_shared_pool *pen_shared_pool_create(uint64_t bytes_max)
{
	struct pen_shared_pool *pool = calloc(1, sizeof *pool);

	if (pool)
		*pool = (struct pen_shared_pool){.bytes_max = bytes_max, .holders = 1};
	return pool;
}

static void pool_release(struct pen_shared_pool *pool)
{
	if (--pool->holders == 0)
		free(pool);
}

void pen_shared_pool_destroy(struct pen_shared_pool *pool)
{
	if (pool)
		pool_release(pool);
}

static bool read_all(int fd, char *data, size_t size)
{
	for (size_t done = 0; done < size;) {
		ssize_t n = pread(fd, data + done, size - done, (off_t)done);

		if (n <= 0)
			return false;
		done += (size_t)n;
	}
	return true;
}

struct pen_shared_bytes *pen_shared_bytes_read(struct pen_shared_pool *pool, int fd, size_t size)
{
	struct pen_shared_bytes *bytes;

	if (size > pool->bytes_max - pool->bytes)
		return NULL;
	bytes = malloc(sizeof *bytes + size);
	if (!bytes || !read_all(fd, bytes->data, size)) {
		free(bytes);
		return NULL;
	}
	bytes->pool = pool;
	bytes->holders = 1;
	bytes->size = size;
	pool->bytes += size;
	pool->holders++;
	return bytes;
}

struct pen_shared_bytes *pen_shared_bytes_hold(struct pen_shared_bytes *bytes)
{
	bytes->holders++;
	return bytes;
}

void pen_shared_bytes_release(struct pen_shared_bytes *bytes)
{
	if (!bytes || --bytes->holders > 0)
		return;
	bytes->pool->bytes -= bytes->size;
	pool_release(bytes->pool);
	free(bytes);
}
