/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_LAYOUT_H
#define PEN_RENDER_LAYOUT_H

#include "core/base/buf.h"
#include "core/render/geometry.h"

enum { PEN_LAYOUT_POOLS = 11 };

/*
 * The pools of a geometry while they grow. Functions that add return PEN_ELIMIT, and say so in err,
 * when a pool would pass PEN_GEOMETRY_BYTES_MAX or memory is short.
 */
struct pen_layout {
	const struct pen_scene *scene;
	enum pen_geometry_part part;
	struct pen_shutter shutter;
	struct pen_buf vertices, normals, uvs, colors, tangents, indices, spheres, disks,
		placements, models, shapes;
	uint32_t *own_models;  /* of each object, unplaced; PEN_NO_INDEX: not made yet */
	struct pen_box *boxes; /* of each object; zeros: not found yet */
	struct pen_error *err;
};

/* For the frame's shutter. */
int pen_layout_init(
	struct pen_layout *l, const struct pen_scene *scene, uint32_t frame, struct pen_error *err);
void pen_layout_finish(struct pen_layout *l);

/* Hands the pools over; the layout is empty afterwards. */
void pen_layout_take(struct pen_layout *l, struct pen_geometry *ret_geometry);

/* The pools as they are; they stay the layout's, and move when it grows. */
struct pen_geometry pen_layout_view(const struct pen_layout *l);

/* How full the pools are, and back to that. */
struct pen_layout_mark {
	size_t sizes[PEN_LAYOUT_POOLS];
};

struct pen_layout_mark pen_layout_mark(struct pen_layout *l);
void pen_layout_rewind(struct pen_layout *l, const struct pen_layout_mark *mark);

/* Own models from an index on are not made yet. */
void pen_layout_forget_models(struct pen_layout *l, uint32_t first);

/* The bytes in all pools. */
size_t pen_layout_bytes(struct pen_layout *l);

/* How many items of a size a pool holds. */
uint32_t pen_layout_count(const struct pen_buf *pool, size_t size);

/* Appends count items of a size for the caller to fill; NULL on failure. */
void *pen_layout_extend(struct pen_layout *l, struct pen_buf *pool, size_t count, size_t size);

int pen_layout_add_model(struct pen_layout *l, const struct pen_model *model, uint32_t *ret_model);
int pen_layout_add_shape(struct pen_layout *l, const struct pen_shape *shape);
int pen_layout_add_sphere(struct pen_layout *l, const double center[3], double radius);

/* Triangles whose vertices begin at vertex_first; mirrored ones are wound the other way. */
int pen_layout_add_indices(struct pen_layout *l, const uint32_t *indices, uint32_t triangles,
	uint32_t vertex_first, bool mirrored);

#endif
