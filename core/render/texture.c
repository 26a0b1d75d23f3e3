/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/texture.h"

#include <math.h>
#include <string.h>

enum { PROBES_MAX = 16 };

/* A coordinate brought to [0, 1]; one that is no number becomes 0. */
static float fold(float x, enum pen_wrap wrap)
{
	const float half = 0.5f * x;
	float folded;

	switch (wrap) {
	case PEN_WRAP_REPEAT: folded = x - floorf(x); break;
	case PEN_WRAP_MIRROR:
		folded = 2.0f * (half - floorf(half));
		folded = folded > 1.0f ? 2.0f - folded : folded;
		break;
	default: folded = x; break;
	}
	return pen_clamp(folded, 0.0f, 1.0f);
}

/* Two neighbouring texels along an axis, and the share of the second. */
struct pair {
	uint32_t first, second;
	float share;
};

static struct pair pair_of(float x, uint32_t size, enum pen_wrap wrap)
{
	const float at = fold(x, wrap) * (float)size - 0.5f;
	const int32_t low = (int32_t)floorf(at);
	const int32_t last = (int32_t)size - 1;
	const int32_t before = wrap == PEN_WRAP_REPEAT ? last : 0;
	const int32_t after = wrap == PEN_WRAP_REPEAT ? 0 : last;

	return (struct pair){
		.first = (uint32_t)(low < 0	 ? before
				    : low > last ? last
						 : low),
		.second = (uint32_t)(low + 1 > last ? after : low + 1),
		.share = at - (float)low,
	};
}

/* The nearer texel alone, if it rounds. */
static struct pair rounded(struct pair pair, bool rounds)
{
	if (rounds)
		pair.share = pair.share < 0.5f ? 0.0f : 1.0f;
	return pair;
}

static void add_texel(struct pen_texel *sum, struct pen_texel texel, float weight)
{
	sum->red += weight * texel.red;
	sum->green += weight * texel.green;
	sum->blue += weight * texel.blue;
	sum->alpha += weight * texel.alpha;
}

/* What a texel of bytes says, before it is decoded. */
static struct pen_texel encoded_texel(
	const struct pen_mipmap *mipmap, const struct pen_mip_level *level, uint32_t x, uint32_t y)
{
	const size_t at = 4 * (level->first + (size_t)y * level->width + x);
	const uint8_t *b = (const uint8_t *)mipmap->texels + at;

	return (struct pen_texel){b[0], b[1], b[2], (float)b[3] * (1.0f / 255.0f)};
}

/* Linear light of a value between two bytes. */
static float decoded(const struct pen_mipmap *mipmap, float value)
{
	const uint32_t low = (uint32_t)pen_clamp(value, 0.0f, 254.0f);

	return mipmap->decode[low] +
	       (value - (float)low) * (mipmap->decode[low + 1] - mipmap->decode[low]);
}

/* The four texels' mean as bytes, which is decoded then. */
static void add_encoded(struct pen_texel *sum, const struct pen_mipmap *mipmap,
	const struct pen_mip_level *level, struct pair x, struct pair y, float weight)
{
	struct pen_texel mean = {0};

	add_texel(&mean, encoded_texel(mipmap, level, x.first, y.first),
		(1.0f - x.share) * (1.0f - y.share));
	add_texel(
		&mean, encoded_texel(mipmap, level, x.second, y.first), x.share * (1.0f - y.share));
	add_texel(
		&mean, encoded_texel(mipmap, level, x.first, y.second), (1.0f - x.share) * y.share);
	add_texel(&mean, encoded_texel(mipmap, level, x.second, y.second), x.share * y.share);
	mean.red = decoded(mipmap, mean.red);
	mean.green = decoded(mipmap, mean.green);
	mean.blue = decoded(mipmap, mean.blue);
	add_texel(sum, mean, weight);
}

static void add_bilinear(struct pen_texel *sum, const struct pen_texture *texture,
	uint32_t level_index, struct pen_vec2 at, float weight)
{
	const struct pen_mipmap *mipmap = texture->mipmap;
	const struct pen_mip_level *level = &mipmap->levels[level_index];
	const bool rounds = texture->is_nearest && level_index == 0;
	const struct pair x = rounded(pair_of(at.x, level->width, texture->wrap_u), rounds);
	const struct pair y = rounded(pair_of(at.y, level->height, texture->wrap_v), rounds);

	if (texture->is_encoded && mipmap->type == PEN_TEXEL_BYTES) {
		add_encoded(sum, mipmap, level, x, y, weight);
		return;
	}
	add_texel(sum, pen_mipmap_fetch(mipmap, level, x.first, y.first),
		weight * (1.0f - x.share) * (1.0f - y.share));
	add_texel(sum, pen_mipmap_fetch(mipmap, level, x.second, y.first),
		weight * x.share * (1.0f - y.share));
	add_texel(sum, pen_mipmap_fetch(mipmap, level, x.first, y.second),
		weight * (1.0f - x.share) * y.share);
	add_texel(sum, pen_mipmap_fetch(mipmap, level, x.second, y.second),
		weight * x.share * y.share);
}

/* The binary logarithm, linear between powers of two: exact where it chooses a level alone. */
static float rough_log2(float x)
{
	uint32_t bits, mantissa;
	float rest;

	memcpy(&bits, &x, sizeof bits);
	mantissa = (bits & 0x7fffffu) | 0x3f800000u;
	memcpy(&rest, &mantissa, sizeof rest);
	return (float)((int32_t)(bits >> 23) - 127) + rest - 1.0f;
}

/* width: of the footprint, in texels of the finest level. */
static void add_trilinear(struct pen_texel *sum, const struct pen_texture *texture,
	struct pen_vec2 at, float width, float weight)
{
	const float last = (float)(texture->mipmap->level_count - 1);
	const float level = pen_clamp(rough_log2(pen_max(width, 1.0f)), 0.0f, last);
	const uint32_t finer = (uint32_t)level;
	const float share = level - (float)finer;

	add_bilinear(sum, texture, finer, at, weight * (1.0f - share));
	if (share > 0.0f)
		add_bilinear(sum, texture, finer + 1, at, weight * share);
}

static float length_in_texels(const struct pen_mip_level *level, struct pen_vec2 axis)
{
	const float x = axis.x * (float)level->width, y = axis.y * (float)level->height;

	return pen_clamp(sqrtf(x * x + y * y), 0.0f, 1e9f);
}

struct pen_texel pen_texture_mean(
	const struct pen_texture *texture, const struct pen_footprint *footprint)
{
	const struct pen_mip_level *finest = &texture->mipmap->levels[0];
	const float a = length_in_texels(finest, footprint->major);
	const float b = length_in_texels(finest, footprint->minor);
	const struct pen_vec2 axis = a >= b ? footprint->major : footprint->minor;
	const float longer = pen_max(a, b);
	const float shorter = pen_max(pen_min(a, b), 1.0f);
	const float ratio = pen_min(longer / shorter, (float)PROBES_MAX);
	const uint32_t probes = ratio > 1.0f ? (uint32_t)ceilf(ratio) : 1;
	const float width = pen_max(longer / (float)probes, shorter);
	struct pen_texel sum = {0};

	for (uint32_t i = 0; i < probes; i++) {
		const float along = ((float)i + 0.5f) / (float)probes - 0.5f;
		const struct pen_vec2 at = {
			footprint->center.x + along * axis.x,
			footprint->center.y + along * axis.y,
		};

		add_trilinear(&sum, texture, at, width, 1.0f / (float)probes);
	}
	return sum;
}
