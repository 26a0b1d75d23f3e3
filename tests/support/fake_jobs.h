/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_SUPPORT_FAKE_JOBS_H
#define PEN_TESTS_SUPPORT_FAKE_JOBS_H

#include "server/job.h"

#include <uv.h>

/*
 * Renders that nobody renders: server/job.h over a table that starts with one job in each state
 * ("queued", "running", "paused", "done", "failed", "cancelled" are their ids; "removed" was
 * deleted) of 40x24 pixels in tiles of 16. Every second tile of an unfinished one is rendered,
 * none of "queued" and "failed". Accepting, changing and deleting take a turn of the loop. A
 * submission named "full", "disk" or "broken" fails as its name says.
 */
struct pen_jobs *fake_jobs_create(uv_loop_t *loop);
void fake_jobs_destroy(struct pen_jobs *jobs);

/* The "running" one gets another tile, and the "queued" one its first. */
void fake_jobs_advance(struct pen_jobs *jobs);

#endif
