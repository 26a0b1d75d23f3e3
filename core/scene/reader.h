/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_READER_H
#define PEN_SCENE_READER_H

#include "core/base/arena.h"
#include "core/base/limits.h"
#include "core/scene/parse.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Where a value stands: a chain of steps up to the root, each on its function's stack. */
struct pen_place {
	const struct pen_place *parent; /* NULL: this is the root */
	const char *key;		/* NULL: an element of an array */
	size_t position;		/* among its parent's members, in document order */
};

/* A place as plain numbers, so that places compare in document order. */
struct pen_trail {
	size_t depth;
	size_t steps[PEN_SCENE_DEPTH_MAX + 1];
};

/* One reading of one scene tree: whose memory, what was wrong, how large the tree is. */
struct pen_reader {
	struct pen_scene *scene;
	struct pen_scene_errors *errors; /* sorted in document order */
	struct pen_trail trails[PEN_SCENE_ERRORS_MAX];
	size_t found;  /* offenders met, also those that errors has no room for */
	size_t values; /* in the tree; it stops growing at PEN_SCENE_NODES_MAX */
	bool has_gltf; /* some object is a glTF */
	bool out_of_memory;
};

void pen_reader_init(struct pen_reader *reader, struct pen_scene *scene, json_t *tree,
	struct pen_scene_errors *errors);

/* Notes that the value at the place is wrong, and why. The first offenders of the document stay. */
void pen_reader_refuse(struct pen_reader *reader, const struct pen_place *at, const char *format,
	...) __attribute__((format(printf, 3, 4)));

/* Zeroed memory of the scene; NULL, and the reading fails in the end, when there is no more. */
void *pen_reader_alloc(struct pen_reader *reader, size_t count, size_t size);

const char *pen_reader_text(struct pen_reader *reader, const char *text);

/* The JSON pointer of a place, as errors have it. */
const char *pen_reader_pointer(struct pen_reader *reader, const struct pen_place *at);

/* False once memory ran out or the tree grew too large: the reading fails whatever follows. */
bool pen_reader_sound(const struct pen_reader *reader);

/* Adds to the tree what it left out. Takes the value, which may be NULL (out of memory). */
void pen_reader_fill(struct pen_reader *reader, json_t *object, const char *key, json_t *value);

/* The place of a member; one that the object does not have stands behind all others. */
struct pen_place pen_place_member(const struct pen_place *parent, json_t *object, const char *key);
struct pen_place pen_place_element(const struct pen_place *parent, size_t index);

#endif
