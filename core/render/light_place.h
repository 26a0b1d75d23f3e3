/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_LIGHT_PLACE_H
#define PEN_RENDER_LIGHT_PLACE_H

#include "core/scene/desc.h"

/*
 * A light in world coordinates, as its node has it at a time: a point, spot or directional one, for
 * only those come with nodes. Its scale changes nothing. Without a node it is as it was.
 */
struct pen_light_desc pen_light_place(
	const struct pen_scene *scene, const struct pen_light_desc *light, double time);

#endif
