/* SPDX-License-Identifier: Apache-2.0 */
#include "server/job.h"

#include "core/base/clock.h"
#include "core/base/log.h"
#include "server/accept.h"
#include "server/canvas.h"
#include "server/dispatch.h"
#include "server/job_table.h"
#include "server/plan.h"
#include "server/store.h"
#include "server/tiles.h"

#include <assert.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/queue.h>
#include <unistd.h>

enum { TICK_MS = 250, NEWS_MS = 1000 };

static const char *const state_names[] = {
	"queued", "running", "paused", "done", "failed", "cancelled"};

struct job {
	struct pen_job shown; /* first, so that a pen_job is a job */
	LIST_ENTRY(job) unfinished;

	/* Of an unfinished one. */
	struct pen_canvas *canvas;
	struct pen_tiles tiles;
	int64_t running_ms; /* spent rendering since this coordinator began it */
	uint64_t samples_at_begin;
	bool begun;		  /* the dispatch or the canvas is at work on it */
	bool ending;		  /* its last state, or its removal, is on its way to the store */
	struct pen_error trouble; /* code < 0: it cannot go on and will be paused */
};

struct pen_jobs {
	uv_timer_t timer;
	uv_loop_t *loop;
	struct pen_jobs_options options;
	struct pen_job_table table;
	LIST_HEAD(, job) unfinished;
	uint32_t unfinished_count; /* those that are being accepted, too */
	uint64_t number_last;
	bool closed;
	bool broken;
};

/* A change that waits to be durable. */
struct change {
	struct pen_jobs *jobs;
	uint64_t number;
	struct job *accepted; /* not in the table yet */
	enum pen_job_state state;
	int64_t finished_ms;
	struct pen_error error;
	pen_job_fn *fn; /* may be NULL */
	void *user;
};

const char *pen_job_state_name(enum pen_job_state state)
{
	return state_names[state];
}

bool pen_job_state_parse(const char *name, enum pen_job_state *ret_state)
{
	for (size_t i = 0; i < sizeof state_names / sizeof *state_names; i++) {
		if (strcmp(name, state_names[i]) != 0)
			continue;
		*ret_state = (enum pen_job_state)i;
		return true;
	}
	return false;
}

static bool is_over(enum pen_job_state state)
{
	return state >= PEN_JOB_DONE;
}

static struct job *find_number(const struct pen_jobs *jobs, uint64_t number)
{
	return (struct job *)pen_job_table_find_number(&jobs->table, number);
}

static void job_destroy(struct job *job)
{
	if (!job)
		return;
	pen_canvas_destroy(job->canvas);
	pen_tiles_finish(&job->tiles);
	free(job->shown.name);
	free(job->shown.equivalence_class);
	free(job);
}

static void drop_canvas(struct job *job)
{
	pen_canvas_destroy(job->canvas);
	job->canvas = NULL;
	job->begun = false;
}

/* The job is over, or going: it needs no more than what is shown of it. */
static void retire(struct pen_jobs *jobs, struct job *job)
{
	drop_canvas(job);
	pen_tiles_finish(&job->tiles);
	LIST_REMOVE(job, unfinished);
	jobs->unfinished_count--;
}

static void format_frame_path(const struct pen_jobs *jobs, const char *id, char *ret_path)
{
	(void)snprintf(ret_path, PATH_MAX, "%s/frames/%s.f32", jobs->options.data_dir, id);
}

/* Durable changes */

static struct change *change_create(
	struct pen_jobs *jobs, const struct pen_job *job, pen_job_fn *fn, void *user)
{
	struct change *change = calloc(1, sizeof *change);

	if (change)
		*change = (struct change){
			.jobs = jobs, .number = job->number, .fn = fn, .user = user};
	return change;
}

/* Tells the one who asked for it, and whether the store can still be trusted. */
static void change_finish(struct change *change, struct pen_job *job, const struct pen_error *err)
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

static void give_up(struct job *job, const struct pen_error *err)
{
	if (job->trouble.code == 0)
		job->trouble = *err;
}

