/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/lights.h"

void pen_lights_choose(const struct pen_lights *lights, const struct pen_light_receivers *receivers,
	const float u[PEN_LANES], const float v[PEN_LANES], uint32_t ret_light[PEN_LANES],
	float ret_chance[PEN_LANES])
{
	const float far = lights->far_chance;
	_Alignas(64) float rest[PEN_LANES];

	if (lights->far_count == 0) {
		pen_light_tree_choose(&lights->tree, receivers, u, v, ret_light, ret_chance);
		return;
	}
	for (int i = 0; i < PEN_LANES; i++)
		rest[i] = u[i] < far ? 0.0f : pen_min((u[i] - far) / (1.0f - far), 0x1.fffffep-1f);
	pen_light_tree_choose(&lights->tree, receivers, rest, v, ret_light, ret_chance);
	for (int i = 0; i < PEN_LANES; i++) {
		uint32_t chosen;

		ret_chance[i] *= 1.0f - far;
		if (u[i] >= far)
			continue;
		chosen = pen_light_choose(
			&lights->far_choice, pen_min(u[i] / far, 0x1.fffffep-1f), v[i]);
		ret_light[i] = lights->far[chosen];
		ret_chance[i] = far * lights->far_choice.chance[chosen];
	}
}

float pen_lights_chance(
	const struct pen_lights *lights, struct pen_vec3 p, struct pen_vec3 normal, uint32_t light)
{
	if (light < lights->sampled_count)
		return 1.0f;
	return (1.0f - lights->far_chance) * pen_light_tree_chance(&lights->tree, p, normal, light);
}
