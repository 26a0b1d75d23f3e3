/* SPDX-License-Identifier: Apache-2.0 */
#include "server/backlog.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum tile_state { TILE_WAITING, TILE_OUT, TILE_MERGING, TILE_DONE };

struct pen_backlog_tile {
	enum tile_state state;
	uint16_t round; /* the next one, so also how many are merged */
	uint8_t faults, kills;
	uint32_t epoch;
	uint64_t blamed[PEN_BLAME_MAX - 1]; /* the workers of the faults */
};

static void fill(struct pen_backlog *backlog, const uint16_t *rounds)
{
	for (uint32_t i = 0; i < backlog->tiling.count; i++) {
		struct pen_backlog_tile *tile = &backlog->tiles[i];

		tile->round = rounds ? rounds[i] : 0;
		assert(tile->round <= backlog->rounds);
		if (tile->round == backlog->rounds) {
			tile->state = TILE_DONE;
			continue;
		}
		backlog->tiles_left++;
		pen_tile_queue_push(&backlog->waiting, i, tile->round);
	}
}

int pen_backlog_init(struct pen_backlog *backlog, const struct pen_tiling *tiling, uint32_t samples,
	const uint16_t *rounds, struct pen_error *err)
{
	*backlog = (struct pen_backlog){
		.tiling = *tiling,
		.samples = samples,
		.rounds = pen_round_count(samples),
		.tiles = calloc(tiling->count, sizeof *backlog->tiles),
	};
	if (!backlog->tiles || pen_tile_queue_init(&backlog->waiting, tiling, err) < 0) {
		pen_backlog_finish(backlog);
		return pen_error_memory(err);
	}
	fill(backlog, rounds);
	return 0;
}

void pen_backlog_restart(struct pen_backlog *backlog)
{
	assert(backlog->merging == 0);
	memset(backlog->tiles, 0, backlog->tiling.count * sizeof *backlog->tiles);
	backlog->tiles_left = 0;
	pen_tile_queue_clear(&backlog->waiting);
	fill(backlog, NULL);
}

void pen_backlog_finish(struct pen_backlog *backlog)
{
	pen_tile_queue_finish(&backlog->waiting);
	free(backlog->tiles);
	backlog->tiles = NULL;
}

uint64_t pen_backlog_samples(const struct pen_backlog *backlog, uint32_t tile)
{
	struct pen_round samples = pen_round_get(backlog->samples, backlog->tiles[tile].round);

	return pen_rect_area(pen_tiling_rect(&backlog->tiling, tile)) *
	       (samples.end - samples.first);
}

uint32_t pen_backlog_round(const struct pen_backlog *backlog, uint32_t tile)
{
	return backlog->tiles[tile].round;
}

uint32_t pen_backlog_epoch(const struct pen_backlog *backlog, uint32_t tile)
{
	return backlog->tiles[tile].epoch;
}

bool pen_backlog_failed_on(const struct pen_backlog *backlog, uint32_t tile, uint64_t worker)
{
	for (uint8_t i = 0; i < backlog->tiles[tile].faults; i++)
		if (backlog->tiles[tile].blamed[i] == worker)
			return true;
	return false;
}

uint32_t pen_backlog_take(struct pen_backlog *backlog, uint32_t place)
{
	uint32_t tile = pen_tile_queue_at(&backlog->waiting, place);

	assert(backlog->tiles[tile].state == TILE_WAITING);
	backlog->tiles[tile].state = TILE_OUT;
	pen_tile_queue_remove(&backlog->waiting, place);
	return tile;
}

void pen_backlog_return(struct pen_backlog *backlog, uint32_t index)
{
	struct pen_backlog_tile *tile = &backlog->tiles[index];

	assert(tile->state == TILE_OUT);
	tile->state = TILE_WAITING;
	tile->epoch++;
	pen_tile_queue_push(&backlog->waiting, index, tile->round);
}

void pen_backlog_deliver(struct pen_backlog *backlog, uint32_t tile)
{
	assert(backlog->tiles[tile].state == TILE_OUT);
	backlog->tiles[tile].state = TILE_MERGING;
	backlog->merging++;
}

bool pen_backlog_merged(struct pen_backlog *backlog, uint32_t index)
{
	struct pen_backlog_tile *tile = &backlog->tiles[index];

	assert(tile->state == TILE_MERGING);
	backlog->merging--;
	tile->round++;
	tile->faults = tile->kills = 0;
	if (tile->round < backlog->rounds) {
		tile->state = TILE_WAITING;
		pen_tile_queue_push(&backlog->waiting, index, tile->round);
		return false;
	}
	tile->state = TILE_DONE;
	return --backlog->tiles_left == 0;
}

bool pen_backlog_blame(struct pen_backlog *backlog, uint32_t index, uint64_t worker)
{
	struct pen_backlog_tile *tile = &backlog->tiles[index];

	if (tile->faults == PEN_BLAME_MAX - 1)
		return false;
	tile->blamed[tile->faults++] = worker;
	return true;
}

bool pen_backlog_excuse(struct pen_backlog *backlog, uint32_t index)
{
	struct pen_backlog_tile *tile = &backlog->tiles[index];

	if (tile->kills == PEN_KILLS_MAX)
		return false;
	tile->kills++;
	return true;
}
