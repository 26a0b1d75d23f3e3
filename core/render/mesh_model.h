/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_MESH_MODEL_H
#define PEN_RENDER_MESH_MODEL_H

#include "core/render/layout.h"

/*
 * Adds the model of a mesh: in its own coordinates, or, with placed, in world coordinates where the
 * object of that index puts it, in so many steps at least. Vertices and normals of each step are
 * those of its time. PEN_EINVALID: it reaches beyond PEN_COORDINATE_MAX; PEN_ELIMIT, PEN_ENOMEM.
 */
int pen_mesh_model_add(
	struct pen_layout *l, uint32_t mesh, uint32_t placed, uint32_t steps, uint32_t *ret_model);

/* What is wrong with an object, in words that follow its name. PEN_EINVALID. */
int pen_mesh_model_error(const struct pen_layout *l, uint32_t object, const char *fault);

#endif