static void show_end(struct pen_jobs *jobs, struct job *job, const struct change *change)
{
	job->shown.state = change->state;
	job->shown.error = change->error;
	job->shown.finished_ms = change->finished_ms;
	job->shown.eta_seconds = -1;
	job->shown.revision++;
	retire(jobs, job);
	pen_log(PEN_LOG_INFO, "render %s: %s%s%s", job->shown.id, pen_job_state_name(change->state),
		change->error.text[0] ? ": " : "", change->error.text);
}

static void handle_state_stored(void *user, const struct pen_error *err)
{
	struct change *change = user;
	struct pen_jobs *jobs = change->jobs;
	struct job *job = find_number(jobs, change->number);

	if (!job) {
		static const struct pen_error gone = {PEN_ENOTFOUND, "the render was removed"};

		change_finish(change, NULL, err->code == 0 ? &gone : err);
		return;
	}
	if (is_over(change->state) && err->code == 0) {
		show_end(jobs, job, change);
	} else if (is_over(change->state)) {
		job->ending = false;
		give_up(job, err);
	}
	change_finish(change, &job->shown, err);
}

/*
 * Makes a state durable and tells fn. The end of a job is shown no earlier than that; any other
 * state at once.
 */
static int store_state(struct pen_jobs *jobs, struct job *job, enum pen_job_state state,
	const struct pen_error *reason, pen_job_fn *fn, void *user, struct pen_error *err)
{
	struct change *change = change_create(jobs, &job->shown, fn, user);
	struct pen_job row = job->shown;
	int r;

	if (!change)
		return pen_error_memory(err);
	row.state = change->state = state;
	row.error = change->error = reason ? *reason : (struct pen_error)PEN_ERROR_INIT;
	row.finished_ms = change->finished_ms = is_over(state) ? pen_clock_wall_ms() : 0;
	r = pen_store_update_job(jobs->options.store, &row, handle_state_stored, change, err);
	if (r < 0) {
		free(change);
		return r;
	}
	job->ending = is_over(state);
	if (!job->ending) {
		job->shown.state = state;
		job->shown.error = row.error;
		job->shown.revision++;
	}
	return 0;
}

/* What nobody waits for. */
static void store_row(struct pen_jobs *jobs, const struct job *job)
{
	struct pen_error err = PEN_ERROR_INIT;

	if (pen_store_update_job(jobs->options.store, &job->shown, NULL, NULL, &err) < 0)
		pen_log(PEN_LOG_WARNING, "render %s: %s", job->shown.id, err.text);
}

/* Rendering */

static void sync_canvas(struct job *job)
{
	struct pen_error err;

	if (!job->canvas || pen_canvas_sync(job->canvas, &err) < 0)
		give_up(job, job->canvas ? &err : &job->trouble);
}

/* Gives the job to the dispatch, with what is rendered already. */
static int dispatch_job(struct pen_jobs *jobs, struct job *job, struct pen_error *err)
{
	struct pen_sched_job added = {
		.number = job->shown.number,
		.tiling = &job->shown.tiling,
		.samples = job->shown.samples,
		.priority = job->shown.priority,
		.paused = job->shown.state == PEN_JOB_PAUSED,
		.equivalence_class = job->shown.equivalence_class,
	};
	uint16_t *rounds = calloc(job->shown.tiling.count, sizeof *rounds);
	int r;

	if (!rounds)
		return pen_error_memory(err);
	for (uint32_t i = 0; job->tiles.states && i < job->shown.tiling.count; i++)
		rounds[i] = job->tiles.states[i].rounds;
	added.rounds = rounds;
	r = pen_dispatch_add_job(jobs->options.dispatch, &added, err);
	free(rounds);
	return r;
}

static void handle_opened(void *user, uint64_t number, const struct pen_canvas_tile *states)
{
	struct pen_jobs *jobs = user;
	struct job *job = find_number(jobs, number);
	struct pen_error err;

	pen_tiles_load(&job->tiles, &job->shown, states);
	job->samples_at_begin = job->shown.samples_done;
	if (job->shown.units_done == job->shown.units_total)
		sync_canvas(job);
	else if (dispatch_job(jobs, job, &err) < 0)
		give_up(job, &err);
}

