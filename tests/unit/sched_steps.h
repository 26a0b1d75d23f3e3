/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_UNIT_SCHED_STEPS_H
#define PEN_TESTS_UNIT_SCHED_STEPS_H

#include "server/sched.h"

/* clang-format off */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
/* clang-format on */
#include <stdint.h>
#include <stdlib.h>

/* A scheduler in tests: what is put in, and what is looked for in what comes out. */

static inline struct pen_sched *make_sched(uint64_t secret)
{
	struct pen_sched *sched;

	assert_int_equal(pen_sched_create(secret, &sched, NULL), 0);
	return sched;
}

static inline struct pen_sched_actions step(
	struct pen_sched *sched, struct pen_sched_event event, int64_t now_ms)
{
	return pen_sched_step(sched, &event, now_ms);
}

static inline struct pen_sched_actions tick(struct pen_sched *sched, int64_t now_ms)
{
	return step(sched, (struct pen_sched_event){.type = PEN_SCHED_TICK}, now_ms);
}

/* A job of square frames of this side in tiles of 16; of one frame, unless it says how many. */
static inline void add_frames(struct pen_sched *sched, struct pen_sched_job job, uint32_t side)
{
	struct pen_tiling tiling;

	pen_tiling_init(&tiling, (struct pen_rect){0, 0, side, side}, 16);
	job.tiling = &tiling;
	job.priority = 50;
	if (job.frame_end == 0) {
		job.frame_first = 1;
		job.frame_end = 2;
	}
	assert_int_equal(pen_sched_add_job(sched, &job, NULL), 0);
}

/* The first action of a type, which must be there. */
static inline struct pen_sched_action find(
	struct pen_sched_actions actions, enum pen_sched_action_type type)
{
	for (size_t i = 0; i < actions.count; i++)
		if (actions.items[i].type == type)
			return actions.items[i];
	fail();
	abort();
}

static inline size_t count(struct pen_sched_actions actions, enum pen_sched_action_type type)
{
	size_t n = 0;

	for (size_t i = 0; i < actions.count; i++)
		n += actions.items[i].type == type;
	return n;
}

/* Renders and merges a unit; the actions are of the merge. */
static inline struct pen_sched_actions finish_unit(
	struct pen_sched *sched, struct pen_sched_action lease, int64_t now_ms)
{
	(void)step(sched,
		(struct pen_sched_event){.type = PEN_SCHED_RESULT,
			.worker = lease.worker,
			.lease = lease.lease,
			.u.seconds = 0.01},
		now_ms);
	return step(sched,
		(struct pen_sched_event){.type = PEN_SCHED_MERGED,
			.job = lease.job,
			.u.merged = {lease.frame, lease.tile}},
		now_ms);
}

#endif
