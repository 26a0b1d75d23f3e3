/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_CLOSED_H
#define PEN_RENDER_CLOSED_H

#include "core/base/error.h"
#include "core/render/geometry.h"

#include <stdbool.h>

/*
 * Whether a model has an inside: a sphere does, and triangles do of which every edge is one way
 * round the edge of as many as it is the other way round, vertices at one place being one. Seams
 * of texture coordinates or normals open nothing. PEN_ENOMEM.
 */
int pen_closed(const struct pen_geometry *geometry, const struct pen_model *model,
	bool *ret_is_closed, struct pen_error *err);

#endif
