/* SPDX-License-Identifier: Apache-2.0 */
#include "server/run.h"

#include "core/base/clock.h"
#include "core/base/log.h"
#include "server/content.h"
#include "server/frame_file.h"
#include "server/job_texts.h"
#include "server/preview.h"
#include "server/report.h"
#include "server/run_index.h"
#include "server/store.h"

#include <assert.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The longest that merged tiles wait to be stored. */
enum { NEWS_MS = 1000 };

#define NO_TILE UINT32_MAX

struct pen_run *pen_run_find(const struct pen_jobs *jobs, uint64_t number)
{
	return (struct pen_run *)pen_job_table_find_number(&jobs->table, number);
}

static struct pen_run_frame *place_of(struct pen_run *run, uint32_t number)
{
	return &run->frames[number % PEN_REEL_FRAMES_MAX];
}

/* NULL when it has not begun, or has passed. */
static struct pen_run_frame *find_frame(struct pen_run *run, uint32_t number)
{
	struct pen_run_frame *frame = place_of(run, number);

	return frame->tiles.frame == number ? frame : NULL;
}

struct pen_run_frame *pen_run_add_frame(struct pen_run *run, uint32_t number)
{
	struct pen_run_frame *frame = place_of(run, number);

	if (frame->tiles.frame == number)
		return frame;
	assert(frame->tiles.frame == 0);
	*frame = (struct pen_run_frame){.tile_last = NO_TILE};
	return pen_tiles_init(&frame->tiles, &run->job, number, NULL) < 0 ? NULL : frame;
}

static void drop_frame(struct pen_run_frame *frame)
{
	pen_canvas_destroy(frame->canvas);
	pen_tiles_finish(&frame->tiles);
	*frame = (struct pen_run_frame){.tile_last = NO_TILE};
}

static void drop_frames(struct pen_run *run)
{
	for (uint32_t i = 0; i < PEN_REEL_FRAMES_MAX; i++)
		drop_frame(&run->frames[i]);
	run->news.count = 0;
}

void pen_run_destroy(struct pen_run *run)
{
	if (!run)
		return;
	drop_frames(run);
	pen_job_texts_free(&run->job);
	if (run->text >= 0)
		(void)close(run->text);
	free(run);
}

void pen_run_halt(struct pen_run *run)
{
	for (uint32_t i = 0; i < PEN_REEL_FRAMES_MAX; i++) {
		struct pen_run_frame *frame = &run->frames[i];

		pen_canvas_destroy(frame->canvas);
		frame->canvas = NULL;
		frame->tile_last = NO_TILE;
		frame->synced = frame->is_deciding = false;
	}
	run->opening = 0;
	run->begun = false;
}

void pen_run_retire(struct pen_jobs *jobs, struct pen_run *run)
{
	pen_run_halt(run);
	drop_frames(run);
	TAILQ_REMOVE(&jobs->unfinished, run, unfinished);
	jobs->unfinished_count--;
}

void pen_run_path(
	const struct pen_jobs *jobs, const struct pen_job *job, uint32_t frame, char *ret_path)
{
	pen_frame_file_path(jobs->options.data_dir, job, frame, ret_path);
}

struct removal {
	uv_work_t work;
	char stem[PATH_MAX]; /* of all names */
	uint32_t first, count, restarts;
};

static void remove_files(uv_work_t *work)
{
	const struct removal *removal = work->data;
	char path[PATH_MAX + 32];

	for (uint32_t k = 0; k <= removal->restarts; k++)
		for (uint32_t i = 0; i < removal->count; i++) {
			(void)snprintf(path, sizeof path, "%s.%u.%u.f32", removal->stem, k,
				removal->first + i);
			(void)unlink(path);
		}
}

static void handle_files_removed(uv_work_t *work, int status)
{
	(void)status;
	free(work->data);
}

