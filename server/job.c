/* SPDX-License-Identifier: Apache-2.0 */
#include "server/job.h"

#include "core/base/clock.h"
#include "core/base/log.h"
#include "server/accept.h"
#include "server/allowance.h"
#include "server/job_texts.h"
#include "server/plan.h"
#include "server/preview.h"
#include "server/run.h"
#include "server/run_index.h"
#include "server/store.h"
#include "server/upkeep.h"

#include <assert.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const state_names[] = {
	"queued", "running", "paused", "done", "failed", "cancelled"};

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

static uint32_t choose_tile_px(const struct pen_jobs *jobs, const struct pen_scene *scene)
{
	uint32_t processes = pen_dispatch_processes(jobs->options.dispatch);

	if (jobs->options.tile_px != 0)
		return jobs->options.tile_px;
	if (processes < jobs->options.processes)
		processes = jobs->options.processes;
	return pen_plan_tile_px(scene->image.crop, scene->sampling.samples,
		scene->frames.last - scene->frames.first + 1, processes);
}

static int check_admission(
	const struct pen_jobs *jobs, struct pen_submission *submission, struct pen_error *err)
{
	int r;

	if (jobs->closed)
		return pen_error_set(err, PEN_ECLOSED, "the server is stopping");
	r = pen_allowance_check(jobs, submission, err);
	return r == 0 ? pen_accept_check_disk(jobs->options.data_dir, submission->scene, err) : r;
}

static int run_create(struct pen_jobs *jobs, const struct pen_submission *submission,
	struct pen_run **ret_run, struct pen_error *err)
{
	uint32_t tile_px = choose_tile_px(jobs, submission->scene);
	struct pen_run *run = calloc(1, sizeof *run);
	int r;

	if (!run)
		return pen_error_memory(err);
	r = pen_accept_fill(submission, tile_px, &run->job, err);
	if (r < 0) {
		free(run);
		return r;
	}
	run->text = -1;
	run->job.number = ++jobs->number_last;
	run->job.priority = submission->priority;
	*ret_run = run;
	return 0;
}

static void handle_accepted(void *user, const struct pen_error *err)
{
	struct pen_change *change = user;
	struct pen_jobs *jobs = change->jobs;
	struct pen_run *run = change->accepted;
	struct pen_error result = *err;

	TAILQ_REMOVE(&jobs->accepting, run, unfinished);
	if (err->code == 0)
		(void)pen_job_table_add(&jobs->table, &run->job, &result);
	if (result.code == 0) {
		TAILQ_INSERT_TAIL(&jobs->unfinished, run, unfinished);
		pen_run_begin(jobs, run);
	} else {
		jobs->unfinished_count--;
		pen_run_unindex(jobs, run);
		pen_run_destroy(run);
		run = NULL;
	}
	pen_change_finish(change, run ? &run->job : NULL, &result);
}

void pen_jobs_replace(struct pen_jobs *jobs, const char *id)
{
	struct pen_job *job = pen_jobs_find(jobs, id);
	struct pen_error err;

	if (job && !pen_job_is_over(job->state) &&
		pen_jobs_set_state(jobs, job, PEN_JOB_CANCELLED, NULL, NULL, &err) < 0)
		pen_log_of(&(struct pen_log_about){.job = id, .trace = job->trace}, PEN_LOG_INFO,
			"render %s: %s", id, err.text);
}

int pen_jobs_submit(struct pen_jobs *jobs, struct pen_submission *submission, pen_job_fn *fn,
	void *user, struct pen_error *err)
{
	char *canonical = submission->canonical;
	struct pen_change *change = NULL;
	struct pen_run *run = NULL;
	int r = check_admission(jobs, submission, err);

	if (r == 0)
		r = run_create(jobs, submission, &run, err);
	pen_scene_destroy(submission->scene);
	if (r == 0) {
		change = pen_change_create(jobs, &run->job, fn, user);
		r = change ? 0 : pen_error_memory(err);
	}
	if (r < 0 || !change) {
		free(canonical);
		pen_run_destroy(run);
		return r;
	}
	change->accepted = run;
	if (run->job.is_preview) {
		r = pen_preview_keep_text(run, canonical, submission->canonical_size, err);
		canonical = NULL;
	}
	if (r == 0)
		r = pen_store_add_job(jobs->options.store, &run->job, canonical,
			submission->canonical_size, handle_accepted, change, err);
	if (r < 0) {
		free(change);
		pen_run_destroy(run);
		return r;
	}
	TAILQ_INSERT_TAIL(&jobs->accepting, run, unfinished);
	jobs->unfinished_count++;
	pen_run_index(jobs, run);
	if (submission->replaces[0])
		pen_jobs_replace(jobs, submission->replaces);
	return 0;
}

