/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_BACKLOG_H
#define PEN_SERVER_BACKLOG_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "core/base/tile.h"
#include "server/quota.h"
#include "server/tile_queue.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * The units of one frame: a unit is one round of one tile, and a tile's rounds come strictly in
 * order, one at a time: it waits, is out with a worker, merges, and waits again with its next
 * round. A tile that has what it shall have so far is held until more is decided. Remembers who
 * failed at a unit, and how often.
 */
struct pen_backlog {
	struct pen_tiling tiling;
	struct pen_rounds rounds;
	uint32_t tiles_left; /* that lack a round */
	uint32_t merging;    /* tiles */
	uint32_t out;	     /* tiles */
	bool is_asking;	     /* what its tiles shall have further is being decided */
	struct pen_backlog_tile *tiles;
	struct pen_tile_queue waiting;
};

/*
 * merged: how many rounds of each tile are merged already; NULL: none. demands: what each shall
 * have; NULL: nothing is decided yet. Takes all the memory needed.
 */
int pen_backlog_init(struct pen_backlog *backlog, const struct pen_tiling *tiling,
	const struct pen_rounds *rounds, const uint16_t *merged, const struct pen_demand *demands,
	struct pen_error *err);
void pen_backlog_finish(struct pen_backlog *backlog);

/* As after init without rounds, for another frame; nothing is out or merging. */
void pen_backlog_restart(struct pen_backlog *backlog);

/* Samples of a tile's next round, over all its pixels. */
uint64_t pen_backlog_samples(const struct pen_backlog *backlog, uint32_t index);

/* The next round of a tile, and how often it was given back. */
uint32_t pen_backlog_round(const struct pen_backlog *backlog, uint32_t tile);
uint32_t pen_backlog_epoch(const struct pen_backlog *backlog, uint32_t tile);

/* Whether the tile's next round has failed on worker. */
bool pen_backlog_failed_on(const struct pen_backlog *backlog, uint32_t tile, uint64_t worker);

/* The unit at a place of the queue goes out; tells its tile. */
uint32_t pen_backlog_take(struct pen_backlog *backlog, uint32_t place);

/* What went out comes back unrendered: it waits again, in a new epoch. */
void pen_backlog_return(struct pen_backlog *backlog, uint32_t index);

/* What went out has been rendered, and is being merged. */
void pen_backlog_deliver(struct pen_backlog *backlog, uint32_t tile);

/* It is merged. True when it was the frame's last unit. */
bool pen_backlog_merged(struct pen_backlog *backlog, uint32_t tile);

/* True, once, when every tile has what it shall have so far and there may be more to come. */
bool pen_backlog_asks(struct pen_backlog *backlog);

/* What each tile shall have, as far as is decided now. True when no tile lacks anything. */
bool pen_backlog_decided(struct pen_backlog *backlog, const struct pen_demand *demands);

/* What workers made of the tile's next round, while that has to be the same twice: at most two. */
struct pen_backlog_opinion {
	uint64_t worker, digest;
};
enum { PEN_BACKLOG_OPINIONS = 2 };
uint32_t pen_backlog_opinions(const struct pen_backlog *backlog, uint32_t tile);
const struct pen_backlog_opinion *pen_backlog_opinion(
	const struct pen_backlog *backlog, uint32_t tile, uint32_t index);
bool pen_backlog_has_opinion(const struct pen_backlog *backlog, uint32_t tile, uint64_t worker);

/* What worker made of any tile counts no more. */
void pen_backlog_retract(struct pen_backlog *backlog, uint64_t worker);

/* Worker has left: what it made is remembered as a ghost's, the last one's of each tile. */
void pen_backlog_depart(struct pen_backlog *backlog, uint64_t worker);

/* NULL: nobody who left has made the tile's next round. */
const struct pen_backlog_opinion *pen_backlog_ghost(
	const struct pen_backlog *backlog, uint32_t index);
void pen_backlog_opine(
	struct pen_backlog *backlog, uint32_t tile, uint64_t worker, uint64_t digest);

/* The unit failed on worker by its own fault. False when that was once too often. */
bool pen_backlog_blame(struct pen_backlog *backlog, uint32_t tile, uint64_t worker);

/* The unit was killed from outside. False when that counts as its own fault by now. */
bool pen_backlog_excuse(struct pen_backlog *backlog, uint32_t tile);

#endif
