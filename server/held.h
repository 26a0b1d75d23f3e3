/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_HELD_H
#define PEN_SERVER_HELD_H

#include "server/farm.h"
#include "server/job.h"

#include <stddef.h>
#include <stdint.h>

/*
 * Which worker is at work on which tile of a render, as the event "held" tells it: one text for all
 * that watch the same render, made anew after a moment. Zeroed, it holds nothing.
 */
struct pen_held {
	uint64_t number; /* of the render */
	int64_t until_ms;
	char *text;   /* heap, JSON; NULL: nothing */
	size_t count; /* of tiles */
};

void pen_held_finish(struct pen_held *held);

/* Makes it that of a render, as it is now or was a moment ago. */
void pen_held_refresh(struct pen_held *held, const struct pen_farm *farm, const struct pen_job *job,
	int64_t now_ms);

#endif