void pen_run_unlink(struct pen_jobs *jobs, const struct pen_job *job)
{
	struct removal *removal;
	char path[PATH_MAX];

	if (job->frame_count == 1) {
		pen_run_path(jobs, job, job->frame_first, path);
		(void)unlink(path);
		return;
	}
	/* What stays is removed at the next start. */
	removal = calloc(1, sizeof *removal);
	if (!removal)
		return;
	removal->work.data = removal;
	removal->first = job->frame_first;
	removal->count = job->frame_count;
	removal->restarts = job->restarts;
	(void)snprintf(removal->stem, sizeof removal->stem, "%s/frames/%s", jobs->options.data_dir,
		job->id);
	(void)uv_queue_work(jobs->loop, &removal->work, remove_files, handle_files_removed);
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
	if (err->code == 0 || err->code == PEN_ENOSPACE || err->code == PEN_ENOMEM || jobs->broken)
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
	run->job.frames_done = run->passed;
	run->job.revision++;
	pen_run_retire(jobs, run);
	pen_log_of(&(struct pen_log_about){.job = run->job.id, .trace = run->job.trace},
		PEN_LOG_INFO, "render %s: %s%s%s", run->job.id, pen_job_state_name(change->state),
		change->error.text[0] ? ": " : "", change->error.text);
	pen_run_index(jobs, run);
	if (run->job.is_preview)
		pen_preview_ended(jobs, run);
	if (jobs->heard)
		jobs->heard(jobs->listener);
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
	row.frames_done = run->passed;
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
	struct pen_job row = run->job;

	row.frames_done = run->passed;
	if (pen_store_update_job(jobs->options.store, &row, NULL, NULL, &err) < 0)
		pen_log_of(&(struct pen_log_about){.job = run->job.id, .trace = run->job.trace},
			PEN_LOG_WARNING, "render %s: %s", run->job.id, err.text);
}

/* Rendering */

static uint32_t first_open(const struct pen_run *run)
{
	return run->job.frame_first + run->passed;
}

static void sync_frame(struct pen_run *run, struct pen_run_frame *frame)
{
	struct pen_error err;

	/* Without a canvas it has been given up already. */
	if (frame->canvas && pen_canvas_sync(frame->canvas, !run->job.is_preview, &err) < 0)
		pen_run_give_up(run, &err);
}

/* What is merged of each tile of the frames that may be in flight, and what each shall have. */
static void list_tiles(
	struct pen_run *run, uint32_t frames, uint16_t *ret_merged, struct pen_demand *ret_demands)
{
	const struct pen_tiling *tiling = &run->job.tiling;
	const struct pen_rounds rounds = pen_sampling_rounds(&run->job.sampling);

	for (uint32_t i = 0; i < frames; i++) {
		const struct pen_run_frame *frame = find_frame(run, first_open(run) + i);

		for (uint32_t k = 0; k < tiling->count; k++) {
			const size_t place = (size_t)i * tiling->count + k;

			ret_merged[place] = frame ? frame->tiles.states[k].rounds : 0;
			ret_demands[place] =
				frame ? frame->tiles.demands[k]
				      : pen_demand_first(
						&rounds, pen_rect_area(pen_tiling_rect(tiling, k)));
		}
	}
}

/* Gives the job to the dispatch, with what is rendered already. */
static int dispatch_job(struct pen_jobs *jobs, struct pen_run *run, struct pen_error *err)
{
	struct pen_sched_job added = {
		.number = run->job.number,
		.tiling = &run->job.tiling,
		.frame_first = first_open(run),
		.frame_end = run->job.frame_first + run->job.frame_count,
		.rounds = pen_sampling_rounds(&run->job.sampling),
		.priority = run->job.priority,
		.restarted = run->job.restarts > 0,
		.resumed = run->job.units_done > 0,
		.verify = run->job.verify,
		.paused = run->job.state == PEN_JOB_PAUSED,
		.equivalence_class = run->job.equivalence_class,
	};
	const uint32_t frames =
		pen_reel_slots(&run->job.tiling, added.frame_end - added.frame_first);
	const size_t count = (size_t)frames * run->job.tiling.count;
	uint16_t *merged = calloc(count, sizeof *merged);
	struct pen_demand *demands = calloc(count, sizeof *demands);
	int r;

	if (merged && demands) {
		list_tiles(run, frames, merged, demands);
		added.merged = merged;
		added.demands = demands;
		r = pen_dispatch_add_job(jobs->options.dispatch, &added, err);
	} else {
		r = pen_error_memory(err);
	}
	free(merged);
	free(demands);
	return r;
}

/* One framebuffer less that is being looked at; after the last goes on with what they lack. */
static void go_on(struct pen_jobs *jobs, struct pen_run *run)
{
	struct pen_error err;

	if (run->opening > 0 && --run->opening > 0)
		return;
	run->samples_at_begin = run->job.samples_done;
	if (run->job.tiles_done < (uint64_t)run->job.tiling.count * run->job.frame_count &&
		dispatch_job(jobs, run, &err) < 0)
		pen_run_give_up(run, &err);
}

static void handle_opened(
	void *user, uint64_t number, uint32_t frame, const struct pen_canvas_tile *states)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);

	struct pen_run_frame *opened = place_of(run, frame);

	pen_tiles_load(&opened->tiles, &run->job, states);
	/* Only a frame that is on the disk makes room for others. */
	if (pen_tiles_decided(&opened->tiles, &run->job, opened->canvas))
		sync_frame(run, opened);
	else
		go_on(jobs, run);
}

