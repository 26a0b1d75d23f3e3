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
	*cache = (struct pen_cache){.directory = strdup(directory)};
	return cache->directory ? 0 : pen_error_memory(err);
}

static void drop(struct pen_cache *cache, struct pen_cache_file *file)
{
	(void)close(file->fd);
	cache->bytes -= file->size;
	file->key[0] = '\0';
}

void pen_cache_finish(struct pen_cache *cache)
{
	pen_cache_forget(cache, "");
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

int pen_cache_find(struct pen_cache *cache, const char *key, uint64_t *ret_size)
{
	for (size_t i = 0; i < PEN_CACHE_FILES; i++) {
		struct pen_cache_file *file = &cache->files[i];
		int fd;

		if (strcmp(file->key, key) != 0)
			continue;
		fd = fcntl(file->fd, F_DUPFD_CLOEXEC, 0);
		if (fd >= 0) {
			file->used = ++cache->uses;
			*ret_size = file->size;
		}
		return fd;
	}
	return -1;
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