static void handle_merged(void *user, uint64_t number, uint32_t tile, uint64_t xxh3)
{
	struct pen_jobs *jobs = user;
	struct job *job = find_number(jobs, number);

	if (pen_tiles_merged(&job->tiles, &job->shown, tile, xxh3))
		pen_tiles_flush(&job->tiles, &job->shown, jobs->options.store);
	pen_dispatch_merged(jobs->options.dispatch, number, tile);
}

static void handle_synced(void *user, uint64_t number)
{
	struct pen_jobs *jobs = user;
	struct job *job = find_number(jobs, number);
	struct pen_error err;

	if (store_state(jobs, job, PEN_JOB_DONE, NULL, NULL, NULL, &err) < 0)
		give_up(job, &err);
}

static void handle_canvas_failed(void *user, uint64_t number, const struct pen_error *err)
{
	give_up(find_number(user, number), err);
}

static struct pen_canvas_events canvas_events(struct pen_jobs *jobs)
{
	return (struct pen_canvas_events){
		handle_opened, handle_merged, handle_synced, handle_canvas_failed, jobs};
}

/* Goes on with an unfinished job that nobody is at work on. */
static void begin(struct pen_jobs *jobs, struct job *job)
{
	struct pen_canvas_events events = canvas_events(jobs);
	char path[PATH_MAX];
	struct pen_error err;
	int r;

	job->begun = true;
	job->trouble.code = 0;
	if (job->tiles.states) {
		format_frame_path(jobs, job->shown.id, path);
		r = pen_canvas_open(jobs->loop, job->shown.number, path, &job->shown.tiling,
			job->tiles.states, &events, &job->canvas, &err);
	} else {
		r = dispatch_job(jobs, job, &err);
	}
	if (r < 0)
		give_up(job, &err);
}

/* What the dispatch tells; none of it may call the dispatch. */

