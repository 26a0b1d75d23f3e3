/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_READING_H
#define PEN_SCENE_GLTF_READING_H

#include "core/base/buf.h"
#include "core/base/limits.h"
#include "core/scene/desc.h"
#include "core/scene/gltf_model.h"
#include "core/scene/parse.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A camera that a glTF object brings, for pen_scene_expand to choose from. */
struct pen_gltf_camera_found {
	const char *name, *node_name;
	uint32_t node; /* of the scene */
	const struct pen_gltf_camera *camera;
};

/* The objects that a mesh of the asset becomes: one a primitive, as they stand before placing. */
struct pen_gltf_shapes {
	struct pen_object_desc *items;
	uint32_t count;
	uint32_t uses;	/* nodes of the asset's scene that show it, copies included */
	uint32_t first; /* of its hidden originals in the scene; PEN_NO_INDEX: none yet */
	bool is_read;
	bool deforms; /* has morph targets */
};

/* What an accessor's numbers were read into, for the next who asks. */
struct pen_gltf_floats {
	const float *items;
};

/* One asset while it is read; what it becomes is added to the lists. */
struct pen_gltf_asset {
	bool is_open;			/* or was, until it was refused */
	struct pen_gltf *gltf;		/* NULL: refused as a whole */
	uint32_t index;			/* of scene->assets */
	struct pen_gltf_floats *floats; /* one an accessor */
	struct pen_gltf_shapes *shapes; /* one a mesh */
	uint32_t *materials; /* of the scene, one each, and the default one; or none yet */
	uint32_t *pictures;  /* one an image; PEN_NO_INDEX: none yet */
	uint32_t *textures;  /* two a texture: linear, sRGB */
	const struct pen_node_desc *nodes; /* as the asset has them, parents its own; tracks read */
	const struct pen_track *weights;   /* of morph targets, one a node */
	const uint32_t *order;		   /* of the default scene's nodes, parents first */
	uint32_t order_count;
	size_t zeros; /* numbers that no bytes stand for */
};

/* All reading of one scene. The lists are copied into the scene's arena in the end. */
struct pen_gltf_reading {
	struct pen_scene *scene;
	struct pen_scene_errors *errors;
	size_t found;	    /* errors, also those that there is no room for */
	bool out_of_memory; /* of the machine */
	bool is_full;	    /* a list or the memory has reached its limit */

	const char *pointer; /* of the glTF object at hand */
	struct pen_gltf_asset *asset;
	const struct pen_gltf_model *model; /* of the asset */
	char place[160];		    /* within it, for people */
	size_t part;			    /* length of the place without its last part */

	struct pen_buf objects, nodes, lights, materials, textures, pictures, skins, cameras;
	struct pen_buf warnings; /* const char * each */
};

void pen_gltf_reading_init(
	struct pen_gltf_reading *r, struct pen_scene *scene, struct pen_scene_errors *errors);
void pen_gltf_reading_finish(struct pen_gltf_reading *r);

/* Copies the lists into the scene. */
void pen_gltf_reading_take(struct pen_gltf_reading *r);

/* Names the place for errors and warnings: mesh 3 "Cube"; the part within it: primitive 0. */
void pen_gltf_at(struct pen_gltf_reading *r, const char *kind, size_t index, const char *name);
void pen_gltf_at_part(struct pen_gltf_reading *r, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

/* Notes that something at the place is wrong. */
void pen_gltf_refuse(struct pen_gltf_reading *r, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

/* Tells people that something at the place is left out. */
void pen_gltf_warn(struct pen_gltf_reading *r, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

/* Zeroed memory of the scene; NULL, and the reading fails in the end, when there is no more. */
void *pen_gltf_alloc(struct pen_gltf_reading *r, size_t count, size_t size);

/* A copy of a text of the asset, made fit to print. */
const char *pen_gltf_text(struct pen_gltf_reading *r, const char *text);

/*
 * Appends an item to a list and returns its index. Past max the reading fails and the index is
 * PEN_NO_INDEX.
 */
uint32_t pen_gltf_add(struct pen_gltf_reading *r, struct pen_buf *list, const void *item,
	size_t size, uint32_t max);

/* False once the reading can only fail. */
static inline bool pen_gltf_sound(const struct pen_gltf_reading *r)
{
	return !r->out_of_memory && !r->is_full;
}

#endif
