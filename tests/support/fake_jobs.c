/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/fake_jobs.h"

#include "server/farm.h"
#include "server/framebuf.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { WIDTH = 40, HEIGHT = 24, TILE_PX = 16, TILES = 6, JOBS_MAX = 256 };

struct fake {
	struct pen_job job;
	uint32_t tiles; /* rendered: the first so many */
	uint64_t revisions[TILES];
};

struct pen_jobs {
	uv_loop_t *loop;
	struct fake *fakes[JOBS_MAX]; /* by number */
	size_t count;
};

static const char *const state_names[] = {
	"queued", "running", "paused", "done", "failed", "cancelled"};

const char *pen_job_state_name(enum pen_job_state state)
{
	return state_names[state];
}

bool pen_job_state_parse(const char *name, enum pen_job_state *ret_state)
{
	for (unsigned i = 0; i < 6; i++) {
		if (strcmp(name, state_names[i]) == 0) {
			*ret_state = (enum pen_job_state)i;
			return true;
		}
	}
	return false;
}

static void set_tiles(struct fake *fake, uint32_t tiles)
{
	assert(tiles <= TILES && fake->job.tiling.count == TILES);
	fake->tiles = tiles;
	fake->job.tiles_done = tiles;
	fake->job.samples_done = (uint64_t)WIDTH * HEIGHT * fake->job.sampling.samples * tiles /
				 fake->job.tiling.count;
	fake->job.image_revision = tiles;
	fake->job.revision++;
	for (uint32_t i = 0; i < tiles; i++)
		if (fake->revisions[i] == 0)
			fake->revisions[i] = fake->job.revision;
}

static struct fake *add(struct pen_jobs *jobs, const char *id, enum pen_job_state state)
{
	struct fake *fake = calloc(1, sizeof *fake);
	struct pen_job *job = &fake->job;

	assert(fake && jobs->count < JOBS_MAX);
	(void)snprintf(job->id, sizeof job->id, "%s", id);
	job->number = jobs->count;
	job->state = state;
	job->priority = 50;
	job->width = WIDTH;
	job->height = HEIGHT;
	pen_tiling_init(&job->tiling, (struct pen_rect){0, 0, WIDTH, HEIGHT}, TILE_PX);
	job->frame_first = job->frame_count = 1;
	job->sampling.samples = 4;
	job->created_ms = 1700000000000;
	job->eta_seconds = -1;
	job->revision = 1;
	jobs->fakes[jobs->count++] = fake;
	if (state == PEN_JOB_DONE)
		set_tiles(fake, job->tiling.count);
	else if (state != PEN_JOB_QUEUED && state != PEN_JOB_FAILED)
		set_tiles(fake, job->tiling.count / 2);
	if (state == PEN_JOB_FAILED)
		(void)pen_error_set(&job->error, PEN_EINVALID, "tile 3 failed three times");
	return fake;
}

struct pen_jobs *fake_jobs_create(uv_loop_t *loop)
{
	struct pen_jobs *jobs = calloc(1, sizeof *jobs);

	assert(jobs);
	jobs->loop = loop;
	for (unsigned i = 0; i < 6; i++)
		(void)add(jobs, state_names[i], (enum pen_job_state)i);
	return jobs;
}

void fake_jobs_destroy(struct pen_jobs *jobs)
{
	for (size_t i = 0; i < jobs->count; i++) {
		if (jobs->fakes[i])
			free(jobs->fakes[i]->job.name);
		free(jobs->fakes[i]);
	}
	free(jobs);
}

void fake_jobs_advance(struct pen_jobs *jobs)
{
	set_tiles(jobs->fakes[PEN_JOB_RUNNING], jobs->fakes[PEN_JOB_RUNNING]->tiles + 1);
	set_tiles(jobs->fakes[PEN_JOB_QUEUED], 1);
}

/* What is told a turn of the loop later. */
struct later {
	uv_timer_t timer;
	struct pen_jobs *jobs;
	char id[PEN_JOB_ID_TEXT];
	struct pen_error err;
	pen_job_fn *fn;
	void *user;
};

static void later_closed(uv_handle_t *handle)
{
	free(handle->data);
}

static void later_due(uv_timer_t *timer)
{
	struct later *later = timer->data;

	later->fn(later->user, pen_jobs_find(later->jobs, later->id), &later->err);
	uv_close((uv_handle_t *)timer, later_closed);
}

