/* SPDX-License-Identifier: Apache-2.0 */
#include "server/tiles.h"

#include "core/base/clock.h"

#include <stdlib.h>
#include <string.h>

int pen_tiles_init(struct pen_tiles *tiles, const struct pen_job *job, struct pen_error *err)
{
	tiles->news_count = 0;
	tiles->states = calloc(job->tiling.count, sizeof *tiles->states);
	return tiles->states ? 0 : pen_error_memory(err);
}

void pen_tiles_finish(struct pen_tiles *tiles)
{
	free(tiles->states);
	tiles->states = NULL;
	tiles->news_count = 0;
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
	job->units_done = job->samples_done = job->tiles_done = 0;
	for (uint32_t i = 0; i < job->tiling.count; i++) {
		uint32_t rounds = states[i].rounds;

		if (rounds == 0)
			continue;
		job->units_done += rounds;
		job->samples_done +=
			area(job, i) * pen_round_get(job->sampling.samples, rounds - 1).end;
		job->tiles_done += rounds == all;
	}
	job->revision++;
}

bool pen_tiles_merged(struct pen_tiles *tiles, struct pen_job *job, uint32_t tile, uint64_t xxh3)
{
	struct pen_canvas_tile *state = &tiles->states[tile];
	struct pen_round samples = pen_round_get(job->sampling.samples, state->rounds);

	*state = (struct pen_canvas_tile){(uint16_t)(state->rounds + 1), xxh3};
	job->units_done++;
	job->samples_done += area(job, tile) * (samples.end - samples.first);
	job->tiles_done += samples.end == job->sampling.samples;
	job->image_revision++;
	job->revision++;

	if (tiles->news_count == 0)
		tiles->news_ms = pen_clock_ms();
	tiles->news[tiles->news_count++] = (struct pen_store_tile){tile, *state};
	return tiles->news_count == PEN_TILES_COMMIT_MAX;
}

void pen_tiles_flush(struct pen_tiles *tiles, const struct pen_job *job, struct pen_store *store)
{
	if (tiles->news_count > 0)
		(void)pen_store_put_tiles(store, job->number, tiles->news, tiles->news_count, NULL);
	tiles->news_count = 0;
}
