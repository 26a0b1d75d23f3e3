/* SPDX-License-Identifier: Apache-2.0 */
#include "server/tile_queue.h"

#include <assert.h>
#include <stdlib.h>

struct place {
	uint64_t distance; /* squared, between centres, in half pixels */
	uint32_t tile;
};

static uint64_t distance(struct pen_rect a, struct pen_rect b)
{
	int64_t x = (int64_t)(a.x0 + a.x1) - (int64_t)(b.x0 + b.x1);
	int64_t y = (int64_t)(a.y0 + a.y1) - (int64_t)(b.y0 + b.y1);

	return (uint64_t)(x * x + y * y);
}

static int compare_places(const void *left, const void *right)
{
	const struct place *a = left, *b = right;

	if (a->distance != b->distance)
		return a->distance < b->distance ? -1 : 1;
	return a->tile < b->tile ? -1 : a->tile > b->tile;
}

static int rank_tiles(struct pen_tile_queue *queue, const struct pen_tiling *tiling)
{
	struct place *places = calloc(tiling->count, sizeof *places);

	if (!places)
		return PEN_ENOMEM;
	for (uint32_t i = 0; i < tiling->count; i++)
		places[i] = (struct place){distance(pen_tiling_rect(tiling, i), tiling->crop), i};
	qsort(places, tiling->count, sizeof *places, compare_places);
	for (uint32_t rank = 0; rank < tiling->count; rank++) {
		queue->tiles[rank] = places[rank].tile;
		queue->ranks[places[rank].tile] = rank;
	}
	free(places);
	return 0;
}

int pen_tile_queue_init(
	struct pen_tile_queue *queue, const struct pen_tiling *tiling, struct pen_error *err)
{
	*queue = (struct pen_tile_queue){
		.heap = calloc(tiling->count, sizeof *queue->heap),
		.tiles = calloc(tiling->count, sizeof *queue->tiles),
		.ranks = calloc(tiling->count, sizeof *queue->ranks),
	};
	if (!queue->heap || !queue->tiles || !queue->ranks || rank_tiles(queue, tiling) < 0) {
		pen_tile_queue_finish(queue);
		return pen_error_memory(err);
	}
	return 0;
}

void pen_tile_queue_finish(struct pen_tile_queue *queue)
{
	free(queue->heap);
	free(queue->tiles);
	free(queue->ranks);
	*queue = (struct pen_tile_queue){0};
}

/* Moves key up from place to where it belongs. */
static void rise(struct pen_tile_queue *queue, uint32_t place, uint64_t key)
{
	while (place > 0 && key < queue->heap[(place - 1) / 2]) {
		queue->heap[place] = queue->heap[(place - 1) / 2];
		place = (place - 1) / 2;
	}
	queue->heap[place] = key;
}

void pen_tile_queue_push(struct pen_tile_queue *queue, uint32_t tile, uint32_t round)
{
	rise(queue, queue->count++, (uint64_t)round << 32 | queue->ranks[tile]);
}

uint32_t pen_tile_queue_at(const struct pen_tile_queue *queue, uint32_t place)
{
	assert(place < queue->count);
	return queue->tiles[(uint32_t)queue->heap[place]];
}

void pen_tile_queue_remove(struct pen_tile_queue *queue, uint32_t place)
{
	uint64_t key;
	uint32_t child;

	/* The last key fills the hole: down as far as it must, then up as far as it may. */
	assert(place < queue->count);
	key = queue->heap[--queue->count];
	if (place == queue->count)
		return;
	while ((child = 2 * place + 1) < queue->count) {
		if (child + 1 < queue->count && queue->heap[child + 1] < queue->heap[child])
			child++;
		if (key <= queue->heap[child])
			break;
		queue->heap[place] = queue->heap[child];
		place = child;
	}
	rise(queue, place, key);
}
