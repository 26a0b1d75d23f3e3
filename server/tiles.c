/* SPDX-License-Identifier: Apache-2.0 */
#include "server/tiles.h"

#include "core/base/clock.h"

#include <stdlib.h>
#include <string.h>

/* Before anything is decided. */
static void set_first_demands(struct pen_tiles *tiles, const struct pen_job *job)
{
	const struct pen_rounds rounds = pen_sampling_rounds(&job->sampling);

	tiles->samples = 0;
	for (uint32_t i = 0; i < job->tiling.count; i++) {
		tiles->demands[i] =
			pen_demand_first(&rounds, pen_rect_area(pen_tiling_rect(&job->tiling, i)));
		tiles->samples += tiles->demands[i].samples;
	}
}

int pen_tiles_init(
	struct pen_tiles *tiles, const struct pen_job *job, uint32_t frame, struct pen_error *err)
{
	*tiles = (struct pen_tiles){
		.frame = frame,
		.states = calloc(job->tiling.count, sizeof *tiles->states),
		.demands = calloc(job->tiling.count, sizeof *tiles->demands),
		.revisions = calloc(job->tiling.count, sizeof *tiles->revisions),
	};
	if (!tiles->states || !tiles->demands || !tiles->revisions) {
		pen_tiles_finish(tiles);
		return pen_error_memory(err);
	}
	set_first_demands(tiles, job);
	return 0;
}

void pen_tiles_finish(struct pen_tiles *tiles)
{
	free(tiles->states);
	free(tiles->demands);
	free(tiles->revisions);
	*tiles = (struct pen_tiles){0};
}

static bool is_done(const struct pen_tiles *tiles, uint32_t tile)
{
	return tiles->demands[tile].is_final &&
	       tiles->states[tile].rounds >= tiles->demands[tile].rounds;
}

void pen_tiles_load(
	struct pen_tiles *tiles, struct pen_job *job, const struct pen_canvas_tile *states)
{
	memcpy(tiles->states, states, job->tiling.count * sizeof *states);
	set_first_demands(tiles, job);
	tiles->done = 0;
	tiles->units_done = tiles->samples_done = 0;
	job->revision++;
	for (uint32_t i = 0; i < job->tiling.count; i++) {
		tiles->units_done += states[i].rounds;
		tiles->samples_done += states[i].samples;
		tiles->done += is_done(tiles, i);
		tiles->revisions[i] = states[i].rounds > 0 ? job->revision : 0;
	}
	tiles->revision = job->image_revision;
	job->units_done += tiles->units_done;
	job->samples_done += tiles->samples_done;
	job->tiles_done += tiles->done;
}

bool pen_tiles_merged(struct pen_tiles *tiles, struct pen_job *job, uint32_t tile,
	const struct pen_canvas_tile *state)
{
	const uint64_t before = tiles->states[tile].samples;
	bool ends;

	tiles->states[tile] = *state;
	ends = is_done(tiles, tile);
	tiles->units_done++;
	tiles->samples_done += state->samples - before;
	tiles->done += ends;
	tiles->revision = ++job->image_revision;
	job->units_done++;
	job->samples_done += state->samples - before;
	job->tiles_done += ends;
	tiles->revisions[tile] = ++job->revision;
	return tiles->done == job->tiling.count;
}

bool pen_tiles_decided(
	struct pen_tiles *tiles, struct pen_job *job, const struct pen_canvas *canvas)
{
	const uint64_t samples = tiles->samples;

	job->tiles_done -= tiles->done;
	tiles->done = 0;
	tiles->samples = 0;
	for (uint32_t i = 0; i < job->tiling.count; i++) {
		tiles->demands[i] = pen_canvas_demand(canvas, i);
		tiles->samples += tiles->demands[i].samples;
		tiles->done += is_done(tiles, i);
	}
	job->tiles_done += tiles->done;
	job->samples_spared += samples - tiles->samples;
	job->revision++;
	return tiles->done == job->tiling.count;
}

size_t pen_tiles_since(const struct pen_tiles *tiles, const struct pen_tiling *tiling,
	uint64_t revision, struct pen_rect *ret_rects, size_t max)
{
	size_t count = 0;

	for (uint32_t i = 0; i < tiling->count; i++) {
		if (tiles->revisions[i] <= revision)
			continue;
		if (count == max) {
			ret_rects[0] = tiling->crop;
			return 1;
		}
		ret_rects[count++] = pen_tiling_rect(tiling, i);
	}
	return count;
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
	if (count > 0 && !job->is_preview)
		(void)pen_store_put_tiles(store, job->number, news->items, count, NULL);
	news->count = 0;
}
