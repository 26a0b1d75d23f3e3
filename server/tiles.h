/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_TILES_H
#define PEN_SERVER_TILES_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "server/canvas.h"
#include "server/job.h"
#include "server/store.h"

#include <stddef.h>
#include <stdint.h>

/* How far an unfinished job's tiles are, and which of that the store has not been told yet. */
struct pen_tiles {
	struct pen_canvas_tile *states; /* as many as the job's tiling; NULL: nothing is rendered */
	struct pen_store_tile news[PEN_TILES_COMMIT_MAX];
	size_t news_count;
	int64_t news_ms; /* of the oldest */
};

/* All tiles at 0 rounds. */
int pen_tiles_init(struct pen_tiles *tiles, const struct pen_job *job, struct pen_error *err);
void pen_tiles_finish(struct pen_tiles *tiles);

/* Takes over what a canvas has found, and sets the job's counters to it. */
void pen_tiles_load(
	struct pen_tiles *tiles, struct pen_job *job, const struct pen_canvas_tile *states);

/* One more round of a tile is merged: counts it, in job too. True when the news are full. */
bool pen_tiles_merged(struct pen_tiles *tiles, struct pen_job *job, uint32_t tile, uint64_t xxh3);

/*
 * Hands the news to the store. They are dropped when it refuses: a tile whose row is old is
 * rendered again after a restart, no more.
 */
void pen_tiles_flush(struct pen_tiles *tiles, const struct pen_job *job, struct pen_store *store);

#endif
