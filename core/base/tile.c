/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/tile.h"

#include "core/base/limits.h"

#include <assert.h>

void pen_tiling_init(struct pen_tiling *tiling, struct pen_rect crop, uint32_t tile_px)
{
	assert(pen_rect_valid(crop));
	assert(tile_px >= 16 && tile_px % 16 == 0 && tile_px <= PEN_TILE_SIDE_MAX);
	tiling->crop = crop;
	tiling->tile_px = tile_px;
	tiling->columns = (crop.x1 - 1) / tile_px - crop.x0 / tile_px + 1;
	tiling->rows = (crop.y1 - 1) / tile_px - crop.y0 / tile_px + 1;
	tiling->count = tiling->columns * tiling->rows;
}

static uint32_t clamp(uint32_t value, uint32_t low, uint32_t high)
{
	return value < low ? low : value > high ? high : value;
}

struct pen_rect pen_tiling_rect(const struct pen_tiling *tiling, uint32_t index)
{
	const struct pen_rect crop = tiling->crop;
	uint32_t px = tiling->tile_px;
	uint32_t x = (crop.x0 / px + index % tiling->columns) * px;
	uint32_t y = (crop.y0 / px + index / tiling->columns) * px;

	assert(index < tiling->count);
	return (struct pen_rect){
		.x0 = clamp(x, crop.x0, crop.x1),
		.y0 = clamp(y, crop.y0, crop.y1),
		.x1 = clamp(x + px, crop.x0, crop.x1),
		.y1 = clamp(y + px, crop.y0, crop.y1),
	};
}

static uint32_t round_end(uint32_t first)
{
	if (first == 0)
		return 1;
	if (first == 1)
		return 16;
	return first < PEN_ROUND_SAMPLES_MAX ? first * 2 : first + PEN_ROUND_SAMPLES_MAX;
}

uint32_t pen_round_count(uint32_t samples)
{
	uint32_t count = 0;

	for (uint32_t first = 0; first < samples; first = round_end(first))
		count++;
	return count;
}

struct pen_round pen_round_get(uint32_t samples, uint32_t index)
{
	struct pen_round round = {0, round_end(0)};

	while (index-- > 0)
		round = (struct pen_round){round.end, round_end(round.end)};
	assert(round.first < samples);
	if (round.end > samples)
		round.end = samples;
	return round;
}
