/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_EMITTERS_H
#define PEN_RENDER_EMITTERS_H

#include "core/render/light_tree.h"
#include "core/render/panels.h"
#include "core/render/scene.h"

/*
 * The primitives of a scene that send out light of their own: triangles, and spheres in world
 * coordinates, of principled materials with emission. Where a texture is black all over a triangle
 * that is none. Triangles of a panel are none either: the panel is a light in their stead.
 */
struct pen_emitter {
	uint32_t shape, primitive;
};

struct pen_emitters {
	struct pen_emitter *items;
	uint32_t count;
	uint32_t *firsts; /* of each shape: where its primitives are in numbers, or PEN_NO_INDEX */
	uint32_t shape_count;
	uint32_t *numbers; /* the light that a primitive is or is a part of, or PEN_NO_INDEX */
};

/*
 * Finds the panels, which are lights from number `before` on, and the emitters, which follow them;
 * and the hull of each emitter for the whole time that the shutter is open. ret_hulls has room for
 * as many more as there are lights before the emitters, and is the caller's to free; panels are
 * the caller's to finish, whatever is returned. PEN_ELIMIT beyond PEN_EMITTERS_MAX, PEN_ENOMEM.
 */
int pen_emitters_init(struct pen_emitters *emitters, const struct pen_render_scene *scene,
	uint32_t before, struct pen_panels *panels, struct pen_light_hull **ret_hulls,
	struct pen_error *err);
void pen_emitters_finish(struct pen_emitters *emitters);

/* The light that a primitive of a shape is or is a part of, or PEN_NO_INDEX. */
static inline uint32_t pen_emitters_find(
	const struct pen_emitters *emitters, uint32_t shape, uint32_t primitive)
{
	const uint32_t first =
		shape < emitters->shape_count ? emitters->firsts[shape] : PEN_NO_INDEX;

	return first != PEN_NO_INDEX ? emitters->numbers[first + primitive] : PEN_NO_INDEX;
}

/* What an emitter is at a fraction of the shutter, as a light without color. */
void pen_emitter_place(const struct pen_render_scene *scene, const struct pen_emitter *emitter,
	float time, struct pen_light *ret_light);

#endif
