/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_LIGHT_SHAPE_H
#define PEN_RENDER_LIGHT_SHAPE_H

#include "core/render/layout.h"

/* Lays out a visible light of the scene as something that rays hit. Errors as in layout.h. */
int pen_light_shape_add(struct pen_layout *l, uint32_t index);

#endif
