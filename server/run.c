/* SPDX-License-Identifier: Apache-2.0 */
#include "server/run.h"

#include "core/base/clock.h"
#include "core/base/log.h"
#include "server/store.h"

#include <assert.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The longest that merged tiles wait to be stored. */
enum { NEWS_MS = 1000 };

struct pen_run *pen_run_find(const struct pen_jobs *jobs, uint64_t number)
{
	return (struct pen_run *)pen_job_table_find_number(&jobs->table, number);
}

void pen_run_destroy(struct pen_run *run)
{
	if (!run)
		return;
	pen_canvas_destroy(run->canvas);
	pen_tiles_finish(&run->tiles);
	free(run->job.name);
	free(run->job.equivalence_class);
	free(run);
}

void pen_run_halt(struct pen_run *run)
{
	pen_canvas_destroy(run->canvas);
	run->canvas = NULL;
	run->begun = false;
}

void pen_run_retire(struct pen_jobs *jobs, struct pen_run *run)
{
	pen_run_halt(run);
	pen_tiles_finish(&run->tiles);
	TAILQ_REMOVE(&jobs->unfinished, run, unfinished);
	jobs->unfinished_count--;
}

void pen_run_path(const struct pen_jobs *jobs, const char *id, char *ret_path)
{
	(void)snprintf(ret_path, PATH_MAX, "%s/frames/%s.f32", jobs->options.data_dir, id);
}

/* Durable changes */

struct pen_change *pen_change_create(
	struct pen_jobs *jobs, const struct pen_job *job, pen_job_fn *fn, void *user)
{
	struct pen_change *change = calloc(1, sizeof *change);

	if (change)
		*change = (struct pen_change){
			.jobs = jobs, .number = job->number, .fn = fn, .user = user};
	return change;
}

void pen_change_finish(struct pen_change *change, struct pen_job *job, const struct pen_error *err)
{
	struct pen_jobs *jobs = change->jobs;

	if (change->fn)
		change->fn(change->user, err->code == 0 ? job : NULL, err);
	free(change);
	if (err->code == 0 || err->code == PEN_ENOSPACE || jobs->broken)
		return;
	jobs->broken = true;
	jobs->options.broken(jobs->options.user, err);
}

void pen_run_give_up(struct pen_run *run, const struct pen_error *err)
{
	if (run->trouble.code == 0)
		run->trouble = *err;
}

static void show_end(struct pen_jobs *jobs, struct pen_run *run, const struct pen_change *change)
{
	run->job.state = change->state;
	run->job.error = change->error;
	run->job.finished_ms = change->finished_ms;
	run->job.eta_seconds = -1;
	run->job.revision++;
	pen_run_retire(jobs, run);
	pen_log(PEN_LOG_INFO, "render %s: %s%s%s", run->job.id, pen_job_state_name(change->state),
		change->error.text[0] ? ": " : "", change->error.text);
}

static void handle_state_stored(void *user, const struct pen_error *err)
{
	struct pen_change *change = user;
	struct pen_jobs *jobs = change->jobs;
	struct pen_run *run = pen_run_find(jobs, change->number);

	assert(run); /* the store answers in order: a removal comes last */
	if (pen_job_is_over(change->state)) {
		run->ending = false;
		if (err->code == 0)
			show_end(jobs, run, change);
		else
			pen_run_give_up(run, err);
	}
	pen_change_finish(change, &run->job, err);
}

int pen_run_store_state(struct pen_jobs *jobs, struct pen_run *run, enum pen_job_state state,
	const struct pen_error *reason, pen_job_fn *fn, void *user, struct pen_error *err)
{
	struct pen_change *change = pen_change_create(jobs, &run->job, fn, user);
	struct pen_job row = run->job;
	int r;

	if (!change)
		return pen_error_memory(err);
	if (pen_job_is_over(state) && row.units_done == 0)
		row.image_revision = run->job.image_revision = 0;
	row.state = change->state = state;
	row.error = change->error = reason ? *reason : (struct pen_error)PEN_ERROR_INIT;
	row.finished_ms = change->finished_ms = pen_job_is_over(state) ? pen_clock_wall_ms() : 0;
	r = pen_store_update_job(jobs->options.store, &row, handle_state_stored, change, err);
	if (r < 0) {
		free(change);
		return r;
	}
	run->ending = pen_job_is_over(state);
	if (!run->ending) {
		run->job.state = state;
		run->job.error = row.error;
		run->job.revision++;
	}
	return 0;
}

/* What nobody waits for. */
static void store_row(struct pen_jobs *jobs, const struct pen_run *run)
{
	struct pen_error err = PEN_ERROR_INIT;

	if (pen_store_update_job(jobs->options.store, &run->job, NULL, NULL, &err) < 0)
		pen_log(PEN_LOG_WARNING, "render %s: %s", run->job.id, err.text);
}

/* Rendering */

