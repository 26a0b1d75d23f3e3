/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_MOTION_H
#define PEN_RENDER_MOTION_H

#include "core/render/affine.h"
#include "core/scene/desc.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * Where objects are while the shutter is open. Embree wants equidistant time steps between the
 * shutter's opening and closing; key frames are brought to that form by rules that depend on the
 * scene alone.
 */

enum { PEN_MOTION_STEPS_MAX = 129 };

struct pen_shutter {
	double open, close;
};

/* When the shutter opens and closes for a frame. */
struct pen_shutter pen_shutter_of(const struct pen_scene *scene, uint32_t frame);

/* The time of step i of count, 0 <= i < count; the opening when count is 1. */
double pen_shutter_time(const struct pen_shutter *shutter, uint32_t step, uint32_t count);

struct pen_box {
	double lower[3], upper[3];
};

/* What holds a mesh or sphere in its own coordinates, before it deforms. */
struct pen_box pen_motion_box(const struct pen_object_desc *object);

/* World from own coordinates at a time. */
struct pen_affine pen_motion_world(
	const struct pen_scene *scene, const struct pen_object_desc *object, double time);

/*
 * The number of steps: 1 when the object stands still, else the fewest whose interpolation is
 * exact, at most PEN_MOTION_STEPS_MAX (then it is a close approximation). No rotation between two
 * steps reaches 90 degrees. Of an object with a node: the fewest that show it to a thousandth of
 * its size (pen_node_steps); box holds it.
 */
uint32_t pen_motion_steps(const struct pen_scene *scene, const struct pen_object_desc *object,
	const struct pen_box *box, const struct pen_shutter *shutter);

/* The same of the vertices of a deforming mesh. */
uint32_t pen_motion_mesh_steps(
	const struct pen_object_desc *mesh, const struct pen_shutter *shutter);

/* Whether the object is the same at all times, whatever the shutter: so is what it is made of. */
bool pen_motion_rests(const struct pen_scene *scene, const struct pen_object_desc *object);

/* Whether a mesh has the same vertices in its own coordinates at all times. */
bool pen_motion_mesh_is_rigid(const struct pen_object_desc *mesh);

/* The vertices of a mesh at a time: ret_vertices holds 3 * vertex_count floats. */
void pen_motion_mesh_vertices(const struct pen_object_desc *mesh, double time, float *ret_vertices);

#endif
