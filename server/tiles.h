/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_TILES_H
#define PEN_SERVER_TILES_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "server/canvas.h"
#include "server/job.h"
#include "server/store.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* How far the tiles of one frame of an unfinished job are. */
struct pen_tiles {
	uint32_t frame;			/* 0: of none */
	struct pen_canvas_tile *states; /* as many as the job's tiling */
	struct pen_demand *demands;	/* likewise */
	uint64_t *revisions; /* likewise: of the job, when each was merged last; 0: never */
	uint32_t done;	     /* with all that they shall have */
	uint64_t units_done, samples_done;
	uint64_t samples;  /* of all its pixels, at most */
	uint64_t revision; /* image_revision of the job at the last merge */
};

/* All tiles of the frame at 0 rounds. */
int pen_tiles_init(
	struct pen_tiles *tiles, const struct pen_job *job, uint32_t frame, struct pen_error *err);
void pen_tiles_finish(struct pen_tiles *tiles);

/* Takes over what a canvas has found, at its first opening; the job's counters get what is there.
 */
void pen_tiles_load(
	struct pen_tiles *tiles, struct pen_job *job, const struct pen_canvas_tile *states);

/* One more round of a tile is merged: counts it, in job too. True when it was the frame's last. */
bool pen_tiles_merged(struct pen_tiles *tiles, struct pen_job *job, uint32_t tile,
	const struct pen_canvas_tile *state);

/*
 * Takes over what the canvas knows of the tiles' needs; the job's counters get the difference. True
 * when no tile lacks anything.
 */
bool pen_tiles_decided(
	struct pen_tiles *tiles, struct pen_job *job, const struct pen_canvas *canvas);

/* See pen_jobs_tiles_since. */
size_t pen_tiles_since(const struct pen_tiles *tiles, const struct pen_tiling *tiling,
	uint64_t revision, struct pen_rect *ret_rects, size_t max);

/* What of a job's tiles the store has not been told yet. */
struct pen_tile_news {
	struct pen_store_tile items[PEN_TILES_COMMIT_MAX];
	size_t count;
	int64_t since_ms; /* of the oldest */
};

/* True when they are full. */
bool pen_tile_news_add(struct pen_tile_news *news, const struct pen_tiles *tiles, uint32_t tile);

/*
 * Hands the news to the store, but for those of frames that are done. They are dropped when it
 * refuses: a tile whose row is old is rendered again after a restart, no more.
 */
void pen_tile_news_flush(
	struct pen_tile_news *news, const struct pen_job *job, struct pen_store *store);

#endif
