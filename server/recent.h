/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_RECENT_H
#define PEN_SERVER_RECENT_H

#include "core/base/limits.h"
#include "server/job.h"

#include <stddef.h>
#include <stdint.h>

/*
 * The resources of the renders that were asked for last, as texts: many clients that look at one
 * render cost one making of it. A text is good while its render's revision stands, and for a moment
 * only when the render is not over, since it tells of the time.
 */
struct pen_recent_text {
	uint64_t number, revision; /* of the render */
	int64_t until_ms;	   /* on pen_clock_ms */
	char *text;		   /* heap; NULL: nothing */
	size_t size;
};

struct pen_recent {
	struct pen_recent_text texts[PEN_RECENT_TEXTS_MAX];
};

void pen_recent_finish(struct pen_recent *recent);

/* Borrowed until the next call; NULL when it has to be made. */
const struct pen_recent_text *pen_recent_find(
	const struct pen_recent *recent, const struct pen_job *job, int64_t now_ms);

/* Copies the text; without memory, or when it is long, nothing is kept. */
void pen_recent_put(struct pen_recent *recent, const struct pen_job *job, int64_t now_ms,
	const char *text, size_t size);

#endif
