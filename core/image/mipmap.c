/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/mipmap.h"

#include "core/image/tonemap.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* What a level is computed with. */
struct averaging {
	struct pen_mipmap *mipmap;
	struct pen_tonemap *encode; /* to sRGB bytes; NULL: values as they are */
};

static size_t texel_bytes(enum pen_texel_type type)
{
	return type == PEN_TEXEL_BYTES ? 4 : 4 * sizeof(float);
}

/* Lays out the levels; returns how many texels they have. */
static size_t lay_out(
	uint32_t width, uint32_t height, struct pen_mip_level *ret_levels, uint32_t *ret_count)
{
	uint32_t count = 0;
	size_t texels = 0;

	for (;;) {
		assert(count < PEN_MIP_LEVELS_MAX);
		ret_levels[count++] = (struct pen_mip_level){width, height, texels};
		texels += (size_t)width * height;
		if (width == 1 && height == 1)
			break;
		width = width > 1 ? width / 2 : 1;
		height = height > 1 ? height / 2 : 1;
	}
	*ret_count = count;
	return texels;
}

uint64_t pen_mipmap_bytes(enum pen_texel_type type, uint32_t width, uint32_t height)
{
	struct pen_mip_level levels[PEN_MIP_LEVELS_MAX];
	uint32_t count;

	return lay_out(width, height, levels, &count) * texel_bytes(type);
}

/* Which of `from` texels the i-th of `to` covers along an axis, and by how much each. */
struct cover {
	uint32_t first, count;
	double weights[3];
};

static struct cover cover_of(uint32_t i, uint32_t from, uint32_t to)
{
	const double ratio = (double)from / to; /* 1, 2 or between 2 and 3 */
	const double low = i * ratio, high = (i + 1) * ratio;
	struct cover cover = {.first = (uint32_t)low};

	for (uint32_t k = cover.first; k < from && cover.count < 3 && k < high; k++) {
		const double start = low > k ? low : k;
		const double end = high < k + 1.0 ? high : k + 1.0;

		cover.weights[cover.count++] = (end - start) / ratio;
	}
	return cover;
}

static void store(const struct averaging *a, size_t index, const double mean[4])
{
	if (a->mipmap->type == PEN_TEXEL_FLOATS) {
		float *to = (float *)a->mipmap->texels + 4 * index;

		for (int c = 0; c < 4; c++)
			to[c] = (float)mean[c];
		return;
	}

	uint8_t *to = (uint8_t *)a->mipmap->texels + 4 * index;

	for (int c = 0; c < 4; c++)
		if (a->encode && c < 3)
			to[c] = pen_tonemap_value(a->encode, (float)mean[c]);
		else
			/* Never below 0. NOLINTNEXTLINE(bugprone-incorrect-roundings) */
			to[c] = (uint8_t)(mean[c] * 255.0 + 0.5);
}

static void average_texel(const struct averaging *a, const struct pen_mip_level *from,
	const struct cover *across, const struct cover *down, size_t index)
{
	double mean[4] = {0};

	for (uint32_t j = 0; j < down->count; j++) {
		for (uint32_t i = 0; i < across->count; i++) {
			const struct pen_texel texel = pen_mipmap_fetch(
				a->mipmap, from, across->first + i, down->first + j);
			const double weight = across->weights[i] * down->weights[j];

			mean[0] += weight * (double)texel.red;
			mean[1] += weight * (double)texel.green;
			mean[2] += weight * (double)texel.blue;
			mean[3] += weight * (double)texel.alpha;
		}
	}
	store(a, index, mean);
}

static void average_level(const struct averaging *a, uint32_t level)
{
	const struct pen_mip_level *from = &a->mipmap->levels[level - 1];
	const struct pen_mip_level *to = &a->mipmap->levels[level];

	for (uint32_t y = 0; y < to->height; y++) {
		const struct cover down = cover_of(y, from->height, to->height);

		for (uint32_t x = 0; x < to->width; x++) {
			const struct cover across = cover_of(x, from->width, to->width);

			average_texel(
				a, from, &across, &down, to->first + (size_t)y * to->width + x);
		}
	}
}

static void decode_floats(struct pen_mipmap *mipmap)
{
	const size_t count = (size_t)mipmap->levels[0].width * mipmap->levels[0].height;
	float *texel = mipmap->texels;

	for (size_t i = 0; i < count; i++, texel += 4)
		for (int c = 0; c < 3; c++)
			texel[c] = (float)pen_srgb_decode((double)texel[c]);
}

/* Makes room for the levels behind the picture's texels. */
static int grow(struct pen_mipmap *mipmap, struct pen_picture *picture, struct pen_error *err)
{
	const size_t texels =
		lay_out(picture->width, picture->height, mipmap->levels, &mipmap->level_count);
	void *grown = realloc(picture->texels, texels * texel_bytes(picture->type));

	if (!grown)
		return pen_error_memory(err);
	picture->texels = NULL;
	mipmap->texels = grown;
	return 0;
}

int pen_mipmap_create(struct pen_picture *picture, bool is_srgb, struct pen_mipmap **ret_mipmap,
	struct pen_error *err)
{
	const bool decodes = is_srgb && picture->is_encoded;
	const bool has_bytes = picture->type == PEN_TEXEL_BYTES;
	struct averaging a = {.mipmap = calloc(1, sizeof *a.mipmap)};
	int r = a.mipmap ? grow(a.mipmap, picture, err) : pen_error_memory(err);

	if (r == 0 && decodes && has_bytes) {
		a.encode = malloc(sizeof *a.encode);
		if (!a.encode)
			r = pen_error_memory(err);
	}
	if (r < 0)
		goto out;
	a.mipmap->type = picture->type;
	if (a.encode)
		pen_tonemap_init(a.encode, 0.0);
	for (uint32_t i = 0; i < 256; i++)
		a.mipmap->decode[i] =
			(float)(decodes ? pen_srgb_decode(i / 255.0) : (double)i / 255.0);
	if (decodes && !has_bytes)
		decode_floats(a.mipmap);
	for (uint32_t level = 1; level < a.mipmap->level_count; level++)
		average_level(&a, level);
	*ret_mipmap = a.mipmap;
	a.mipmap = NULL;
out:
	free(a.encode);
	pen_mipmap_destroy(a.mipmap);
	pen_picture_finish(picture);
	return r;
}

void pen_mipmap_destroy(struct pen_mipmap *mipmap)
{
	if (!mipmap)
		return;
	free(mipmap->texels);
	free(mipmap);
}
