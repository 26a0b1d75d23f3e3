/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_WATCH_H
#define PEN_SERVER_WATCH_H

#include "core/base/error.h"
#include "server/job.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/queue.h>
#include <uv.h>

/*
 * Those who wait for a render to change. Renders change in many places and often, clients look
 * seldom: so a timer compares revisions, every PEN_WATCH_TICK_MS while there is anybody, and at
 * once when a render is over.
 */
struct pen_watches;

enum { PEN_WATCH_TICK_MS = 20 };

/* One who waits: the caller's memory. */
struct pen_watch {
	const char *id;	   /* of the render; the caller's */
	uint64_t revision; /* that has been seen: any other one is a change, as is a removal */
	bool until_over;   /* only the end of the render is a change */
	int64_t earliest_ms, latest_ms; /* pen_clock_ms: due not before, and then at all events */
	/* Nobody waits any more; it may start again, but may not stop others. */
	void (*due)(struct pen_watch *watch);
	TAILQ_ENTRY(pen_watch) link;
};

int pen_watches_create(uv_loop_t *loop, struct pen_jobs *jobs, struct pen_watches **ret_watches,
	struct pen_error *err);

/* Everyone is due; nobody may start from now on. */
void pen_watches_destroy(struct pen_watches *watches);

/* False when PEN_WATCHES_MAX wait already. */
bool pen_watch_start(struct pen_watches *watches, struct pen_watch *watch);
void pen_watch_stop(struct pen_watches *watches, struct pen_watch *watch);

#endif