/* What cannot be changed at all. */
static int check_change(
	const struct pen_jobs *jobs, const struct pen_run *run, struct pen_error *err)
{
	if (jobs->closed)
		return pen_error_set(err, PEN_ECLOSED, "the server is stopping");
	if (pen_job_is_over(run->job.state) || run->ending)
		return pen_error_set(err, PEN_ECONFLICT, "the render is over");
	return 0;
}

int pen_jobs_set_state(struct pen_jobs *jobs, struct pen_job *job, enum pen_job_state state,
	pen_job_fn *fn, void *user, struct pen_error *err)
{
	struct pen_run *run = (struct pen_run *)job;
	struct pen_dispatch *dispatch = jobs->options.dispatch;
	int r = check_change(jobs, run, err);

	if (r < 0)
		return r;
	if (state == PEN_JOB_RUNNING && (job->started_ms == 0 || !job->equivalence_class))
		state = PEN_JOB_QUEUED;
	r = pen_run_store_state(jobs, run, state, NULL, fn, user, err);
	if (r < 0)
		return r;
	switch (state) {
	case PEN_JOB_CANCELLED:
		pen_dispatch_remove_job(dispatch, job->number);
		pen_run_halt(run);
		break;
	case PEN_JOB_PAUSED: pen_dispatch_pause_job(dispatch, job->number); break;
	default:
		if (run->begun)
			pen_dispatch_resume_job(dispatch, job->number);
		else
			pen_run_begin(jobs, run);
		break;
	}
	return 0;
}

int pen_jobs_set_priority(struct pen_jobs *jobs, struct pen_job *job, uint32_t priority,
	pen_job_fn *fn, void *user, struct pen_error *err)
{
	struct pen_run *run = (struct pen_run *)job;
	int r = check_change(jobs, run, err);

	if (r < 0)
		return r;
	job->priority = priority;
	pen_dispatch_set_priority(jobs->options.dispatch, job->number, priority);
	return pen_run_store_state(jobs, run, job->state, &job->error, fn, user, err);
}

static void handle_removed(void *user, const struct pen_error *err)
{
	struct pen_change *change = user;
	struct pen_jobs *jobs = change->jobs;
	struct pen_run *run = pen_run_find(jobs, change->number);

	assert(run);
	if (err->code == 0) {
		pen_run_unlink(jobs, &run->job);
		if (!pen_job_is_over(run->job.state))
			pen_run_retire(jobs, run);
		else if (run->job.is_preview)
			pen_preview_leaves(jobs, run);
		pen_run_unindex(jobs, run);
		pen_job_table_remove(&jobs->table, &run->job);
		pen_run_destroy(run);
	} else {
		run->ending = false;
		pen_run_give_up(run, err);
	}
	pen_change_finish(change, NULL, err);
}

int pen_jobs_delete(struct pen_jobs *jobs, struct pen_job *job, pen_job_fn *fn, void *user,
	struct pen_error *err)
{
	struct pen_run *run = (struct pen_run *)job;
	struct pen_change *change;
	int r;

	if (jobs->closed)
		return pen_error_set(err, PEN_ECLOSED, "the server is stopping");
	if (run->ending)
		return pen_error_set(err, PEN_ECONFLICT, "the render is just ending; try again");
	change = pen_change_create(jobs, job, fn, user);
	if (!change)
		return pen_error_memory(err);
	r = pen_store_remove_job(jobs->options.store, job, handle_removed, change, err);
	if (r < 0) {
		free(change);
		return r;
	}
	run->ending = true;
	pen_dispatch_remove_job(jobs->options.dispatch, job->number);
	pen_run_halt(run);
	return 0;
}

void pen_jobs_listen(struct pen_jobs *jobs, void (*fn)(void *user), void *user)
{
	jobs->heard = fn;
	jobs->listener = user;
}

struct pen_job *pen_jobs_find(struct pen_jobs *jobs, const char *id)
{
	return pen_job_table_find(&jobs->table, id);
}

const struct pen_owner *pen_jobs_find_removed(struct pen_jobs *jobs, const char *id)
{
	return pen_job_table_find_removed(&jobs->table, id);
}

int pen_jobs_find_key(struct pen_jobs *jobs, const struct pen_sha256 *key, struct pen_job **ret_job,
	struct pen_error *err)
{
	struct pen_job *job = pen_job_index_find(&jobs->keys, key);

	if (!job)
		return pen_error_set(err, PEN_ENOTFOUND, "nothing was asked for with this key");
	if (!pen_job_table_find_number(&jobs->table, job->number))
		return pen_error_set(
			err, PEN_EAGAIN, "what was asked for with this key is just being accepted");
	*ret_job = job;
	return 0;
}

struct pen_job *pen_jobs_find_content(
	struct pen_jobs *jobs, const struct pen_owner *owner, const struct pen_sha256 *content)
{
	struct pen_sha256 mixed;