/* The last tile of a frame counts as merged only when the frame is on the disk. */
static void handle_merged(void *user, uint64_t number, uint32_t frame_number, uint32_t tile,
	const struct pen_canvas_tile *state)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_run_frame *frame = place_of(run, frame_number);
	bool whole = pen_tiles_merged(&frame->tiles, &run->job, tile, state);

	if (pen_tile_news_add(&run->news, &frame->tiles, tile))
		pen_tile_news_flush(&run->news, &run->job, jobs->options.store);
	if (whole) {
		frame->tile_last = tile;
		sync_frame(run, frame);
	} else {
		pen_dispatch_merged(jobs->options.dispatch, number, frame_number, tile);
	}
}

/* A frame that lacks nothing any more, too, counts as decided when it is on the disk. */
static void handle_decided(void *user, uint64_t number, uint32_t frame_number)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_run_frame *frame = place_of(run, frame_number);

	if (pen_tiles_decided(&frame->tiles, &run->job, frame->canvas)) {
		frame->is_deciding = true;
		sync_frame(run, frame);
	} else {
		pen_dispatch_decided(
			jobs->options.dispatch, number, frame_number, frame->tiles.demands);
	}
}

static void handle_frames_stored(void *user, const struct pen_error *err)
{
	struct pen_change *change = user;
	struct pen_run *run = pen_run_find(change->jobs, change->number);

	/* A restart may have come in between: then these frames count for nothing. */
	if (run && err->code == 0 && change->frames_done <= run->passed &&
		change->frames_done > run->job.frames_done) {
		run->job.frames_done = change->frames_done;
		run->job.revision++;
	}
	pen_change_finish(change, NULL, err);
}

/* Makes durable how many frames are whole; what cannot be told now is told with the next. */
static void store_frames(struct pen_jobs *jobs, struct pen_run *run)
{
	struct pen_change *change = pen_change_create(jobs, &run->job, NULL, NULL);
	struct pen_job row = run->job;

	row.frames_done = run->passed;
	if (!change)
		return;
	change->frames_done = run->passed;
	if (pen_store_update_job(jobs->options.store, &row, handle_frames_stored, change, NULL) < 0)
		free(change);
}

/* Frames that are on the disk, as far as all before them are, make room for others. */
static void pass_frames(struct pen_jobs *jobs, struct pen_run *run)
{
	const uint32_t before = run->passed;
	struct pen_run_frame *frame;
	struct pen_error err;

	while (run->passed < run->job.frame_count &&
		(frame = find_frame(run, first_open(run))) != NULL && frame->synced) {
		run->job.samples_passed += frame->tiles.samples_done;
		drop_frame(frame);
		run->passed++;
	}
	if (run->passed == before)
		return;
	if (run->passed < run->job.frame_count)
		store_frames(jobs, run);
	else if (pen_run_store_state(jobs, run, PEN_JOB_DONE, NULL, NULL, NULL, &err) < 0)
		pen_run_give_up(run, &err);
}

static void handle_synced(void *user, uint64_t number, uint32_t frame_number)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_run_frame *frame = place_of(run, frame_number);
	uint32_t tile = frame->tile_last;
	bool is_opening = run->opening > 0;

	frame->synced = true;
	if (frame->is_deciding)
		pen_dispatch_decided(
			jobs->options.dispatch, number, frame_number, frame->tiles.demands);
	frame->is_deciding = false;
	frame->tile_last = NO_TILE;
	pass_frames(jobs, run);
	if (is_opening)
		go_on(jobs, run);
	else if (tile != NO_TILE)
		pen_dispatch_merged(jobs->options.dispatch, number, frame_number, tile);
}

static void handle_canvas_failed(void *user, uint64_t number, const struct pen_error *err)
{
	pen_run_give_up(pen_run_find(user, number), err);
}

static struct pen_canvas_events canvas_events(struct pen_jobs *jobs)
{
	return (struct pen_canvas_events){handle_opened, handle_merged, handle_decided,
		handle_synced, handle_canvas_failed, jobs};
}

static int open_canvas(struct pen_jobs *jobs, struct pen_run *run, struct pen_run_frame *frame,
	struct pen_error *err)
{
	const struct pen_framebuf framebuf = pen_frame_file_shape(&run->job);
	struct pen_canvas_events events = canvas_events(jobs);
	char path[PATH_MAX];
	int r;

