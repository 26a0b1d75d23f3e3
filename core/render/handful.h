/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_HANDFUL_H
#define PEN_RENDER_HANDFUL_H

#include "core/render/geometry.h"
#include "core/render/packet.h"
#include "core/render/vec.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * The few large primitives of a scene (floor, lights, single spheres), tested one after the other
 * by sixteen rays at once: for so few that is several times faster than a tree, see
 * deploy/decisions/0006-a-handful-without-a-tree.md. What a ray hits depends on the ray alone.
 */

enum { PEN_HANDFUL_MAX = 16 }; /* of triangles, and of spheres */

struct pen_handful_triangle {
	struct pen_vec3 a, b, c;
	struct pen_vec3 normal; /* not unit */
	uint32_t shape, primitive;
};

/* At a time t of the shutter: start + t * change. */
struct pen_handful_sphere {
	struct pen_sphere start, change;
	uint32_t shape, primitive;
};

struct pen_handful {
	struct pen_handful_triangle triangles[PEN_HANDFUL_MAX];
	struct pen_handful_sphere spheres[PEN_HANDFUL_MAX];
	uint32_t triangle_count, sphere_count;
};

/*
 * Takes a shape, all of it, if it is small and there is room: spheres, and triangles at rest, in
 * world coordinates, at most two steps of them, of which none lets rays pass.
 */
bool pen_handful_take(
	struct pen_handful *handful, const struct pen_geometry *geometry, uint32_t shape);

/* Extends a box by everything in it at all times: the least coordinates, then the largest. */
void pen_handful_extend_box(const struct pen_handful *handful, float box[2][3]);

/* Moves tfar to the closest hits, and writes to hits where there are any. */
void pen_handful_closest(const struct pen_handful *handful, struct pen_packet *packet);

/* Makes tfar -INFINITY where anything is in between; false when that ended the last ray. */
bool pen_handful_occluded(const struct pen_handful *handful, struct pen_rays *rays);

#endif
