/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cache.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int pen_cache_init(struct pen_cache *cache, const char *directory, struct pen_error *err)
{
	*cache = (struct pen_cache){
		.directory = strdup(directory),
		.pool = pen_shared_pool_create(PEN_CACHE_HELD_BYTES),
	};
	if (cache->directory && cache->pool)
		return 0;
	pen_cache_finish(cache);
	return pen_error_memory(err);
}

static void drop(struct pen_cache *cache, struct pen_cache_file *file)
{
	(void)close(file->fd);
	pen_shared_bytes_release(file->bytes);
	cache->bytes -= file->size;
	file->key[0] = '\0';
}

void pen_cache_finish(struct pen_cache *cache)
{
	pen_cache_forget(cache, "");
	pen_shared_pool_destroy(cache->pool);
	free(cache->directory);
}

int pen_cache_file_create(
	const struct pen_cache *cache, int *ret_write_fd, int *ret_read_fd, struct pen_error *err)
{
	char path[4096];
	int n = snprintf(path, sizeof path, "%s/encoding-XXXXXX", cache->directory);
	int write_fd, read_fd;

	if (n < 0 || (size_t)n >= sizeof path)
		return pen_error_system(err, ENAMETOOLONG, "%s", cache->directory);
	write_fd = mkostemp(path, O_CLOEXEC);
	if (write_fd < 0)
		return pen_error_system(err, errno, "%s", path);
	read_fd = open(path, O_RDONLY | O_CLOEXEC);
	(void)unlink(path);
	if (read_fd < 0) {
		(void)close(write_fd);
		return pen_error_system(err, errno, "%s", path);
	}
	*ret_write_fd = write_fd;
	*ret_read_fd = read_fd;
	return 0;
}

static struct pen_cache_file *find(struct pen_cache *cache, const char *key)
{
	for (size_t i = 0; i < PEN_CACHE_FILES; i++) {
		if (strcmp(cache->files[i].key, key) == 0)
			return &cache->files[i];
	}
	return NULL;
}

int pen_cache_find(struct pen_cache *cache, const char *key, uint64_t *ret_size)
{
	struct pen_cache_file *file = find(cache, key);
	int fd = file ? fcntl(file->fd, F_DUPFD_CLOEXEC, 0) : -1;

	if (fd < 0)
		return -1;
	file->used = ++cache->uses;
	file->was_found = true;
	*ret_size = file->size;
	return fd;
}

struct pen_shared_bytes *pen_cache_hold(struct pen_cache *cache, const char *key)
{
	struct pen_cache_file *file = find(cache, key);

	if (!file)
		return NULL;
	if (!file->bytes && file->was_found && file->size <= PEN_CACHE_HELD_MAX)
		file->bytes = pen_shared_bytes_read(cache->pool, file->fd, (size_t)file->size);
	if (!file->bytes)
		return NULL;
	file->used = ++cache->uses;
	return pen_shared_bytes_hold(file->bytes);
}

static struct pen_cache_file *least_used(struct pen_cache *cache)
{
	struct pen_cache_file *least = NULL;

	for (size_t i = 0; i < PEN_CACHE_FILES; i++) {
		struct pen_cache_file *file = &cache->files[i];

		if (file->key[0] && (!least || file->used < least->used))
			least = file;
	}
	return least;
}

static struct pen_cache_file *free_place(struct pen_cache *cache)
{
	for (size_t i = 0; i < PEN_CACHE_FILES; i++) {
		if (!cache->files[i].key[0])
			return &cache->files[i];
	}
	return NULL;
}

void pen_cache_put(struct pen_cache *cache, const char *key, int read_fd, uint64_t size)
{
	struct pen_cache_file *file;

	assert(key[0] && strlen(key) < PEN_CACHE_KEY);
	pen_cache_forget(cache, key);
	while (cache->bytes > 0 && (cache->bytes + size > PEN_CACHE_BYTES || !free_place(cache)))
		drop(cache, least_used(cache));
	file = free_place(cache);
	assert(file);
	*file = (struct pen_cache_file){.fd = read_fd, .size = size, .used = ++cache->uses};
	(void)snprintf(file->key, sizeof file->key, "%s", key);
	cache->bytes += size;
}

void pen_cache_forget(struct pen_cache *cache, const char *prefix)
{
	for (size_t i = 0; i < PEN_CACHE_FILES; i++) {
		struct pen_cache_file *file = &cache->files[i];

		if (file->key[0] && strncmp(file->key, prefix, strlen(prefix)) == 0)
			drop(cache, file);
	}
}
