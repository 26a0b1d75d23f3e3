/* SPDX-License-Identifier: Apache-2.0 */
#include "server/watch.h"

#include "core/base/clock.h"
#include "core/base/limits.h"

#include <stdlib.h>

struct pen_watches {
	uv_timer_t timer;
	struct pen_jobs *jobs;
	TAILQ_HEAD(, pen_watch) all;
	size_t count;
	bool closing;
};

static void handle_tick(uv_timer_t *timer);

/* Most who wait, wait for an end: they need not wait for the next tick as well. */
static void handle_end(void *user)
{
	struct pen_watches *watches = user;

	if (watches->count > 0)
		(void)uv_timer_start(&watches->timer, handle_tick, 0, PEN_WATCH_TICK_MS);
}

int pen_watches_create(uv_loop_t *loop, struct pen_jobs *jobs, struct pen_watches **ret_watches,
	struct pen_error *err)
{
	struct pen_watches *watches = calloc(1, sizeof *watches);

	if (!watches)
		return pen_error_memory(err);
	watches->jobs = jobs;
	pen_jobs_listen(jobs, handle_end, watches);
	TAILQ_INIT(&watches->all);
	(void)uv_timer_init(loop, &watches->timer);
	watches->timer.data = watches;
	*ret_watches = watches;
	return 0;
}

void pen_watch_stop(struct pen_watches *watches, struct pen_watch *watch)
{
	TAILQ_REMOVE(&watches->all, watch, link);
	if (--watches->count == 0)
		(void)uv_timer_stop(&watches->timer);
}

static bool is_due(struct pen_watches *watches, const struct pen_watch *watch, int64_t now_ms)
{
	const struct pen_job *job;

	if (now_ms < watch->earliest_ms)
		return false;
	if (now_ms >= watch->latest_ms)
		return true;
	job = pen_jobs_find(watches->jobs, watch->id);
	if (!job)
		return true;
	return watch->until_over ? pen_job_is_over(job->state) : job->revision != watch->revision;
}

static void tell(struct pen_watches *watches, int64_t now_ms, bool all)
{
	struct pen_watch *next;

	for (struct pen_watch *watch = TAILQ_FIRST(&watches->all); watch; watch = next) {
		next = TAILQ_NEXT(watch, link);
		if (!all && !is_due(watches, watch, now_ms))
			continue;
		pen_watch_stop(watches, watch);
		watch->due(watch);
	}
}

static void handle_tick(uv_timer_t *timer)
{
	tell(timer->data, pen_clock_ms(), false);
}

bool pen_watch_start(struct pen_watches *watches, struct pen_watch *watch)
{
	if (watches->closing || watches->count == PEN_WATCHES_MAX)
		return false;
	TAILQ_INSERT_TAIL(&watches->all, watch, link);
	if (watches->count++ == 0)
		(void)uv_timer_start(
			&watches->timer, handle_tick, PEN_WATCH_TICK_MS, PEN_WATCH_TICK_MS);
	return true;
}

static void handle_closed(uv_handle_t *handle)
{
	free(handle->data);
}

void pen_watches_destroy(struct pen_watches *watches)
{
	if (!watches)
		return;
	watches->closing = true;
	pen_jobs_listen(watches->jobs, NULL, NULL);
	tell(watches, 0, true);
	uv_close((uv_handle_t *)&watches->timer, handle_closed);
}
