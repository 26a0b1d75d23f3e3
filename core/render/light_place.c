/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light_place.h"

#include "core/render/node.h"

#include <math.h>

static void turn(const struct pen_affine *world, double direction[3])
{
	const double from[3] = {direction[0], direction[1], direction[2]};
	double length = 0.0;

	for (int i = 0; i < 3; i++) {
		direction[i] = 0.0;
		for (int j = 0; j < 3; j++)
			direction[i] += world->m[i][j] * from[j];
		length += direction[i] * direction[i];
	}
	length = sqrt(length);
	for (int i = 0; i < 3; i++)
		direction[i] = length > 0.0 ? direction[i] / length : from[i];
}

static void move(const struct pen_affine *world, double position[3])
{
	const double from[3] = {position[0], position[1], position[2]};

	pen_affine_point(world, from, position);
}

struct pen_light_desc pen_light_place(
	const struct pen_scene *scene, const struct pen_light_desc *light, double time)
{
	const struct pen_affine world = pen_node_world(scene, light->node, time);
	struct pen_light_desc placed = *light;

	if (light->node == PEN_NO_INDEX)
		return placed;
	placed.node = PEN_NO_INDEX;
	switch (light->type) {
	case PEN_LIGHT_POINT: move(&world, placed.u.point.position); break;
	case PEN_LIGHT_SPOT:
		move(&world, placed.u.spot.position);
		turn(&world, placed.u.spot.direction);
		break;
	case PEN_LIGHT_DIRECTIONAL: turn(&world, placed.u.directional.direction); break;
	case PEN_LIGHT_RECTANGLE:
	case PEN_LIGHT_TRIANGLE:
	case PEN_LIGHT_DISK:
	case PEN_LIGHT_SPHERE: break;
	}
	return placed;
}
