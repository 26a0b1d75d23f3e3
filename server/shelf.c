/* SPDX-License-Identifier: Apache-2.0 */
#include "server/shelf.h"

#include "core/base/limits.h"
#include "server/asset_file.h"
#include "server/durable.h"

#include <pthread.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

enum { SLOW_BYTES = 256 << 10 };

struct entry {
	struct pen_sha256 name;
	json_t *tree; /* NULL: free; never changed, for others copy it */
	size_t size;  /* of the text */
	uint64_t used;
};

struct pen_shelf {
	const char *dir;
	pthread_mutex_t lock;
	uint64_t uses;
	struct entry entries[PEN_SHELF_TREES_MAX];
};

int pen_shelf_create(const char *dir, struct pen_shelf **ret_shelf, struct pen_error *err)
{
	struct pen_shelf *shelf = calloc(1, sizeof *shelf);

	if (!shelf)
		return pen_error_memory(err);
	shelf->dir = dir;
	(void)pthread_mutex_init(&shelf->lock, NULL);
	pen_durable_sweep(dir);
	*ret_shelf = shelf;
	return 0;
}

void pen_shelf_destroy(struct pen_shelf *shelf)
{
	if (!shelf)
		return;
	for (size_t i = 0; i < PEN_SHELF_TREES_MAX; i++)
		json_decref(shelf->entries[i].tree);
	(void)pthread_mutex_destroy(&shelf->lock);
	free(shelf);
}

bool pen_shelf_has(const struct pen_shelf *shelf, const struct pen_sha256 *name)
{
	return pen_asset_file_touch(shelf->dir, name);
}

int pen_shelf_open(const struct pen_shelf *shelf, const struct pen_sha256 *name, int *ret_fd,
	uint64_t *ret_size, struct pen_error *err)
{
	return pen_asset_file_open(shelf->dir, name, ret_fd, ret_size, err);
}

/* A reference to the tree, or NULL. */
static json_t *find(struct pen_shelf *shelf, const struct pen_sha256 *name)
{
	json_t *tree = NULL;

	(void)pthread_mutex_lock(&shelf->lock);
	for (size_t i = 0; i < PEN_SHELF_TREES_MAX; i++) {
		struct entry *entry = &shelf->entries[i];

		if (!entry->tree || !pen_sha256_equal(&entry->name, name))
			continue;
		entry->used = ++shelf->uses;
		tree = json_incref(entry->tree);
	}
	(void)pthread_mutex_unlock(&shelf->lock);
	return tree;
}

/* In place of the tree that was used longest ago. */
static void remember(
	struct pen_shelf *shelf, const struct pen_sha256 *name, json_t *tree, size_t size)
{
	struct entry *place = &shelf->entries[0];

	(void)pthread_mutex_lock(&shelf->lock);
	for (size_t i = 0; i < PEN_SHELF_TREES_MAX; i++) {
		struct entry *entry = &shelf->entries[i];

		if (entry->tree && pen_sha256_equal(&entry->name, name)) {
			place = entry;
			break;
		}
		if (entry->used < place->used)
			place = entry;
	}
	json_decref(place->tree);
	*place = (struct entry){*name, json_incref(tree), size, ++shelf->uses};
	(void)pthread_mutex_unlock(&shelf->lock);
}

/* Whether it is a scene without any override; reading fills defaults in, so it reads a copy. */
static int check_scene(const json_t *tree, struct pen_scene_errors *errors, struct pen_error *err)
{
	json_t *copy = json_deep_copy(tree);
	struct pen_scene *scene;
	int r = copy ? pen_scene_parse(copy, &scene, errors, err) : pen_error_memory(err);

	if (r == 0)
		pen_scene_destroy(scene);
	json_decref(copy);
	return r;
}

int pen_shelf_put(struct pen_shelf *shelf, const struct pen_sha256 *name, const char *text,
	size_t size, struct pen_scene_errors *errors, struct pen_error *err)
{
	char file[PEN_SHA256_TEXT];
	struct pen_sha256 actual;
	json_t *tree;
	int r = pen_sha256_of(text, size, &actual, err);

	errors->count = 0;
	if (r < 0)
		return r;
	if (!pen_sha256_equal(&actual, name))
		return pen_error_set(err, PEN_ECONFLICT, "the bytes have another SHA-256");
	r = pen_json_parse(text, size, &tree, err);
	if (r < 0)
		return r;
	r = check_scene(tree, errors, err);
	pen_sha256_format(name, file);
	if (r == 0)
		r = pen_durable_write(shelf->dir, file, text, size, err);
	if (r == 0)
		remember(shelf, name, tree, size);
	json_decref(tree);
	return r;
}

static int read_tree(struct pen_shelf *shelf, const struct pen_sha256 *name, json_t **ret_tree,
	struct pen_error *err)
{
	uint64_t size;
	void *text;
	int fd, r = pen_shelf_open(shelf, name, &fd, &size, err);

	if (r < 0)
		return r;
	text = mmap(NULL, (size_t)size, PROT_READ, MAP_PRIVATE, fd, 0);
	(void)close(fd);
	if (text == MAP_FAILED)
		return pen_error_set(err, PEN_EIO, "a kept scene cannot be read");
	r = pen_json_parse(text, (size_t)size, ret_tree, err);
	(void)munmap(text, (size_t)size);
	if (r < 0 && r != PEN_ENOMEM)
		return pen_error_set(err, PEN_EIO, "a kept scene is damaged");
	if (r < 0)
		return r;
	remember(shelf, name, *ret_tree, (size_t)size);
	return 0;
}

int pen_shelf_get(struct pen_shelf *shelf, const struct pen_sha256 *name, json_t **ret_tree,
	struct pen_error *err)
{
	json_t *tree = NULL, *copy;
	int r = 0;

	if (!pen_shelf_has(shelf, name))
		return pen_error_set(err, PEN_ENOTFOUND, "there is no such scene");
	tree = find(shelf, name);
	if (!tree)
		r = read_tree(shelf, name, &tree, err);
	if (r < 0)
		return r;
	copy = json_deep_copy(tree);
	json_decref(tree);
	if (!copy)
		return pen_error_memory(err);
	*ret_tree = copy;
	return 0;
}

bool pen_shelf_is_slow(struct pen_shelf *shelf)
{
	bool is_slow = false;

	(void)pthread_mutex_lock(&shelf->lock);
	for (size_t i = 0; i < PEN_SHELF_TREES_MAX; i++)
		is_slow |= shelf->entries[i].tree && shelf->entries[i].size >= SLOW_BYTES;
	(void)pthread_mutex_unlock(&shelf->lock);
	return is_slow;
}