static void sync_canvas(struct pen_run *run)
{
	struct pen_error err;

	/* Without a canvas it has been given up already. */
	if (run->canvas && pen_canvas_sync(run->canvas, &err) < 0)
		pen_run_give_up(run, &err);
}

/* Gives the job to the dispatch, with what is rendered already. */
static int dispatch_job(struct pen_jobs *jobs, struct pen_run *run, struct pen_error *err)
{
	struct pen_sched_job added = {
		.number = run->job.number,
		.tiling = &run->job.tiling,
		.samples = run->job.sampling.samples,
		.priority = run->job.priority,
		.paused = run->job.state == PEN_JOB_PAUSED,
		.equivalence_class = run->job.equivalence_class,
	};
	uint16_t *rounds = calloc(run->job.tiling.count, sizeof *rounds);
	int r;

	if (!rounds)
		return pen_error_memory(err);
	for (uint32_t i = 0; run->tiles.states && i < run->job.tiling.count; i++)
		rounds[i] = run->tiles.states[i].rounds;
	added.rounds = rounds;
	r = pen_dispatch_add_job(jobs->options.dispatch, &added, err);
	free(rounds);
	return r;
}

static void handle_opened(void *user, uint64_t number, const struct pen_canvas_tile *states)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_error err;

	pen_tiles_load(&run->tiles, &run->job, states);
	run->samples_at_begin = run->job.samples_done;
	if (run->job.units_done == run->job.units_total)
		sync_canvas(run);
	else if (dispatch_job(jobs, run, &err) < 0)
		pen_run_give_up(run, &err);
}

static void handle_merged(void *user, uint64_t number, uint32_t tile, uint64_t xxh3)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);

	if (pen_tiles_merged(&run->tiles, &run->job, tile, xxh3))
		pen_tiles_flush(&run->tiles, &run->job, jobs->options.store);
	pen_dispatch_merged(jobs->options.dispatch, number, tile);
}

static void handle_synced(void *user, uint64_t number)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_error err;

	if (pen_run_store_state(jobs, run, PEN_JOB_DONE, NULL, NULL, NULL, &err) < 0)
		pen_run_give_up(run, &err);
}

static void handle_canvas_failed(void *user, uint64_t number, const struct pen_error *err)
{
	pen_run_give_up(pen_run_find(user, number), err);
}

static struct pen_canvas_events canvas_events(struct pen_jobs *jobs)
{
	return (struct pen_canvas_events){
		handle_opened, handle_merged, handle_synced, handle_canvas_failed, jobs};
}

static struct pen_framebuf framebuf_of(const struct pen_run *run)
{
	return (struct pen_framebuf){run->job.tiling, pen_job_film(&run->job)};
}

void pen_run_begin(struct pen_jobs *jobs, struct pen_run *run)
{
	const struct pen_framebuf framebuf = framebuf_of(run);
	struct pen_canvas_events events = canvas_events(jobs);
	char path[PATH_MAX];
	struct pen_error err;
	int r;

	run->begun = true;
	run->trouble.code = 0;
	if (run->tiles.states) {
		pen_run_path(jobs, run->job.id, path);
		r = pen_canvas_open(jobs->loop, run->job.number, path, &framebuf, run->tiles.states,
			&events, &run->canvas, &err);
	} else {
		r = dispatch_job(jobs, run, &err);
	}
	if (r < 0)
		pen_run_give_up(run, &err);
}

/* What the dispatch tells; none of it may call the dispatch. */

static const struct pen_job *dispatch_find(void *user, uint64_t number)
{
	return &pen_run_find(user, number)->job;
}

/* The content address: SHA-256 of the scene's digest and the class. */
static void set_class(struct pen_job *shown, const char *equivalence_class)
{
	char text[PEN_SHA256_TEXT + PEN_CLASS_BYTES_MAX + 2];
	struct pen_sha256 content;

	free(shown->equivalence_class);
	shown->equivalence_class = strdup(equivalence_class);
	pen_sha256_format(&shown->scene_sha256, text);
	(void)snprintf(text + PEN_SHA256_TEXT - 1, sizeof text - PEN_SHA256_TEXT + 1, " %s",
		equivalence_class);
	if (pen_sha256_of(text, strlen(text), &content, NULL) == 0)
		pen_sha256_format(&content, shown->content);
}

static int create_canvas(struct pen_jobs *jobs, struct pen_run *run, struct pen_error *err)
{
	const struct pen_framebuf framebuf = framebuf_of(run);
	struct pen_canvas_events events = canvas_events(jobs);
	char path[PATH_MAX];
	int r = pen_tiles_init(&run->tiles, &run->job, err);

	if (r < 0)
		return r;
	pen_run_path(jobs, run->job.id, path);
	return pen_canvas_create(
		jobs->loop, run->job.number, path, &framebuf, &events, &run->canvas, err);
}

static void dispatch_started(void *user, uint64_t number, const char *equivalence_class)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_error err;

	set_class(&run->job, equivalence_class);
	run->job.state = PEN_JOB_RUNNING;
	if (run->job.started_ms == 0)
		run->job.started_ms = pen_clock_wall_ms();
	run->job.revision++;
	store_row(jobs, run);
	if (!run->canvas && create_canvas(jobs, run, &err) < 0)
		pen_run_give_up(run, &err);
}