static const struct pen_job *dispatch_find(void *user, uint64_t number)
{
	return &find_number(user, number)->shown;
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

static int create_canvas(struct pen_jobs *jobs, struct job *job, struct pen_error *err)
{
	struct pen_canvas_events events = canvas_events(jobs);
	char path[PATH_MAX];
	int r = pen_tiles_init(&job->tiles, &job->shown, err);

	if (r < 0)
		return r;
	format_frame_path(jobs, job->shown.id, path);
	return pen_canvas_create(jobs->loop, job->shown.number, path, &job->shown.tiling, &events,
		&job->canvas, err);
}

static void dispatch_started(void *user, uint64_t number, const char *equivalence_class)
{
	struct pen_jobs *jobs = user;
	struct job *job = find_number(jobs, number);
	struct pen_error err;

	set_class(&job->shown, equivalence_class);
	job->shown.state = PEN_JOB_RUNNING;
	if (job->shown.started_ms == 0)
		job->shown.started_ms = pen_clock_wall_ms();
	job->shown.revision++;
	store_row(jobs, job);
	if (!job->canvas && create_canvas(jobs, job, &err) < 0)
		give_up(job, &err);
}

static void dispatch_merge(
	void *user, uint64_t number, uint32_t tile, uint32_t round, float *pixels)
{
	struct job *job = find_number(user, number);
	struct pen_error err;

	if (!job->canvas || job->trouble.code < 0)
		free(pixels);
	else if (pen_canvas_merge(job->canvas, tile, round, pixels, &err) < 0)
		give_up(job, &err);
}

static void handle_reset(void *user, const struct pen_error *err)
{
	struct change *change = user;
	struct job *job = find_number(change->jobs, change->number);

	if (job && !job->ending) {
		if (err->code == 0)
			begin(change->jobs, job);
		else
			give_up(job, err);
	}
	change_finish(change, job ? &job->shown : NULL, err);
}

/* Its class has gone: everything rendered is forgotten, and another class may start. */
static void restart(struct pen_jobs *jobs, struct job *job)
{
	struct change *change = change_create(jobs, &job->shown, NULL, NULL);
	struct pen_error err = PEN_ERROR_INIT;

	drop_canvas(job);
	pen_tiles_finish(&job->tiles);
	free(job->shown.equivalence_class);
	job->shown.equivalence_class = NULL;
	job->shown.content[0] = '\0';
	job->shown.units_done = job->shown.samples_done = job->shown.tiles_done = 0;
	job->samples_at_begin = 0;
	job->running_ms = 0;
	job->shown.state = PEN_JOB_QUEUED;
	job->shown.restarts++;
	job->shown.revision++;
	job->begun = true; /* until the reset is stored */
	pen_log(PEN_LOG_WARNING, "render %s: no worker of its class is left, it starts again",
		job->shown.id);
	if (!change || pen_store_update_job(
			       jobs->options.store, &job->shown, handle_reset, change, &err) < 0) {
		free(change);
		(void)pen_error_memory(&err);
		give_up(job, &err);
	}
}

static void dispatch_ended(
	void *user, uint64_t number, enum pen_dispatch_end end, const char *reason)
{
	struct pen_jobs *jobs = user;
	struct job *job = find_number(jobs, number);
	struct pen_error why = PEN_ERROR_INIT, err;

	switch (end) {
	case PEN_DISPATCH_RENDERED: sync_canvas(job); return;
	case PEN_DISPATCH_ABANDONED: restart(jobs, job); return;
	case PEN_DISPATCH_FAILED: break;
	}
	drop_canvas(job);
	(void)pen_error_set(&why, PEN_EIO, "%s", reason);
	if (store_state(jobs, job, PEN_JOB_FAILED, &why, NULL, NULL, &err) < 0)
		give_up(job, &err);
}

/* Asking */

static uint32_t choose_tile_px(const struct pen_jobs *jobs, struct pen_rect crop)
{
	uint32_t processes = pen_dispatch_processes(jobs->options.dispatch);

	if (jobs->options.tile_px != 0)
		return jobs->options.tile_px;
	if (processes < jobs->options.processes)
		processes = jobs->options.processes;
	return pen_plan_tile_px(crop, processes);
}

static int check_admission(
	const struct pen_jobs *jobs, const struct pen_scene *scene, struct pen_error *err)
{
	if (jobs->closed)
		return pen_error_set(err, PEN_ECLOSED, "the server is stopping");
	if (jobs->unfinished_count >= PEN_JOBS_QUEUED_MAX)
		return pen_error_set(err, PEN_ELIMIT, "%u renders wait already; try again later",
			PEN_JOBS_QUEUED_MAX);
	return pen_accept_check_disk(jobs->options.data_dir, scene, err);
}

static int job_create(struct pen_jobs *jobs, const struct pen_submission *submission,
	struct job **ret_job, struct pen_error *err)
{
	uint32_t tile_px = choose_tile_px(jobs, submission->scene->image.crop);
	struct job *job = calloc(1, sizeof *job);
	int r;

	if (!job)
		return pen_error_memory(err);
	r = pen_accept_fill(submission, tile_px, &job->shown, err);
	if (r < 0) {
		free(job);
		return r;
	}
	job->shown.number = ++jobs->number_last;
	job->shown.priority = submission->priority;
	*ret_job = job;
	return 0;
}

static void handle_accepted(void *user, const struct pen_error *err)
{
	struct change *change = user;
	struct pen_jobs *jobs = change->jobs;
	struct job *job = change->accepted;
	struct pen_error result = *err;

	if (err->code == 0)
		(void)pen_job_table_add(&jobs->table, &job->shown, &result);
	if (result.code == 0) {
		LIST_INSERT_HEAD(&jobs->unfinished, job, unfinished);
		begin(jobs, job);
	} else {
		jobs->unfinished_count--;
		job_destroy(job);
		job = NULL;
	}
	change_finish(change, job ? &job->shown : NULL, &result);
}

int pen_jobs_submit(struct pen_jobs *jobs, struct pen_submission *submission, pen_job_fn *fn,
	void *user, struct pen_error *err)
{
	char *canonical = submission->canonical;
	struct change *change = NULL;
	struct job *job = NULL;
	int r = check_admission(jobs, submission->scene, err);

	if (r == 0)
		r = job_create(jobs, submission, &job, err);
	pen_scene_destroy(submission->scene);
	if (r == 0) {
		change = change_create(jobs, &job->shown, fn, user);
		r = change ? 0 : pen_error_memory(err);
	}
	if (r < 0 || !change) {
		free(canonical);
		job_destroy(job);
		return r;
	}
	change->accepted = job;
	r = pen_store_add_job(jobs->options.store, &job->shown, canonical,
		submission->canonical_size, handle_accepted, change, err);
	if (r < 0) {
		free(change);
		job_destroy(job);
		return r;
	}
	jobs->unfinished_count++;
	return 0;
}

/* What cannot be changed at all. */
static int check_change(const struct pen_jobs *jobs, const struct job *job, struct pen_error *err)
{
	if (jobs->closed)
		return pen_error_set(err, PEN_ECLOSED, "the server is stopping");
	if (is_over(job->shown.state) || job->ending)
		return pen_error_set(err, PEN_ECONFLICT, "the render is over");
	return 0;
}

int pen_jobs_set_state(struct pen_jobs *jobs, struct pen_job *shown, enum pen_job_state state,
	pen_job_fn *fn, void *user, struct pen_error *err)
{
	struct job *job = (struct job *)shown;
	struct pen_dispatch *dispatch = jobs->options.dispatch;
	int r = check_change(jobs, job, err);

	if (r < 0)
		return r;
	if (state == PEN_JOB_RUNNING && (shown->started_ms == 0 || !shown->equivalence_class))
		state = PEN_JOB_QUEUED;
	r = store_state(jobs, job, state, NULL, fn, user, err);
	if (r < 0)
		return r;
	switch (state) {
	case PEN_JOB_CANCELLED:
		pen_dispatch_remove_job(dispatch, shown->number);
		drop_canvas(job);
		break;
	case PEN_JOB_PAUSED: pen_dispatch_pause_job(dispatch, shown->number); break;
	default:
		if (job->begun)
			pen_dispatch_resume_job(dispatch, shown->number);
		else
			begin(jobs, job);
		break;
	}
	return 0;
}

int pen_jobs_set_priority(struct pen_jobs *jobs, struct pen_job *shown, uint32_t priority,
	pen_job_fn *fn, void *user, struct pen_error *err)
{
	struct job *job = (struct job *)shown;
	int r = check_change(jobs, job, err);

	if (r < 0)
		return r;
	shown->priority = priority;
	pen_dispatch_set_priority(jobs->options.dispatch, shown->number, priority);
	return store_state(jobs, job, shown->state, &shown->error, fn, user, err);
}

static void handle_removed(void *user, const struct pen_error *err)
{
	struct change *change = user;
	struct pen_jobs *jobs = change->jobs;
	struct job *job = find_number(jobs, change->number);
	char path[PATH_MAX];

	assert(job);
	if (err->code == 0) {
		format_frame_path(jobs, job->shown.id, path);
		(void)unlink(path);
		if (!is_over(job->shown.state))
			retire(jobs, job);
		pen_job_table_remove(&jobs->table, &job->shown);
		job_destroy(job);
	} else {
		job->ending = false;
		give_up(job, err);
	}
	change_finish(change, NULL, err);
}

int pen_jobs_delete(struct pen_jobs *jobs, struct pen_job *shown, pen_job_fn *fn, void *user,
	struct pen_error *err)
{
	struct job *job = (struct job *)shown;
	struct change *change;
	int r;

	if (jobs->closed)
		return pen_error_set(err, PEN_ECLOSED, "the server is stopping");
	if (job->ending)
		return pen_error_set(err, PEN_ECONFLICT, "the render is just ending; try again");
	change = change_create(jobs, shown, fn, user);
	if (!change)
		return pen_error_memory(err);
	r = pen_store_remove_job(jobs->options.store, shown, handle_removed, change, err);
	if (r < 0) {
		free(change);
		return r;
	}
	job->ending = true;
	pen_dispatch_remove_job(jobs->options.dispatch, shown->number);
	drop_canvas(job);
	return 0;
}

struct pen_job *pen_jobs_find(struct pen_jobs *jobs, const char *id, bool *ret_removed)
{
	bool removed;
	struct pen_job *job = pen_job_table_find(&jobs->table, id, &removed);

	if (ret_removed)
		*ret_removed = removed;
	return job;
}

struct pen_job *pen_jobs_older(struct pen_jobs *jobs, uint64_t before)
{
	return pen_job_table_older(&jobs->table, before);
}

int pen_jobs_open_image(
	struct pen_jobs *jobs, const struct pen_job *job, int *ret_fd, struct pen_error *err)
{
	char path[PATH_MAX];
	int fd;

	if (job->units_done == 0)
		return pen_error_set(err, PEN_ENOTFOUND, "nothing is rendered yet");
	format_frame_path(jobs, job->id, path);
	fd = open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0)
		return pen_error_system(err, errno, "cannot open the framebuffer");
	*ret_fd = fd;
	return 0;
}