	pen_run_path(jobs, &run->job, frame->tiles.frame, path);
	r = pen_canvas_open(jobs->loop, run->job.number, frame->tiles.frame, path, &framebuf,
		frame->tiles.states, &events, &frame->canvas, err);
	run->opening += r == 0;
	return r;
}

/* What is merged is what the frames say that have passed, and what the others will turn out to be.
 */
static void reset_counts(struct pen_run *run)
{
	struct pen_job *job = &run->job;
	const struct pen_rounds rounds = pen_sampling_rounds(&job->sampling);
	const uint64_t area = pen_rect_area(job->tiling.crop);

	job->tiles_done = (uint64_t)run->passed * job->tiling.count;
	job->units_done = job->tiles_done * pen_round_count(&rounds);
	job->samples_done = job->samples_passed;
	job->samples_spared = run->passed * area * job->sampling.samples - job->samples_passed;
}

void pen_run_begin(struct pen_jobs *jobs, struct pen_run *run)
{
	struct pen_error err;
	int r = 0;

	run->begun = true;
	run->trouble.code = 0;
	reset_counts(run);
	for (uint32_t i = 0; r == 0 && i < PEN_REEL_FRAMES_MAX; i++)
		if (run->frames[i].tiles.frame != 0)
			r = open_canvas(jobs, run, &run->frames[i], &err);
	if (r == 0 && run->passed == run->job.frame_count)
		r = pen_run_store_state(jobs, run, PEN_JOB_DONE, NULL, NULL, NULL, &err);
	else if (r == 0 && run->opening == 0)
		go_on(jobs, run);
	if (r < 0)
		pen_run_give_up(run, &err);
}

/* What the dispatch tells; none of it may call the dispatch. */

static const struct pen_job *dispatch_find(void *user, uint64_t number)
{
	return &pen_run_find(user, number)->job;
}

static void set_class(struct pen_job *shown, const char *equivalence_class)
{
	struct pen_sha256 content;

	free(shown->equivalence_class);
	shown->equivalence_class = strdup(equivalence_class);
	if (pen_content_of(&shown->scene_sha256, equivalence_class, &content, NULL) == 0)
		pen_sha256_format(&content, shown->content);
}

/* The frame's place; its framebuffer is made when its first tile comes. */
static struct pen_run_frame *begin_frame(
	struct pen_jobs *jobs, struct pen_run *run, uint32_t number, struct pen_error *err)
{
	const struct pen_framebuf framebuf = pen_frame_file_shape(&run->job);
	struct pen_canvas_events events = canvas_events(jobs);
	struct pen_run_frame *frame = pen_run_add_frame(run, number);
	char path[PATH_MAX];

	if (!frame) {
		(void)pen_error_memory(err);
		return NULL;
	}
	if (frame->canvas)
		return frame;
	pen_run_path(jobs, &run->job, number, path);
	if (pen_canvas_create(jobs->loop, run->job.number, number, path, &framebuf, &events,
		    &frame->canvas, err) < 0)
		return NULL;
	return frame;
}

static void dispatch_started(void *user, uint64_t number, const char *equivalence_class)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);

	set_class(&run->job, equivalence_class);
	run->job.state = PEN_JOB_RUNNING;
	if (run->job.started_ms == 0)
		run->job.started_ms = pen_clock_wall_ms();
	run->job.revision++;
	store_row(jobs, run);
}

static bool dispatch_mask(void *user, uint64_t number, uint32_t frame_number, uint32_t tile,
	uint32_t round, uint8_t *ret_mask)
{
	struct pen_run *run = pen_run_find(user, number);
	const struct pen_run_frame *frame = find_frame(run, frame_number);

	/* Before its first tile has come a frame has no canvas: nothing is decided yet. */
	return frame && frame->canvas && pen_canvas_mask(frame->canvas, tile, round, ret_mask);
}

static void dispatch_decide(void *user, uint64_t number, uint32_t frame_number)
{
	struct pen_run *run = pen_run_find(user, number);
	const struct pen_run_frame *frame = find_frame(run, frame_number);
	struct pen_error err;

	/* Without a canvas it has been given up. */
	if (frame && frame->canvas && pen_canvas_decide(frame->canvas, &err) < 0)
		pen_run_give_up(run, &err);
}

static void dispatch_merge(void *user, uint64_t number, uint32_t frame_number, uint32_t tile,
	uint32_t round, float *pixels)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_run_frame *frame = NULL;
	struct pen_error err;
	int r = 0;

	if (run->begun && run->trouble.code == 0) {
		frame = begin_frame(jobs, run, frame_number, &err);
		r = frame ? 0 : -1;
	}
	if (!frame)
		free(pixels);
	else
		r = pen_canvas_merge(frame->canvas, tile, round, pixels, &err);
	if (r < 0)
		pen_run_give_up(run, &err);
}

