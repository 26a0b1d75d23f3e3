/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_DEFORM_H
#define PEN_RENDER_DEFORM_H

#include "core/base/error.h"
#include "core/render/motion.h"

/*
 * Meshes that change their form: by keys of their vertices, by morph targets, by a skin. Morphs
 * come first, as in glTF 2.0; a skin takes vertices to the world.
 */

/* As many time steps as a deforming mesh may have: each holds all its vertices. */
enum { PEN_DEFORM_STEPS_MAX = 33 };

/*
 * The steps of a mesh's own vertices: of keyed ones those of pen_motion_mesh_steps; else the fewest
 * (see pen_segments_to_try) between which no joint takes a corner of the mesh's box further from
 * its path than a thousandth of the box's size, and no morph weight is off by a thousandth, at
 * three places of each segment; 1 when it keeps its form.
 */
uint32_t pen_deform_steps(const struct pen_scene *scene, const struct pen_object_desc *mesh,
	const struct pen_shutter *shutter);

/*
 * Vertices and, unless ret_normals is NULL, normals of a mesh at a time: 3 * vertex_count floats
 * each. Normals go with the form: by the inverse transpose of the skin, by the morphs' own, and
 * where those are missing turned as their surroundings turn. PEN_ENOMEM.
 */
int pen_deform_at(const struct pen_scene *scene, const struct pen_object_desc *mesh, double time,
	float *ret_vertices, float *ret_normals, struct pen_error *err);

/* Whether a skinned mesh is shown mirrored at a time. */
bool pen_deform_is_mirrored(
	const struct pen_scene *scene, const struct pen_object_desc *mesh, double time);

#endif
