/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_ALBEDO_H
#define PEN_RENDER_ALBEDO_H

#include "core/render/vec.h"

#include <stdint.h>

/*
 * How much a GGX reflector with Schlick's Fresnel term returns of a white world, by the cosine of
 * the view and the roughness: f0 * whole + (1 - f0) * grazing.
 */

enum { PEN_ALBEDO_SIDE = 16 };

struct pen_albedo {
	/* The first index is the roughness, the second the cosine's root, both from 0 to 1. */
	float whole[PEN_ALBEDO_SIDE][PEN_ALBEDO_SIDE];
	float grazing[PEN_ALBEDO_SIDE][PEN_ALBEDO_SIDE];
};

void pen_albedo_init(struct pen_albedo *albedo);

static inline float pen_albedo_of(
	const struct pen_albedo *albedo, float f0, float roughness, float cosine)
{
	const float last = (float)(PEN_ALBEDO_SIDE - 1);
	const float x = sqrtf(pen_clamp(cosine, 0.0f, 1.0f)) * last;
	const float y = pen_clamp(roughness, 0.0f, 1.0f) * last;
	const uint32_t i = (uint32_t)pen_min(x, last - 1.0f);
	const uint32_t j = (uint32_t)pen_min(y, last - 1.0f);
	const float u = x - (float)i, v = y - (float)j;
	const float whole =
		(1.0f - v) * ((1.0f - u) * albedo->whole[j][i] + u * albedo->whole[j][i + 1]) +
		v * ((1.0f - u) * albedo->whole[j + 1][i] + u * albedo->whole[j + 1][i + 1]);
	const float grazing =
		(1.0f - v) * ((1.0f - u) * albedo->grazing[j][i] + u * albedo->grazing[j][i + 1]) +
		v * ((1.0f - u) * albedo->grazing[j + 1][i] + u * albedo->grazing[j + 1][i + 1]);

	return f0 * whole + (1.0f - f0) * grazing;
}

#endif