static void tell_later(struct pen_jobs *jobs, const char *id, int code, pen_job_fn *fn, void *user)
{
	struct later *later = calloc(1, sizeof *later);

	assert(later);
	later->jobs = jobs;
	(void)snprintf(later->id, sizeof later->id, "%s", id);
	if (code != 0)
		(void)pen_error_set(&later->err, code, "the disk is broken");
	later->fn = fn;
	later->user = user;
	(void)uv_timer_init(jobs->loop, &later->timer);
	later->timer.data = later;
	(void)uv_timer_start(&later->timer, later_due, 1, 0);
}

int pen_jobs_submit(struct pen_jobs *jobs, struct pen_submission *submission, pen_job_fn *fn,
	void *user, struct pen_error *err)
{
	const char *name = submission->name;
	char id[PEN_JOB_ID_TEXT];
	struct fake *fake;
	int r = 0;

	if (name && strcmp(name, "full") == 0)
		r = pen_error_set(err, PEN_ELIMIT, "too many renders wait");
	submission->retry_s = 7;
	if (name && strcmp(name, "disk") == 0)
		r = pen_error_set(err, PEN_ENOSPACE, "the disk is nearly full");
	pen_scene_destroy(submission->scene);
	free(submission->canonical);
	if (r < 0)
		return r;
	if (name && strcmp(name, "broken") == 0) {
		tell_later(jobs, "", PEN_EIO, fn, user);
		return 0;
	}
	(void)snprintf(id, sizeof id, "new%zu", jobs->count);
	fake = add(jobs, id, PEN_JOB_QUEUED);
	fake->job.name = name ? strdup(name) : NULL;
	fake->job.priority = submission->priority;
	tell_later(jobs, id, 0, fn, user);
	return 0;
}

int pen_jobs_set_state(struct pen_jobs *jobs, struct pen_job *job, enum pen_job_state state,
	pen_job_fn *fn, void *user, struct pen_error *err)
{
	if (job->state == PEN_JOB_DONE || job->state == PEN_JOB_FAILED ||
		job->state == PEN_JOB_CANCELLED)
		return pen_error_set(err, PEN_ECONFLICT, "the render is over");
	job->state = state;
	job->revision++;
	tell_later(jobs, job->id, 0, fn, user);
	return 0;
}

int pen_jobs_set_priority(struct pen_jobs *jobs, struct pen_job *job, uint32_t priority,
	pen_job_fn *fn, void *user, struct pen_error *err)
{
	(void)err;
	job->priority = priority;
	job->revision++;
	tell_later(jobs, job->id, 0, fn, user);
	return 0;
}

int pen_jobs_delete(struct pen_jobs *jobs, struct pen_job *job, pen_job_fn *fn, void *user,
	struct pen_error *err)
{
	struct fake **place = &jobs->fakes[job->number];

	(void)err;
	free(job->name);
	free(*place);
	*place = NULL;
	tell_later(jobs, "", 0, fn, user);
	return 0;
}

void pen_jobs_replace(struct pen_jobs *jobs, const char *id)
{
	(void)jobs, (void)id;
}

int pen_jobs_find_key(struct pen_jobs *jobs, const struct pen_sha256 *key, struct pen_job **ret_job,
	struct pen_error *err)
{
	(void)jobs, (void)key, (void)ret_job;
	return pen_error_set(err, PEN_ENOTFOUND, "no such key");
}

struct pen_job *pen_jobs_find_content(
	struct pen_jobs *jobs, const struct pen_owner *owner, const struct pen_sha256 *content)
{
	(void)jobs, (void)owner, (void)content;
	return NULL;
}

void pen_jobs_listen(struct pen_jobs *jobs, void (*fn)(void *user), void *user)
{
	(void)jobs, (void)fn, (void)user;
}

const struct pen_owner *pen_jobs_find_removed(struct pen_jobs *jobs, const char *id)
{
	static const struct pen_owner nobody;

	(void)jobs;
	return strcmp(id, "removed") == 0 ? &nobody : NULL;
}

struct pen_job *pen_jobs_find(struct pen_jobs *jobs, const char *id)
{
	for (size_t i = 0; i < jobs->count; i++) {
		if (jobs->fakes[i] && strcmp(jobs->fakes[i]->job.id, id) == 0)
			return &jobs->fakes[i]->job;
	}
	return NULL;
}