	if (pen_owner_mix(owner, content, &mixed, NULL) < 0)
		return NULL;
	return pen_job_index_find(&jobs->contents, &mixed);
}

struct pen_job *pen_jobs_older(struct pen_jobs *jobs, uint64_t before)
{
	return pen_job_table_older(&jobs->table, before);
}

static const struct pen_tiles *find_tiles(const struct pen_job *job, uint32_t number)
{
	const struct pen_run *run = (const struct pen_run *)job;
	const struct pen_tiles *tiles = &run->frames[number % PEN_REEL_FRAMES_MAX].tiles;

	return tiles->frame == number ? tiles : NULL;
}

struct pen_job_frame pen_jobs_frame(const struct pen_job *job, uint32_t number)
{
	const struct pen_run *run = (const struct pen_run *)job;
	const struct pen_tiles *tiles = find_tiles(job, number);
	struct pen_job_frame frame = {.number = number};

	assert(number - job->frame_first < job->frame_count);
	if (job->frame_count == 1)
		return (struct pen_job_frame){number, job->state == PEN_JOB_DONE,
			(double)job->samples_done / (double)pen_job_samples(job),
			job->image_revision};
	frame.done = number - job->frame_first < job->frames_done;
	if (frame.done)
		frame.revision = 1ull + job->restarts;
	else if (tiles && tiles->units_done > 0)
		frame.revision = tiles->revision;
	else if (pen_job_is_over(job->state) || number - job->frame_first < run->passed)
		frame.revision = job->image_revision;
	if (number - job->frame_first < run->passed)
		frame.progress = 1;
	else if (tiles)
		frame.progress = (double)tiles->samples_done / (double)tiles->samples;
	return frame;
}

uint32_t pen_jobs_frame_latest(const struct pen_job *job)
{
	const struct pen_run *run = (const struct pen_run *)job;
	const uint32_t open = job->frame_first + run->passed;

	for (uint32_t i = PEN_REEL_FRAMES_MAX; i-- > 0;) {
		const struct pen_tiles *tiles = find_tiles(job, open + i);

		if (tiles && tiles->units_done > 0)
			return open + i;
	}
	return run->passed > 0 ? open - 1 : job->frame_first;
}

uint32_t pen_jobs_frames_running(
	const struct pen_job *job, struct pen_job_frame ret_frames[static PEN_JOB_FRAMES_MAX])
{
	const struct pen_run *run = (const struct pen_run *)job;
	uint32_t count = 0;

	for (uint32_t i = 0; i < PEN_REEL_FRAMES_MAX; i++)
		if (find_tiles(job, job->frame_first + run->passed + i))
			ret_frames[count++] =
				pen_jobs_frame(job, job->frame_first + run->passed + i);
	return count;
}

size_t pen_jobs_tiles_since(const struct pen_job *job, uint32_t frame, uint64_t revision,
	struct pen_rect *ret_rects, size_t max)
{
	const struct pen_tiles *tiles = find_tiles(job, frame);

	return tiles ? pen_tiles_since(tiles, &job->tiling, revision, ret_rects, max) : 0;
}

int pen_jobs_open_image(struct pen_jobs *jobs, const struct pen_job *job, uint32_t frame,
	int *ret_fd, struct pen_error *err)
{
	char path[PATH_MAX];
	int fd;

	pen_run_path(jobs, job, frame, path);
	fd = open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0 && errno == ENOENT && pen_jobs_frame(job, frame).done)
		return pen_error_set(err, PEN_EIO,
			"frame %u is lost: stop the coordinator and start `penumbra fsck --repair`",
			frame);
	if (fd < 0 && errno == ENOENT)
		return pen_error_set(err, PEN_ENOTFOUND, "nothing is rendered yet");
	if (fd < 0)
		return pen_error_system(err, errno, "cannot open the framebuffer");
	*ret_fd = fd;
	return 0;
}

/* Beginning and end */

static int load_job(void *user, const struct pen_job *stored, struct pen_error *err)
{
	struct pen_jobs *jobs = user;
	struct pen_run *run = calloc(1, sizeof *run);
	int r;

	if (!run)
		return pen_error_memory(err);
	run->job = *stored;
	run->text = -1;
	r = pen_job_texts_copy(&run->job, err);
	run->job.eta_seconds = -1;
	run->passed = run->job.frames_done;
	/* Above whatever an earlier coordinator may have told. */
	run->job.revision = (uint64_t)pen_clock_wall_ms();
	if (r == 0)
		r = pen_job_table_add(&jobs->table, &run->job, err);
	if (r < 0) {
		pen_run_destroy(run);
		return r;
	}
	pen_run_index(jobs, run);
	jobs->number_last = run->job.number;
	if (!pen_job_is_over(run->job.state)) {
		TAILQ_INSERT_TAIL(&jobs->unfinished, run, unfinished);
		jobs->unfinished_count++;
	}
	return 0;
}