/* Time passes */

/* Remaining samples over those merged a second since this coordinator began. */
static void update_eta(struct job *job)
{
	struct pen_job *shown = &job->shown;
	uint64_t total = pen_rect_area(shown->tiling.crop) * shown->samples;
	uint64_t merged = shown->samples_done - job->samples_at_begin;

	if (shown->state != PEN_JOB_RUNNING)
		return;
	job->running_ms += TICK_MS;
	if (merged == 0)
		return;
	shown->eta_seconds = 1e-3 * (double)job->running_ms *
			     (double)(total - shown->samples_done) / (double)merged;
	shown->revision++;
}

static void pause_troubled(struct pen_jobs *jobs, struct job *job)
{
	struct pen_error err;

	pen_log(PEN_LOG_ERROR, "render %s is paused: %s", job->shown.id, job->trouble.text);
	pen_dispatch_remove_job(jobs->options.dispatch, job->shown.number);
	drop_canvas(job);
	if (store_state(jobs, job, PEN_JOB_PAUSED, &job->trouble, NULL, NULL, &err) < 0)
		pen_log(PEN_LOG_ERROR, "render %s: %s", job->shown.id, err.text);
}

static void handle_tick(uv_timer_t *timer)
{
	struct pen_jobs *jobs = timer->data;
	int64_t now_ms = pen_clock_ms();
	struct job *job;

	LIST_FOREACH(job, &jobs->unfinished, unfinished)
	{
		if (job->ending)
			continue;
		if (job->tiles.news_count > 0 && now_ms - job->tiles.news_ms >= NEWS_MS)
			pen_tiles_flush(&job->tiles, &job->shown, jobs->options.store);
		update_eta(job);
		if (job->trouble.code < 0 && job->shown.state != PEN_JOB_PAUSED)
			pause_troubled(jobs, job);
	}
}

