/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/tonemap.h"

#include <assert.h>
#include <math.h>

enum { CELLS = 4096 };

double pen_srgb_decode(double encoded)
{
	return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

/* Where the search for each cell's codes begins, from the limits of all codes but the last. */
static void find_starts(struct pen_tonemap *tonemap)
{
	unsigned code = 0;

	tonemap->limits[255] = INFINITY;
	for (unsigned cell = 0; cell < CELLS; cell++) {
		while ((float)cell / CELLS >= tonemap->limits[code])
			code++;
		tonemap->starts[cell] = (uint8_t)code;
	}
}

void pen_tonemap_init(struct pen_tonemap *tonemap, double exposure)
{
	tonemap->scale = (float)exp2(exposure);
	for (unsigned k = 0; k < 255; k++)
		tonemap->limits[k] = (float)pen_srgb_decode((k + 0.5) / 255.0);
	find_starts(tonemap);
}

void pen_tonemap_init_plain(struct pen_tonemap *tonemap)
{
	tonemap->scale = 1.0f;
	for (unsigned k = 0; k < 255; k++)
		tonemap->limits[k] = (float)((k + 0.5) / 255.0);
	find_starts(tonemap);
}

uint8_t pen_tonemap_value(const struct pen_tonemap *tonemap, float linear)
{
	float value = linear * tonemap->scale;
	unsigned code;

	if (!(value > 0.0f))
		return 0;
	if (value >= 1.0f)
		return 255;
	/* A cell is narrower than two codes even where the curve is steepest: this ends at once. */
	code = tonemap->starts[(unsigned)(value * CELLS)];
	while (value >= tonemap->limits[code])
		code++;
	return (uint8_t)code;
}

void pen_tonemap_row(const struct pen_tonemap *tonemap, const float *rgba, size_t count,
	unsigned channels, uint8_t *ret_pixels)
{
	assert(channels == 3 || channels == 4);
	for (size_t i = 0; i < count; i++, rgba += 4, ret_pixels += channels) {
		for (unsigned c = 0; c < 3; c++)
			ret_pixels[c] = pen_tonemap_value(tonemap, rgba[c]);
		if (channels == 4)
			ret_pixels[3] = rgba[3] > 0.0f ? 255 : 0;
	}
}
