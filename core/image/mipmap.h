/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_MIPMAP_H
#define PEN_IMAGE_MIPMAP_H

#include "core/image/picture.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * A picture and its averages (Williams 1983): each level has half the width and height of the one
 * before, rounded down but at least 1, and each of its texels is the mean of the texels before that
 * it covers, in linear light. The last level is one texel. Never changed once made, so that
 * processes share it.
 */

enum { PEN_MIP_LEVELS_MAX = 16 };

struct pen_mip_level {
	uint32_t width, height;
	size_t first; /* texel */
};

struct pen_mipmap {
	enum pen_texel_type type;
	uint32_t level_count;
	struct pen_mip_level levels[PEN_MIP_LEVELS_MAX];
	void *texels;	   /* of all levels, 4 values each */
	float decode[256]; /* linear light of a byte of red, green or blue */
};

struct pen_texel {
	float red, green, blue, alpha;
};

/*
 * is_srgb: red, green and blue are sRGB-encoded (IEC 61966-2-1) where the picture can be. Takes
 * the picture's texels, also on failure: PEN_ENOMEM.
 */
int pen_mipmap_create(struct pen_picture *picture, bool is_srgb, struct pen_mipmap **ret_mipmap,
	struct pen_error *err);
void pen_mipmap_destroy(struct pen_mipmap *mipmap);

/* Bytes that a picture's levels take. */
uint64_t pen_mipmap_bytes(enum pen_texel_type type, uint32_t width, uint32_t height);

/* A texel of a level in linear light, x and y within it. */
static inline struct pen_texel pen_mipmap_fetch(
	const struct pen_mipmap *mipmap, const struct pen_mip_level *level, uint32_t x, uint32_t y)
{
	const size_t at = 4 * (level->first + (size_t)y * level->width + x);

	if (mipmap->type == PEN_TEXEL_BYTES) {
		const uint8_t *b = (const uint8_t *)mipmap->texels + at;

		return (struct pen_texel){mipmap->decode[b[0]], mipmap->decode[b[1]],
			mipmap->decode[b[2]], (float)b[3] * (1.0f / 255.0f)};
	}

	const float *f = (const float *)mipmap->texels + at;

	return (struct pen_texel){f[0], f[1], f[2], f[3]};
}

#endif
