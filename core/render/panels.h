/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_PANELS_H
#define PEN_RENDER_PANELS_H

#include "core/base/error.h"
#include "core/render/light.h"
#include "core/render/scene.h"

/*
 * Rectangles that a shape's triangles tile without gap or overlap and that send out the same light
 * all over. Each is one light, sampled by the solid angle of the whole, instead of as many as it
 * has triangles.
 */
struct pen_panels {
	struct pen_light *items;
	uint32_t count, capacity;
	uint64_t seen; /* triangles that were looked at */
};

/*
 * Adds those of a shape whose triangles send out light. numbers, one of each of its primitives, is
 * PEN_NO_INDEX all over; of those in a panel it becomes first plus the panel's place in items.
 * None are found in what moves or does not shine evenly, nor once more than
 * PEN_PANEL_TRIANGLES_MAX triangles were looked at. PEN_ENOMEM.
 */
int pen_panels_find(struct pen_panels *panels, const struct pen_render_scene *scene, uint32_t shape,
	uint32_t first, uint32_t *numbers, struct pen_error *err);
void pen_panels_finish(struct pen_panels *panels);

#endif
