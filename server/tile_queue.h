/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_TILE_QUEUE_H
#define PEN_SERVER_TILE_QUEUE_H

#include "core/base/error.h"
#include "core/base/tile.h"

#include <stdint.h>

/*
 * The tiles of a job that wait for their next round, as a binary heap: lowest round first, then
 * nearest the centre of the image. A tile is in it at most once.
 */
struct pen_tile_queue {
	uint64_t *heap; /* round << 32 | rank */
	uint32_t count;
	uint32_t *tiles; /* by rank: centre-out */
	uint32_t *ranks; /* by tile */
};

/* All the memory it will ever need; empty at first. */
int pen_tile_queue_init(
	struct pen_tile_queue *queue, const struct pen_tiling *tiling, struct pen_error *err);
void pen_tile_queue_finish(struct pen_tile_queue *queue);

/* Empty again. */
static inline void pen_tile_queue_clear(struct pen_tile_queue *queue)
{
	queue->count = 0;
}

void pen_tile_queue_push(struct pen_tile_queue *queue, uint32_t tile, uint32_t round);

/* The tile at place (< count); the best is at place 0, the others in no particular order. */
uint32_t pen_tile_queue_at(const struct pen_tile_queue *queue, uint32_t place);

/* Whether what is at place a goes before what is at place b. */
static inline int pen_tile_queue_before(const struct pen_tile_queue *queue, uint32_t a, uint32_t b)
{
	return queue->heap[a] < queue->heap[b];
}

void pen_tile_queue_remove(struct pen_tile_queue *queue, uint32_t place);

#endif
