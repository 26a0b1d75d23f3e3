/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_REEL_H
#define PEN_SERVER_REEL_H

#include "server/backlog.h"

#include <stdint.h>

/*
 * The frames of one job, in order. A few of them are in flight, each with a backlog; those before
 * are wholly merged, those behind not begun. Each frame begins when nothing of the ones before it
 * waits.
 */
enum { PEN_REEL_FRAMES_MAX = 16 };

struct pen_reel {
	struct pen_backlog *backlogs; /* frame n's is at n modulo slots */
	uint32_t slots;
	uint32_t first; /* of those that are not wholly merged */
	uint32_t open;	/* the first that is not in flight */
	uint32_t end;
};

/* How many of count frames may be in flight: enough to keep a farm busy. */
uint32_t pen_reel_slots(const struct pen_tiling *tiling, uint32_t count);

/*
 * For frames first <= n < end. merged: how many rounds of each tile are merged already, tile by
 * tile, of as many frames from first on as may be in flight; NULL: none. demands: likewise, what
 * each shall have; NULL: nothing is decided. Takes all the memory needed.
 */
int pen_reel_init(struct pen_reel *reel, const struct pen_tiling *tiling, uint32_t first,
	uint32_t end, const struct pen_rounds *rounds, const uint16_t *merged,
	const struct pen_demand *demands, struct pen_error *err);
void pen_reel_finish(struct pen_reel *reel);

/* Of a frame in flight. */
struct pen_backlog *pen_reel_backlog(const struct pen_reel *reel, uint32_t frame);

/*
 * To be called when something has gone out or was merged: frames that are wholly merged make room,
 * and the next one begins when it may. The last is merged when first == end.
 */
void pen_reel_advance(struct pen_reel *reel);

/* Over all frames in flight. */
uint64_t pen_reel_waiting(const struct pen_reel *reel);
uint32_t pen_reel_merging(const struct pen_reel *reel);

#endif
