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

static uint32_t round_end(enum pen_rounds_kind kind, uint32_t first)
{
	uint32_t step = PEN_ROUND_SAMPLES_MAX;

	if (kind == PEN_ROUNDS_UNIFORM && first < 16)
		return first == 0 ? 1 : 16;
	if (first < 16)
		return 16;
	while (step > first)
		step /= 2;
	if (kind == PEN_ROUNDS_ADAPTIVE && first < 2 * PEN_ROUND_SAMPLES_MAX && step > 16)
		step /= 2;
	return first + step;
}

uint32_t pen_round_count(const struct pen_rounds *rounds)
{
	uint32_t count = rounds->kind == PEN_ROUNDS_EDGE;

	for (uint32_t first = 0; first < rounds->samples; count++)
		first = round_end(rounds->kind, first);
	return count;
}

struct pen_round pen_round_get(const struct pen_rounds *rounds, uint32_t index)
{
	struct pen_round round = {0, round_end(rounds->kind, 0), false};

	if (rounds->kind == PEN_ROUNDS_EDGE && index-- == 0)
		return (struct pen_round){0, 1, true};
	while (index-- > 0)
		round = (struct pen_round){round.end, round_end(rounds->kind, round.end), false};
	assert(round.first < rounds->samples);
	if (round.end > rounds->samples)
		round.end = rounds->samples;
	return round;
}

uint32_t pen_round_samples(const struct pen_rounds *rounds, uint32_t count)
{
	return count == 0 ? 0 : pen_round_get(rounds, count - 1).end;
}

struct pen_rounds pen_rounds_of(enum pen_rounds_kind kind, uint32_t samples, uint32_t min_samples)
{
	struct pen_rounds rounds = {kind, samples, 1};

	if (kind == PEN_ROUNDS_UNIFORM)
		rounds.sure = pen_round_count(&rounds);
	if (kind == PEN_ROUNDS_ADAPTIVE)
		while (pen_round_samples(&rounds, rounds.sure) < min_samples)
			rounds.sure++;
	return rounds;
}
