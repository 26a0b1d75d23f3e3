/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_ATTRIBUTES_H
#define PEN_RENDER_ATTRIBUTES_H

#include "core/render/layout.h"
#include "core/render/motion.h"

/*
 * Adds what shading interpolates over a mesh besides its normals, and notes in the model where it
 * lies: texture coordinates, colours, and tangents when the scene has normal maps. world: own
 * coordinates to those of the model. Tangents that the mesh does not give follow its texture
 * coordinates, averaged at each vertex by angle as MikkTSpace does (Mikkelsen 2008). Errors as in
 * layout.h.
 */
int pen_attributes_add(struct pen_layout *l, const struct pen_object_desc *mesh,
	const struct pen_affine *world, struct pen_model *model);

#endif
