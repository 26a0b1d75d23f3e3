/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_TEXTURE_H
#define PEN_RENDER_TEXTURE_H

#include "core/image/mipmap.h"
#include "core/render/vec.h"
#include "core/scene/desc.h"

#include <stdbool.h>
#include <stdint.h>

/* A texture as a material's input reads it. */
struct pen_texture {
	const struct pen_mipmap *mipmap; /* NULL: no texture */
	enum pen_wrap wrap_u, wrap_v;
	bool is_nearest;
	bool is_encoded; /* texels of bytes are interpolated before they are decoded */
	uint32_t channel, uv_set;
	float uv[2][3]; /* texture's from the mesh's uv */
};

/* What a sample sees of a surface: a point and the axes of an ellipse, full width, all in uv. */
struct pen_footprint {
	struct pen_vec2 center, major, minor;
};

/*
 * The mean of a texture over a footprint, in linear light: up to 16 trilinear probes along the
 * longer axis, each as wide as the shorter one (as McCormack et al. 1999, "Feline"), so that a
 * slanted view neither aliases nor blurs. With axes of length 0 it interpolates the finest level,
 * or has its nearest texel.
 */
struct pen_texel pen_texture_mean(
	const struct pen_texture *texture, const struct pen_footprint *footprint);

/* One channel of a texel. */
static inline float pen_texel_channel(struct pen_texel texel, uint32_t channel)
{
	const float values[4] = {texel.red, texel.green, texel.blue, texel.alpha};

	return values[channel & 3];
}

#endif
