/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/albedo.h"

#include "core/render/bsdf.h"

enum { SAMPLES_SIDE = 8 };

static void measure(float roughness, float cosine, float *ret_whole, float *ret_grazing)
{
	const float alpha = pen_max(roughness * roughness, PEN_ALPHA_MIN);
	const struct pen_vec3 n = {0.0f, 0.0f, 1.0f};
	const struct pen_vec3 wo = {pen_sqrt_clamped(1.0f - cosine * cosine), 0.0f, cosine};
	float whole = 0.0f, grazing = 0.0f;

	for (int i = 0; i < SAMPLES_SIDE * SAMPLES_SIDE; i++) {
		const float u = ((float)(i % SAMPLES_SIDE) + 0.5f) / SAMPLES_SIDE;
		const float v = ((float)(i / SAMPLES_SIDE) + 0.5f) / SAMPLES_SIDE;
		const struct pen_lobe lobe = pen_glossy_sample(alpha, n, wo, u, v);
		const struct pen_vec3 sum = pen_add(wo, lobe.direction);
		const float c = 1.0f - pen_clamp(0.5f * pen_length(sum), 0.0f, 1.0f);

		whole += lobe.weight;
		grazing += lobe.weight * c * c * c * c * c;
	}
	*ret_whole = whole / (SAMPLES_SIDE * SAMPLES_SIDE);
	*ret_grazing = grazing / (SAMPLES_SIDE * SAMPLES_SIDE);
}

void pen_albedo_init(struct pen_albedo *albedo)
{
	for (int j = 0; j < PEN_ALBEDO_SIDE; j++) {
		for (int i = 0; i < PEN_ALBEDO_SIDE; i++) {
			const float root = (float)i / (PEN_ALBEDO_SIDE - 1);

			measure((float)j / (PEN_ALBEDO_SIDE - 1), root * root, &albedo->whole[j][i],
				&albedo->grazing[j][i]);
		}
	}
}
