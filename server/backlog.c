/* SPDX-License-Identifier: Apache-2.0 */
#include "server/backlog.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum tile_state { TILE_WAITING, TILE_OUT, TILE_MERGING, TILE_HELD, TILE_DONE };

struct pen_backlog_tile {
	enum tile_state state;
	uint16_t round; /* the next one, so also how many are merged */
	uint8_t faults, kills;
	uint32_t epoch;
	struct pen_demand demand;
	uint64_t blamed[PEN_BLAME_MAX - 1]; /* the workers of the faults */
	struct pen_backlog_opinion opinions[PEN_BACKLOG_OPINIONS];
	struct pen_backlog_opinion ghost;
	uint8_t opinion_count;
	bool is_haunted;
};

/* Where a tile goes that nobody is at work on. */
static void place(struct pen_backlog *backlog, uint32_t index)
{
	struct pen_backlog_tile *tile = &backlog->tiles[index];

	if (tile->round < tile->demand.rounds) {
		tile->state = TILE_WAITING;
		pen_tile_queue_push(&backlog->waiting, index, tile->round);
	} else if (!tile->demand.is_final) {
		tile->state = TILE_HELD;
	} else {
		tile->state = TILE_DONE;
		backlog->tiles_left--;
	}
}

static void fill(
	struct pen_backlog *backlog, const uint16_t *merged, const struct pen_demand *demands)
{
	backlog->tiles_left = backlog->tiling.count;
	for (uint32_t i = 0; i < backlog->tiling.count; i++) {
		struct pen_backlog_tile *tile = &backlog->tiles[i];

		tile->round = merged ? merged[i] : 0;
		assert(tile->round <= pen_round_count(&backlog->rounds));
		tile->demand =
			demands ? demands[i]
				: pen_demand_first(&backlog->rounds,
					  pen_rect_area(pen_tiling_rect(&backlog->tiling, i)));
		place(backlog, i);
	}
}

int pen_backlog_init(struct pen_backlog *backlog, const struct pen_tiling *tiling,
	const struct pen_rounds *rounds, const uint16_t *merged, const struct pen_demand *demands,
	struct pen_error *err)
{
	*backlog = (struct pen_backlog){
		.tiling = *tiling,
		.rounds = *rounds,
		.tiles = calloc(tiling->count, sizeof *backlog->tiles),
	};
	if (!backlog->tiles || pen_tile_queue_init(&backlog->waiting, tiling, err) < 0) {
		pen_backlog_finish(backlog);
		return pen_error_memory(err);
	}
	fill(backlog, merged, demands);
	return 0;
}

void pen_backlog_restart(struct pen_backlog *backlog)
{
	assert(backlog->merging == 0 && backlog->out == 0);
	memset(backlog->tiles, 0, backlog->tiling.count * sizeof *backlog->tiles);
	backlog->is_asking = false;
	pen_tile_queue_clear(&backlog->waiting);
	fill(backlog, NULL, NULL);
}

void pen_backlog_finish(struct pen_backlog *backlog)
{
	pen_tile_queue_finish(&backlog->waiting);
	free(backlog->tiles);
	backlog->tiles = NULL;
}

uint64_t pen_backlog_samples(const struct pen_backlog *backlog, uint32_t index)
{
	const struct pen_backlog_tile *tile = &backlog->tiles[index];
	const struct pen_round samples = pen_round_get(&backlog->rounds, tile->round);
	const uint64_t area = pen_rect_area(pen_tiling_rect(&backlog->tiling, index));
	const bool is_last = tile->round + 1 == tile->demand.rounds;

	return (is_last ? tile->demand.pixels : area) * (samples.end - samples.first);
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
	backlog->out++;
	pen_tile_queue_remove(&backlog->waiting, place);
	return tile;
}