struct pen_job *pen_jobs_older(struct pen_jobs *jobs, uint64_t before)
{
	size_t i = before < jobs->count ? (size_t)before : jobs->count;

	while (i > 0) {
		if (jobs->fakes[--i])
			return &jobs->fakes[i]->job;
	}
	return NULL;
}

struct pen_job_frame pen_jobs_frame(const struct pen_job *job, uint32_t number)
{
	return (struct pen_job_frame){
		.number = number,
		.done = job->state == PEN_JOB_DONE,
		.progress = (double)job->samples_done / (double)pen_job_samples(job),
		.revision = job->image_revision,
	};
}

uint32_t pen_jobs_frame_latest(const struct pen_job *job)
{
	return job->frame_first;
}

uint32_t pen_jobs_frames_running(
	const struct pen_job *job, struct pen_job_frame ret_frames[static PEN_JOB_FRAMES_MAX])
{
	if (pen_job_is_over(job->state) || job->image_revision == 0)
		return 0;
	ret_frames[0] = pen_jobs_frame(job, 1);
	return 1;
}

size_t pen_jobs_tiles_since(const struct pen_job *job, uint32_t frame, uint64_t revision,
	struct pen_rect *ret_rects, size_t max)
{
	const struct fake *fake = (const struct fake *)job;
	size_t count = 0;

	(void)frame;
	for (uint32_t i = 0; i < fake->tiles && count < max; i++)
		if (fake->revisions[i] > revision)
			ret_rects[count++] = pen_tiling_rect(&job->tiling, i);
	return count;
}

int pen_jobs_open_image(struct pen_jobs *jobs, const struct pen_job *job, uint32_t frame,
	int *ret_fd, struct pen_error *err)
{
	static const float grey[PEN_CHANNELS_MIN] = {2.0f, 2.0f, 2.0f, 4.0f};
	const struct pen_framebuf framebuf = {.tiling = job->tiling, .film = pen_job_film(job)};
	size_t slot = pen_framebuf_slot_bytes(&framebuf);
	size_t floats = slot / sizeof(float);
	float *pixels = calloc(job->tiling.count, slot);
	int fd = memfd_create("framebuffer", MFD_CLOEXEC);

	(void)jobs, (void)frame, (void)err;
	assert(pixels && fd >= 0);
	for (size_t i = 0; i < job->image_revision * floats; i++)
		pixels[i] = grey[i % PEN_CHANNELS_MIN];
	if (write(fd, pixels, job->tiling.count * slot) != (ssize_t)(job->tiling.count * slot))
		abort();
	free(pixels);
	*ret_fd = fd;
	return 0;
}

/* A farm of one worker. */

const struct pen_worker *pen_farm_next(const struct pen_farm *farm, uint64_t after)
{
	static char name[] = "one", address[] = "127.0.0.1:4711", class[] = "1/avx2",
		    version[] = "0";
	static const struct pen_worker worker = {
		.id = 7,
		.name = name,
		.address = address,
		.processes = 2,
		.equivalence_class = class,
		.version = version,
		.units_done = 12,
		.samples_per_second = 1000.0,
	};

	(void)farm;
	return after < worker.id ? &worker : NULL;
}

bool pen_jobs_lack_room(const struct pen_jobs *jobs)
{
	(void)jobs;
	return false;
}

size_t pen_farm_held(
	const struct pen_farm *farm, uint64_t number, struct pen_sched_held *ret_held, size_t max)
{
	(void)farm, (void)number, (void)ret_held, (void)max;
	return 0;
}

int pen_farm_drain(struct pen_farm *farm, uint64_t id, struct pen_error *err)
{
	(void)farm;
	return id == 7 ? 0 : pen_error_set(err, PEN_ENOTFOUND, "there is no such worker");
}

int pen_farm_reset(struct pen_farm *farm, uint64_t id, struct pen_error *err)
{
	(void)farm;
	return id == 7 ? pen_error_set(err, PEN_ECONFLICT, "the worker is leaving")
		       : pen_error_set(err, PEN_ENOTFOUND, "there is no such worker");
}

struct pen_farm_totals pen_farm_totals(const struct pen_farm *farm)
{
	(void)farm;
	return (struct pen_farm_totals){.welcomed = 1};
}

uint64_t pen_farm_queue_depth(const struct pen_farm *farm)
{
	(void)farm;
	return 5;
}

const char *pen_farm_why_waiting(const struct pen_farm *farm)
{
	(void)farm;
	return "";
}
