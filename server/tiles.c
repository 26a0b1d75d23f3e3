/* SPDX-License-Identifier: Apache-2.0 */
#include "server/tiles.h"

#include "core/base/clock.h"

#include <stdlib.h>
#include <string.h>

int pen_tiles_init(
	struct pen_tiles *tiles, const struct pen_job *job, uint32_t frame, struct pen_error *err)
{
	*tiles = (struct pen_tiles){
		.frame = frame,
		.states = calloc(job->tiling.count, sizeof *tiles->states),
	};
	return tiles->states ? 0 : pen_error_memory(err);
}

void pen_tiles_finish(struct pen_tiles *tiles)
{
	free(tiles->states);
	*tiles = (struct pen_tiles){0};
}

static uint64_t area(const struct pen_job *job, uint32_t tile)
{
	return pen_rect_area(pen_tiling_rect(&job->tiling, tile));
}

void pen_tiles_load(
	struct pen_tiles *tiles, struct pen_job *job, const struct pen_canvas_tile *states)
{
	uint32_t all = pen_round_count(job->sampling.samples);

	memcpy(tiles->states, states, job->tiling.count * sizeof *states);
	tiles->done = 0;
	tiles->units_done = tiles->samples_done = 0;
	for (uint32_t i = 0; i < job->tiling.count; i++) {
		uint32_t rounds = states[i].rounds;

		if (rounds == 0)
			continue;
		tiles->units_done += rounds;
		tiles->samples_done +=
			area(job, i) * pen_round_get(job->sampling.samples, rounds - 1).end;
		tiles->done += rounds == all;
	}
	tiles->revision = job->image_revision;
	job->units_done += tiles->units_done;
	job->samples_done += tiles->samples_done;
	job->tiles_done += tiles->done;
	job->revision++;
}

bool pen_tiles_merged(struct pen_tiles *tiles, struct pen_job *job, uint32_t tile, uint64_t xxh3)
{
	struct pen_canvas_tile *state = &tiles->states[tile];
	struct pen_round samples = pen_round_get(job->sampling.samples, state->rounds);
	uint64_t merged = area(job, tile) * (samples.end - samples.first);
	bool ends = samples.end == job->sampling.samples;

	*state = (struct pen_canvas_tile){(uint16_t)(state->rounds + 1), xxh3};
	tiles->units_done++;
	tiles->samples_done += merged;
	tiles->done += ends;
	tiles->revision = ++job->image_revision;
	job->units_done++;
	job->samples_done += merged;
	job->tiles_done += ends;
	job->revision++;
	return tiles->done == job->tiling.count;
}

bool pen_tile_news_add(struct pen_tile_news *news, const struct pen_tiles *tiles, uint32_t tile)
{
	if (news->count == 0)
		news->since_ms = pen_clock_ms();
	news->items[news->count++] =
		(struct pen_store_tile){tiles->frame, tile, tiles->states[tile]};
	return news->count == PEN_TILES_COMMIT_MAX;
}

void pen_tile_news_flush(
	struct pen_tile_news *news, const struct pen_job *job, struct pen_store *store)
{
	size_t count = 0;

	for (size_t i = 0; i < news->count; i++)
		if (news->items[i].frame >= job->frame_first + job->frames_done)
			news->items[count++] = news->items[i];
	if (count > 0)
		(void)pen_store_put_tiles(store, job->number, news->items, count, NULL);
	news->count = 0;
}