/* Beginning and end */

static int load_job(void *user, const struct pen_job *stored, struct pen_error *err)
{
	struct pen_jobs *jobs = user;
	struct job *job = calloc(1, sizeof *job);
	int r = 0;

	if (!job)
		return pen_error_memory(err);
	job->shown = *stored;
	job->shown.name = stored->name ? strdup(stored->name) : NULL;
	job->shown.equivalence_class =
		stored->equivalence_class ? strdup(stored->equivalence_class) : NULL;
	job->shown.eta_seconds = -1;
	/* Above whatever an earlier coordinator may have told. */
	job->shown.revision = (uint64_t)pen_clock_wall_ms();
	if ((stored->name && !job->shown.name) ||
		(stored->equivalence_class && !job->shown.equivalence_class))
		r = pen_error_memory(err);
	if (r == 0)
		r = pen_job_table_add(&jobs->table, &job->shown, err);
	if (r < 0) {
		job_destroy(job);
		return r;
	}
	jobs->number_last = job->shown.number;
	if (!is_over(job->shown.state)) {
		LIST_INSERT_HEAD(&jobs->unfinished, job, unfinished);
		jobs->unfinished_count++;
	}
	return 0;
}

static int load_tile(
	void *user, uint64_t number, const struct pen_store_tile *tile, struct pen_error *err)
{
	struct job *job = find_number(user, number);
	int r = job->tiles.states ? 0 : pen_tiles_init(&job->tiles, &job->shown, err);

	if (r == 0)
		job->tiles.states[tile->tile] = tile->state;
	return r;
}