/* The same scene says the same to every worker: the first report counts. */
static void dispatch_reported(void *user, const struct pen_msg_scene_report *report)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, report->job);

	if (!run || !pen_sha256_equal(&run->job.scene_sha256, &report->scene_sha256) ||
		pen_job_is_over(run->job.state) || run->ending)
		return;
	if (report->error_count > 0 && !run->job.errors) {
		run->job.errors = pen_report_errors(report);
		run->job.revision++;
	}
	if (report->warning_count > 0 && !run->job.warnings) {
		run->job.warnings = pen_report_warnings(report);
		run->job.revision++;
		store_row(jobs, run);
	}
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
	drop_frames(run);
	run->passed = job->frames_done = 0;
	free(job->equivalence_class);
	job->equivalence_class = NULL;
	job->content[0] = '\0';
	job->units_done = job->tiles_done = 0;
	job->samples_done = job->samples_spared = job->samples_passed = 0;
	job->state = PEN_JOB_QUEUED;
	job->eta_seconds = -1;
	job->revision++;
	run->samples_at_begin = 0;
	run->running_ms = 0;
}

/* Another worker may start, from nothing, when that is stored. */
static void restart(struct pen_jobs *jobs, struct pen_run *run, const char *why)
{
	struct pen_change *change = pen_change_create(jobs, &run->job, NULL, NULL);
	struct pen_error err;
	int r;

	pen_log_of(&(struct pen_log_about){.job = run->job.id, .trace = run->job.trace},
		PEN_LOG_WARNING, "render %s: %s, it starts again", run->job.id, why);
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

static bool dispatch_text(
	void *user, const struct pen_sha256 *sha256, int *ret_fd, uint64_t *ret_size)
{
	return pen_preview_open_text(user, sha256, ret_fd, ret_size);
}

static void dispatch_ended(
	void *user, uint64_t number, enum pen_dispatch_end end, const char *reason)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = pen_run_find(jobs, number);
	struct pen_error why = PEN_ERROR_INIT, err;

	switch (end) {
	case PEN_DISPATCH_RENDERED: return; /* it is done when its frames are on the disk */
	case PEN_DISPATCH_ABANDONED: restart(jobs, run, "no worker of its class is left"); return;
	case PEN_DISPATCH_TAINTED:
		restart(jobs, run, "it has pixels of a worker whose pixels are wrong");
		return;
	case PEN_DISPATCH_FAILED: break;
	}
	pen_run_halt(run);
	(void)pen_error_set(&why, PEN_EIO, "%s", reason);
	if (pen_run_store_state(jobs, run, PEN_JOB_FAILED, &why, NULL, NULL, &err) < 0)
		pen_run_give_up(run, &err);
}

void pen_run_connect(struct pen_jobs *jobs)
{
	struct pen_dispatch_jobs calls = {dispatch_find, dispatch_started, dispatch_merge,
		dispatch_mask, dispatch_decide, dispatch_ended, dispatch_reported, dispatch_text,
		jobs};

	pen_dispatch_connect_jobs(jobs->options.dispatch, &calls);
}

/* Time passes */

/* Remaining samples over those merged a second since this coordinator began. */
static void update_eta(struct pen_run *run)
{
	struct pen_job *shown = &run->job;
	uint64_t total = pen_job_samples(shown);
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

	pen_log_of(&(struct pen_log_about){.job = run->job.id, .trace = run->job.trace},
		PEN_LOG_ERROR, "render %s is paused: %s", run->job.id, run->trouble.text);
	pen_dispatch_remove_job(jobs->options.dispatch, run->job.number);
	pen_run_halt(run);
	if (pen_run_store_state(jobs, run, PEN_JOB_PAUSED, &run->trouble, NULL, NULL, &err) < 0)
		pen_log_of(&(struct pen_log_about){.job = run->job.id, .trace = run->job.trace},
			PEN_LOG_ERROR, "render %s: %s", run->job.id, err.text);
}

void pen_run_tick(struct pen_jobs *jobs, struct pen_run *run)
{
	if (run->ending)
		return;
	if (run->news.count > 0 && pen_clock_ms() - run->news.since_ms >= NEWS_MS)
		pen_tile_news_flush(&run->news, &run->job, jobs->options.store);
	update_eta(run);
	if (run->trouble.code < 0 && run->job.state != PEN_JOB_PAUSED)
		pause_troubled(jobs, run);
}
