/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SHELF_H
#define PEN_SERVER_SHELF_H

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/scene/parse.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/*
 * Scenes that are kept for many views, named by the SHA-256 of the text as it was sent: files as in
 * server/asset_file.h, and the trees of those that were used last, so that a view costs no reading.
 * Any thread may call.
 */
struct pen_shelf;

/* dir exists and is borrowed. */
int pen_shelf_create(const char *dir, struct pen_shelf **ret_shelf, struct pen_error *err);
void pen_shelf_destroy(struct pen_shelf *shelf);

/* Whether it is there; one that is counts as wanted now. */
bool pen_shelf_has(const struct pen_shelf *shelf, const struct pen_sha256 *name);

/* Its file, read-only; the caller closes it. PEN_ENOTFOUND. */
int pen_shelf_open(const struct pen_shelf *shelf, const struct pen_sha256 *name, int *ret_fd,
	uint64_t *ret_size, struct pen_error *err);

/*
 * Keeps a text, durably; blocks on the disk. PEN_ECONFLICT when its name is another; PEN_EINVALID
 * when it is no scene, with errors if there is a place to point at.
 */
int pen_shelf_put(struct pen_shelf *shelf, const struct pen_sha256 *name, const char *text,
	size_t size, struct pen_scene_errors *errors, struct pen_error *err);

/* A copy of its tree, for the caller to change and to decref. PEN_ENOTFOUND. */
int pen_shelf_get(struct pen_shelf *shelf, const struct pen_sha256 *name, json_t **ret_tree,
	struct pen_error *err);

/* Whether a tree that was used lately is so large that no loop should wait for a copy of it. */
bool pen_shelf_is_slow(struct pen_shelf *shelf);

#endif