static void dispatch_merge(
	void *user, uint64_t number, uint32_t tile, uint32_t round, float *pixels)
{
	struct pen_run *run = pen_run_find(user, number);
	struct pen_error err;

	if (!run->canvas || run->trouble.code < 0)
		free(pixels);
	else if (pen_canvas_merge(run->canvas, tile, round, pixels, &err) < 0)
		pen_run_give_up(run, &err);
}

static void handle_reset(void *user, const struct pen_error *err)
{
	struct pen_change *change = user;
	struct pen_run *run = pen_run_find(change->jobs, change->number);

	assert(run);
	if (!run->ending && err->code == 0)
		pen_run_begin(change->jobs, run);
	else if (!run->ending)
		pen_run_give_up(run, err);
	pen_change_finish(change, &run->job, err);
}

/* As if it had just been accepted; the revisions go on rising. */
static void forget_pixels(struct pen_run *run)
{
	struct pen_job *job = &run->job;

	pen_run_halt(run);
	pen_tiles_finish(&run->tiles);
	free(job->equivalence_class);
	job->equivalence_class = NULL;
	job->content[0] = '\0';
	job->units_done = job->samples_done = job->tiles_done = 0;
	job->state = PEN_JOB_QUEUED;
	job->eta_seconds = -1;
	job->revision++;
	run->samples_at_begin = 0;
	run->running_ms = 0;
}

/* Its class has gone: another one may start, from nothing, when that is stored. */
static void restart(struct pen_jobs *jobs, struct pen_run *run)
{
	struct pen_change *change = pen_change_create(jobs, &run->job, NULL, NULL);
	struct pen_error err;
	int r;

	pen_log(PEN_LOG_WARNING, "render %s: no worker of its class is left, it starts again",
		run->job.id);
	forget_pixels(run);
	run->job.restarts++;
	run->begun = true;
	r = change ? pen_store_update_job(
			     jobs->options.store, &run->job, handle_reset, change, &err)
		   : pen_error_memory(&err);
	if (r < 0) {
		free(change);
		pen_run_give_up(run, &err);
	}
}

static void dispatch_ended(
	void *user, uint64_t number, enum pen_dispatch_end end, const char *reason)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_error why = PEN_ERROR_INIT, err;

	switch (end) {
	case PEN_DISPATCH_RENDERED: sync_canvas(run); return;
	case PEN_DISPATCH_ABANDONED: restart(jobs, run); return;
	case PEN_DISPATCH_FAILED: break;
	}
	pen_run_halt(run);
	(void)pen_error_set(&why, PEN_EIO, "%s", reason);
	if (pen_run_store_state(jobs, run, PEN_JOB_FAILED, &why, NULL, NULL, &err) < 0)
		pen_run_give_up(run, &err);
}

void pen_run_connect(struct pen_jobs *jobs)
{
	struct pen_dispatch_jobs calls = {
		dispatch_find, dispatch_started, dispatch_merge, dispatch_ended, jobs};

	pen_dispatch_connect_jobs(jobs->options.dispatch, &calls);
}

/* Time passes */

/* Remaining samples over those merged a second since this coordinator began. */
static void update_eta(struct pen_run *run)
{
	struct pen_job *shown = &run->job;
	uint64_t total = pen_rect_area(shown->tiling.crop) * shown->sampling.samples;
	uint64_t merged = shown->samples_done - run->samples_at_begin;

	if (shown->state != PEN_JOB_RUNNING)
		return;
	run->running_ms += PEN_RUN_TICK_MS;
	if (merged == 0)
		return;
	shown->eta_seconds = 1e-3 * (double)run->running_ms *
			     (double)(total - shown->samples_done) / (double)merged;
	shown->revision++;
}

static void pause_troubled(struct pen_jobs *jobs, struct pen_run *run)
{
	struct pen_error err;

	pen_log(PEN_LOG_ERROR, "render %s is paused: %s", run->job.id, run->trouble.text);
	pen_dispatch_remove_job(jobs->options.dispatch, run->job.number);
	pen_run_halt(run);
	if (pen_run_store_state(jobs, run, PEN_JOB_PAUSED, &run->trouble, NULL, NULL, &err) < 0)
		pen_log(PEN_LOG_ERROR, "render %s: %s", run->job.id, err.text);
}

void pen_run_tick(struct pen_jobs *jobs, struct pen_run *run)
{
	if (run->ending)
		return;
	if (run->tiles.news_count > 0 && pen_clock_ms() - run->tiles.news_ms >= NEWS_MS)
		pen_tiles_flush(&run->tiles, &run->job, jobs->options.store);
	update_eta(run);
	if (run->trouble.code < 0 && run->job.state != PEN_JOB_PAUSED)
		pause_troubled(jobs, run);
}