static int load_removed(void *user, const char *id, struct pen_error *err)
{
	struct pen_jobs *jobs = user;

	return pen_job_table_add_removed(&jobs->table, id, err);
}

/* Framebuffers whose job is not there any more: a crash came between the two. */
static void sweep_frames(struct pen_jobs *jobs)
{
	char path[PATH_MAX], id[PEN_JOB_ID_TEXT] = "";
	const struct dirent *entry;
	DIR *frames;

	(void)snprintf(path, sizeof path, "%s/frames", jobs->options.data_dir);
	frames = opendir(path);
	while (frames && (entry = readdir(frames)) != NULL) {
		if (entry->d_name[0] == '.')
			continue;
		(void)snprintf(id, sizeof id, "%.*s", PEN_JOB_ID_TEXT - 1, entry->d_name);
		if (!pen_jobs_find(jobs, id, NULL))
			(void)unlinkat(dirfd(frames), entry->d_name, 0);
	}
	if (frames)
		(void)closedir(frames);
}

int pen_jobs_create(uv_loop_t *loop, const struct pen_jobs_options *options,
	struct pen_jobs **ret_jobs, struct pen_error *err)
{
	struct pen_jobs *jobs = calloc(1, sizeof *jobs);
	struct pen_store_visitor visitor = {load_job, load_tile, load_removed, jobs};
	struct pen_dispatch_jobs calls = {
		dispatch_find, dispatch_started, dispatch_merge, dispatch_ended, jobs};
	struct job *job;
	int r;

	if (!jobs)
		return pen_error_memory(err);
	jobs->loop = loop;
	jobs->options = *options;
	pen_job_table_init(&jobs->table);
	LIST_INIT(&jobs->unfinished);
	(void)uv_timer_init(loop, &jobs->timer);
	jobs->timer.data = jobs;
	r = pen_store_load(options->store, &visitor, err);
	if (r < 0) {
		pen_jobs_destroy(jobs);
		return r;
	}
	sweep_frames(jobs);
	pen_dispatch_connect_jobs(options->dispatch, &calls);
	LIST_FOREACH(job, &jobs->unfinished, unfinished)
	begin(jobs, job);
	(void)uv_timer_start(&jobs->timer, handle_tick, TICK_MS, TICK_MS);
	*ret_jobs = jobs;
	return 0;
}

void pen_jobs_close(struct pen_jobs *jobs)
{
	struct job *job;

	jobs->closed = true;
	(void)uv_timer_stop(&jobs->timer);
	LIST_FOREACH(job, &jobs->unfinished, unfinished)
	{
		if (!job->ending)
			pen_tiles_flush(&job->tiles, &job->shown, jobs->options.store);
		drop_canvas(job);
	}
}

static void handle_closed(uv_handle_t *handle)
{
	struct pen_jobs *jobs = handle->data;

	for (size_t i = 0; i < jobs->table.count; i++)
		job_destroy((struct job *)jobs->table.jobs[i]);
	pen_job_table_finish(&jobs->table);
	free(jobs);
}

void pen_jobs_destroy(struct pen_jobs *jobs)
{
	if (jobs)
		uv_close((uv_handle_t *)&jobs->timer, handle_closed);
}