static int load_tile(
	void *user, uint64_t number, const struct pen_store_tile *tile, struct pen_error *err)
{
	struct pen_run *run = pen_run_find(user, number);
	const uint32_t open = run->job.frame_first + run->passed;
	const uint32_t left = run->job.frame_count - run->passed;
	struct pen_run_frame *frame;

	/* Frames further on begin again: there is no room for them yet. */
	if (tile->frame - open >= pen_reel_slots(&run->job.tiling, left))
		return 0;
	frame = pen_run_add_frame(run, tile->frame);
	if (!frame)
		return pen_error_memory(err);
	frame->tiles.states[tile->tile] = tile->state;
	return 0;
}

static int load_removed(
	void *user, const char *id, const struct pen_owner *owner, struct pen_error *err)
{
	struct pen_jobs *jobs = user;

	return pen_job_table_add_removed(&jobs->table, id, owner, err);
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
		if (!pen_jobs_find(jobs, id))
			(void)unlinkat(dirfd(frames), entry->d_name, 0);
	}
	if (frames)
		(void)closedir(frames);
}

static void fail_overdue(struct pen_jobs *jobs, struct pen_run *run)
{
	struct pen_error why = PEN_ERROR_INIT, err;

	(void)pen_error_set(&why, PEN_ELIMIT, "it was not done by its deadline");
	if (pen_run_store_state(jobs, run, PEN_JOB_FAILED, &why, NULL, NULL, &err) < 0)
		return; /* the next tick tries again */
	pen_dispatch_remove_job(jobs->options.dispatch, run->job.number);
	pen_run_halt(run);
}

static void handle_tick(uv_timer_t *timer)
{
	struct pen_jobs *jobs = timer->data;
	const int64_t now_ms = pen_clock_wall_ms();

	for (struct pen_run *run = TAILQ_FIRST(&jobs->unfinished); run;
		run = TAILQ_NEXT(run, unfinished)) {
		pen_run_tick(jobs, run);
		if (run->job.deadline_ms != 0 && run->job.deadline_ms <= now_ms && !run->ending)
			fail_overdue(jobs, run);
	}
	pen_upkeep_tick(jobs);
}

bool pen_jobs_lack_room(const struct pen_jobs *jobs)
{
	return pen_upkeep_lacks_room(jobs);
}

int pen_jobs_create(uv_loop_t *loop, const struct pen_jobs_options *options,
	struct pen_jobs **ret_jobs, struct pen_error *err)
{
	struct pen_jobs *jobs = calloc(1, sizeof *jobs);
	struct pen_store_visitor visitor = {load_job, load_tile, load_removed, jobs};
	int r;

	if (!jobs)
		return pen_error_memory(err);
	jobs->loop = loop;
	jobs->options = *options;
	pen_job_table_init(&jobs->table);
	TAILQ_INIT(&jobs->unfinished);
	TAILQ_INIT(&jobs->accepting);
	TAILQ_INIT(&jobs->previews);
	(void)uv_timer_init(loop, &jobs->timer);
	jobs->timer.data = jobs;
	r = pen_store_load(options->store, &visitor, err);
	if (r < 0) {
		pen_jobs_destroy(jobs);
		return r;
	}
	sweep_frames(jobs);
	pen_run_connect(jobs);
	for (struct pen_run *run = TAILQ_FIRST(&jobs->unfinished); run;
		run = TAILQ_NEXT(run, unfinished))
		pen_run_begin(jobs, run);
	(void)uv_timer_start(&jobs->timer, handle_tick, PEN_RUN_TICK_MS, PEN_RUN_TICK_MS);
	*ret_jobs = jobs;
	return 0;
}

void pen_jobs_close(struct pen_jobs *jobs)
{
	jobs->closed = true;
	(void)uv_timer_stop(&jobs->timer);
	for (struct pen_run *run = TAILQ_FIRST(&jobs->unfinished); run;
		run = TAILQ_NEXT(run, unfinished)) {
		if (!run->ending)
			pen_tile_news_flush(&run->news, &run->job, jobs->options.store);
		pen_run_halt(run);
	}
}

static void handle_closed(uv_handle_t *handle)
{
	struct pen_jobs *jobs = handle->data;

	for (size_t i = 0; i < jobs->table.count; i++)
		pen_run_destroy((struct pen_run *)jobs->table.jobs[i]);
	pen_job_index_finish(&jobs->keys);
	pen_job_index_finish(&jobs->contents);
	pen_job_table_finish(&jobs->table);
	free(jobs);
}

void pen_jobs_destroy(struct pen_jobs *jobs)
{
	if (jobs)
		uv_close((uv_handle_t *)&jobs->timer, handle_closed);
}