void pen_backlog_return(struct pen_backlog *backlog, uint32_t index)
{
	struct pen_backlog_tile *tile = &backlog->tiles[index];

	assert(tile->state == TILE_OUT);
	tile->state = TILE_WAITING;
	backlog->out--;
	tile->epoch++;
	pen_tile_queue_push(&backlog->waiting, index, tile->round);
}

void pen_backlog_deliver(struct pen_backlog *backlog, uint32_t tile)
{
	assert(backlog->tiles[tile].state == TILE_OUT);
	backlog->tiles[tile].state = TILE_MERGING;
	backlog->out--;
	backlog->merging++;
}

bool pen_backlog_merged(struct pen_backlog *backlog, uint32_t index)
{
	struct pen_backlog_tile *tile = &backlog->tiles[index];

	assert(tile->state == TILE_MERGING);
	backlog->merging--;
	tile->round++;
	tile->faults = tile->kills = tile->opinion_count = 0;
	tile->is_haunted = false;
	place(backlog, index);
	return backlog->tiles_left == 0;
}

bool pen_backlog_asks(struct pen_backlog *backlog)
{
	if (backlog->is_asking || backlog->tiles_left == 0 || backlog->waiting.count > 0 ||
		backlog->out > 0 || backlog->merging > 0)
		return false;
	backlog->is_asking = true;
	return true;
}

bool pen_backlog_decided(struct pen_backlog *backlog, const struct pen_demand *demands)
{
	backlog->is_asking = false;
	for (uint32_t i = 0; i < backlog->tiling.count; i++) {
		struct pen_backlog_tile *tile = &backlog->tiles[i];

		tile->demand = demands[i];
		if (tile->state == TILE_HELD)
			place(backlog, i);
	}
	return backlog->tiles_left == 0;
}

uint32_t pen_backlog_opinions(const struct pen_backlog *backlog, uint32_t tile)
{
	return backlog->tiles[tile].opinion_count;
}

const struct pen_backlog_opinion *pen_backlog_opinion(
	const struct pen_backlog *backlog, uint32_t tile, uint32_t index)
{
	assert(index < backlog->tiles[tile].opinion_count);
	return &backlog->tiles[tile].opinions[index];
}

bool pen_backlog_has_opinion(const struct pen_backlog *backlog, uint32_t tile, uint64_t worker)
{
	for (uint32_t i = 0; i < backlog->tiles[tile].opinion_count; i++)
		if (backlog->tiles[tile].opinions[i].worker == worker)
			return true;
	return false;
}

void pen_backlog_retract(struct pen_backlog *backlog, uint64_t worker)
{
	for (uint32_t i = 0; i < backlog->tiling.count; i++) {
		struct pen_backlog_tile *tile = &backlog->tiles[i];

		for (uint8_t k = tile->opinion_count; k-- > 0;)
			if (tile->opinions[k].worker == worker)
				tile->opinions[k] = tile->opinions[--tile->opinion_count];
	}
}

void pen_backlog_depart(struct pen_backlog *backlog, uint64_t worker)
{
	for (uint32_t i = 0; i < backlog->tiling.count; i++) {
		struct pen_backlog_tile *tile = &backlog->tiles[i];

		for (uint8_t k = 0; k < tile->opinion_count; k++) {
			if (tile->opinions[k].worker != worker)
				continue;
			tile->ghost = tile->opinions[k];
			tile->is_haunted = true;
		}
	}
	pen_backlog_retract(backlog, worker);
}

const struct pen_backlog_opinion *pen_backlog_ghost(
	const struct pen_backlog *backlog, uint32_t index)
{
	return backlog->tiles[index].is_haunted ? &backlog->tiles[index].ghost : NULL;
}

void pen_backlog_opine(struct pen_backlog *backlog, uint32_t tile, uint64_t worker, uint64_t digest)
{
	struct pen_backlog_tile *place = &backlog->tiles[tile];

	assert(place->opinion_count < PEN_BACKLOG_OPINIONS);
	place->opinions[place->opinion_count++] = (struct pen_backlog_opinion){worker, digest};
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
