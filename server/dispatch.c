/* SPDX-License-Identifier: Apache-2.0 */
#include "server/dispatch.h"

#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/base/film.h"
#include "core/base/limits.h"
#include "core/base/log.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

struct pen_dispatch {
	struct pen_sched *sched;
	struct pen_dispatch_jobs jobs;
	struct pen_dispatch_farm farm;
	float *pixels; /* of the result that is being taken; NULL: they have been passed on */
	bool stepping;
	bool stopped;
};

int pen_dispatch_create(uint64_t secret, struct pen_dispatch **ret_dispatch, struct pen_error *err)
{
	struct pen_dispatch *dispatch = calloc(1, sizeof *dispatch);
	int r;

	if (!dispatch)
		return pen_error_memory(err);
	r = pen_sched_create(secret, &dispatch->sched, err);
	if (r < 0) {
		free(dispatch);
		return r;
	}
	*ret_dispatch = dispatch;
	return 0;
}

void pen_dispatch_destroy(struct pen_dispatch *dispatch)
{
	if (!dispatch)
		return;
	pen_sched_destroy(dispatch->sched);
	free(dispatch);
}

void pen_dispatch_connect_jobs(struct pen_dispatch *dispatch, const struct pen_dispatch_jobs *jobs)
{
	dispatch->jobs = *jobs;
}

void pen_dispatch_connect_farm(struct pen_dispatch *dispatch, const struct pen_dispatch_farm *farm)
{
	dispatch->farm = *farm;
}

static void note(const struct pen_job *job, uint64_t worker, uint32_t frame, uint32_t tile,
	uint32_t round, enum pen_log_level level, const char *what)
{
	const struct pen_log_about about = {.job = job->id,
		.trace = job->trace,
		.worker = worker,
		.has_unit = true,
		.frame = frame,
		.tile = tile,
		.round = round};

	pen_log_of(&about, level, "render %s, frame %u, tile %u, round %u, worker %llu: %s",
		job->id, frame, tile, round, (unsigned long long)worker, what);
}

static void send_lease(struct pen_dispatch *dispatch, const struct pen_sched_action *action)
{
	const struct pen_job *job = dispatch->jobs.find(dispatch->jobs.user, action->job);
	const struct pen_rounds rounds = pen_sampling_rounds(&job->sampling);
	const struct pen_round samples = pen_round_get(&rounds, action->round);
	uint8_t mask[PEN_MASK_BYTES_MAX];
	const bool has_mask = dispatch->jobs.mask(
		dispatch->jobs.user, action->job, action->frame, action->tile, action->round, mask);
	struct pen_msg_lease lease = {
		.lease = action->lease,
		.job = action->job,
		.epoch = action->epoch,
		.tile = action->tile,
		.round = action->round,
		.frame = action->frame,
		.rect = pen_tiling_rect(&job->tiling, action->tile),
		.sample_first = samples.first,
		.sample_end = samples.end,
		.at_centre = samples.at_centre,
		.scene_sha256 = job->scene_sha256,
		.has_world = job->has_world,
		.world_sha256 = job->world,
		.deadline_ms = PEN_LEASE_HARD_MS,
		.channels = pen_job_film(job).channels,
	};

	memcpy(lease.render, job->id, sizeof job->id);
	memcpy(lease.trace, job->trace, sizeof lease.trace);
	note(job, action->worker, action->frame, action->tile, action->round, PEN_LOG_DEBUG,
		"leased");
	dispatch->farm.lease(dispatch->farm.user, action->worker, &lease, has_mask ? mask : NULL);
}

static enum pen_dispatch_custody custody_of(enum pen_sched_action_type type)
{
	if (type == PEN_SCHED_RELEASED)
		return PEN_CUSTODY_NONE;
	return type == PEN_SCHED_CONVICTED ? PEN_CUSTODY_LIAR : PEN_CUSTODY_STRIKES;
}

static void perform(struct pen_dispatch *dispatch, const struct pen_sched_action *action)
{
	const struct pen_dispatch_jobs *jobs = &dispatch->jobs;

	switch (action->type) {
	case PEN_SCHED_LEASE: send_lease(dispatch, action); break;
	case PEN_SCHED_REVOKE:
		dispatch->farm.revoke(dispatch->farm.user, action->worker, action->lease);
		break;
	case PEN_SCHED_STARTED: jobs->started(jobs->user, action->job, action->text); break;
	case PEN_SCHED_DECIDE: jobs->decide(jobs->user, action->job, action->frame); break;
	case PEN_SCHED_RENDERED:
		jobs->ended(jobs->user, action->job, PEN_DISPATCH_RENDERED, NULL);
		break;
	case PEN_SCHED_FAILED:
		jobs->ended(jobs->user, action->job, PEN_DISPATCH_FAILED, action->text);
		break;
	case PEN_SCHED_ABANDONED:
		jobs->ended(jobs->user, action->job, PEN_DISPATCH_ABANDONED, NULL);
		break;
	case PEN_SCHED_TAINTED:
		jobs->ended(jobs->user, action->job, PEN_DISPATCH_TAINTED, NULL);
		break;
	case PEN_SCHED_COMMIT:
		jobs->merge(jobs->user, action->job, action->frame, action->tile, action->round,
			dispatch->pixels);
		dispatch->pixels = NULL;
		break;
	case PEN_SCHED_QUARANTINED:
	case PEN_SCHED_CONVICTED:
	case PEN_SCHED_RELEASED:
		dispatch->farm.quarantined(
			dispatch->farm.user, action->worker, custody_of(action->type));
		break;
	}
}

static void step(struct pen_dispatch *dispatch, const struct pen_sched_event *event)
{
	struct pen_sched_actions actions;

	if (dispatch->stopped)
		return;
	assert(!dispatch->stepping);
	dispatch->stepping = true;
	actions = pen_sched_step(dispatch->sched, event, pen_clock_ms());
	for (size_t i = 0; i < actions.count; i++)
		perform(dispatch, &actions.items[i]);
	dispatch->stepping = false;
}

void pen_dispatch_tick(struct pen_dispatch *dispatch)
{
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_TICK});
}

void pen_dispatch_stop(struct pen_dispatch *dispatch)
{
	dispatch->stopped = true;
}

int pen_dispatch_add_job(
	struct pen_dispatch *dispatch, const struct pen_sched_job *job, struct pen_error *err)
{
	int r;

	assert(!dispatch->stepping);
	r = pen_sched_add_job(dispatch->sched, job, err);
	pen_dispatch_tick(dispatch);
	return r;
}

void pen_dispatch_remove_job(struct pen_dispatch *dispatch, uint64_t number)
{
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_JOB_REMOVE, .job = number});
}

void pen_dispatch_pause_job(struct pen_dispatch *dispatch, uint64_t number)
{
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_JOB_PAUSE, .job = number});
}

void pen_dispatch_resume_job(struct pen_dispatch *dispatch, uint64_t number)
{
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_JOB_RESUME, .job = number});
}

void pen_dispatch_set_priority(struct pen_dispatch *dispatch, uint64_t number, uint32_t priority)
{
	step(dispatch,
		&(struct pen_sched_event){
			.type = PEN_SCHED_JOB_PRIORITY, .job = number, .u.priority = priority});
}

void pen_dispatch_merged(
	struct pen_dispatch *dispatch, uint64_t number, uint32_t frame, uint32_t tile)
{
	step(dispatch, &(struct pen_sched_event){
			       .type = PEN_SCHED_MERGED, .job = number, .u.merged = {frame, tile}});
}

void pen_dispatch_decided(struct pen_dispatch *dispatch, uint64_t number, uint32_t frame,
	const struct pen_demand *demands)
{
	step(dispatch,
		&(struct pen_sched_event){
			.type = PEN_SCHED_DECIDED, .job = number, .u.decided = {frame, demands}});
}

int pen_dispatch_add_worker(
	struct pen_dispatch *dispatch, const struct pen_sched_worker *worker, struct pen_error *err)
{
	int r;

	assert(!dispatch->stepping);
	r = pen_sched_add_worker(dispatch->sched, worker, err);
	pen_dispatch_tick(dispatch);
	return r;
}

void pen_dispatch_remove_worker(struct pen_dispatch *dispatch, uint64_t worker)
{
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_WORKER_LEAVE, .worker = worker});
}

void pen_dispatch_drain_worker(struct pen_dispatch *dispatch, uint64_t worker)
{
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_WORKER_DRAIN, .worker = worker});
}

void pen_dispatch_reset_worker(struct pen_dispatch *dispatch, uint64_t worker)
{
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_WORKER_RESET, .worker = worker});
}

void pen_dispatch_progress(
	struct pen_dispatch *dispatch, uint64_t worker, const struct pen_msg_heartbeat *heartbeat)
{
	for (uint32_t i = 0; i < heartbeat->count; i++)
		step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_PROGRESS,
				       .worker = worker,
				       .lease = heartbeat->leases[i],
				       .u.samples = heartbeat->samples[i]});
}

static void fail_lease(struct pen_dispatch *dispatch, uint64_t worker, uint64_t lease,
	enum pen_sched_fault fault, const char *reason)
{
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_FAILURE,
			       .worker = worker,
			       .lease = lease,
			       .u.failure = {fault, reason}});
}

static bool is_count(float value, uint32_t max)
{
	return value >= 0 && value <= (float)max;
}

static bool is_empty(const float *pixel, const struct pen_film *film)
{
	for (uint32_t c = 0; c < film->channels; c++)
		if (pixel[c] != 0.0f)
			return false;
	return true;
}

/* Why the pixels cannot be right; NULL when they can. */
static const char *find_defect(const struct pen_msg_result *result, const float *pixels,
	size_t size, const struct pen_film *film, uint64_t area, const uint8_t *mask,
	uint32_t samples)
{
	if (size != area * film->channels * sizeof *pixels)
		return "the worker sent a result of the wrong size";
	if (pen_xxh3(pixels, size) != result->xxh3)
		return "the worker sent a damaged result";
	if (!pen_film_is_finite(pixels, area * film->channels))
		return "the worker sent a value that is not finite";
	for (size_t i = 0; i < area; i++, pixels += film->channels) {
		if (mask && !pen_mask_has(mask, i) && !is_empty(pixels, film))
			return "the worker sent samples of a pixel that had none to get";
		if (!is_count(pixels[PEN_CHANNEL_COUNT], samples) ||
			(film->depth && !is_count(pixels[film->depth + 1], samples)))
			return "the worker sent a wrong sample count";
	}
	return NULL;
}

/* Nobody can make other pixels with the same. */
static uint64_t digest(const float *pixels, size_t size)
{
	struct pen_sha256 sha256 = {{0}};
	uint64_t first;

	(void)pen_sha256_of(pixels, size, &sha256, NULL);
	memcpy(&first, sha256.bytes, sizeof first);
	return first;
}

enum pen_dispatch_outcome pen_dispatch_result(struct pen_dispatch *dispatch, uint64_t worker,
	const struct pen_msg_result *result, const void *payload, size_t size,
	uint64_t *ret_samples)
{
	const struct pen_sched_lease *lease =
		pen_sched_find_lease(dispatch->sched, worker, result->lease);
	const struct pen_job *job;
	uint8_t mask[PEN_MASK_BYTES_MAX];
	bool has_mask;
	struct pen_film film;
	struct pen_rounds rounds;
	struct pen_round samples;
	struct pen_rect rect;
	uint64_t area;
	const char *defect;
	float *pixels;

	if (dispatch->stopped || !lease || lease->job != result->job ||
		lease->frame != result->frame || lease->tile != result->tile ||
		lease->round != result->round || lease->epoch != result->epoch)
		return PEN_OUTCOME_GONE;
	job = dispatch->jobs.find(dispatch->jobs.user, result->job);
	rounds = pen_sampling_rounds(&job->sampling);
	samples = pen_round_get(&rounds, result->round);
	rect = pen_tiling_rect(&job->tiling, result->tile);
	area = pen_rect_area(rect);
	film = pen_job_film(job);
	has_mask = dispatch->jobs.mask(
		dispatch->jobs.user, lease->job, lease->frame, lease->tile, lease->round, mask);

	/* The payload lies unaligned in the connection's buffer, which is about to be reused. */
	pixels = malloc(size > 0 ? size : 1);
	if (!pixels) {
		fail_lease(dispatch, worker, result->lease, PEN_SCHED_FAULT_RETURNED, "");
		return PEN_OUTCOME_RETURNED;
	}
	memcpy(pixels, payload, size);
	defect = find_defect(result, pixels, size, &film, area, has_mask ? mask : NULL,
		samples.end - samples.first);
	if (defect) {
		note(job, worker, lease->frame, lease->tile, lease->round, PEN_LOG_WARNING, defect);
		free(pixels);
		fail_lease(dispatch, worker, result->lease, PEN_SCHED_FAULT_OWN, defect);
		return PEN_OUTCOME_BAD;
	}
	note(job, worker, lease->frame, lease->tile, lease->round, PEN_LOG_DEBUG, "rendered");
	dispatch->pixels = pixels;
	step(dispatch, &(struct pen_sched_event){.type = PEN_SCHED_RESULT,
			       .worker = worker,
			       .lease = result->lease,
			       .digest = job->verify == PEN_VERIFY_NONE ? 0 : digest(pixels, size),
			       .u.seconds = 1e-6 * result->render_us});
	free(dispatch->pixels);
	dispatch->pixels = NULL;
	*ret_samples =
		(has_mask ? pen_mask_count(mask, rect) : area) * (samples.end - samples.first);
	return PEN_OUTCOME_GOOD;
}

static enum pen_sched_fault fault_of(enum pen_fault fault)
{
	switch (fault) {
	case PEN_FAULT_CRASH:
	case PEN_FAULT_DEADLINE: return PEN_SCHED_FAULT_OWN;
	case PEN_FAULT_SCENE: return PEN_SCHED_FAULT_SCENE;
	case PEN_FAULT_RETURNED: return PEN_SCHED_FAULT_RETURNED;
	case PEN_FAULT_NONE:
	case PEN_FAULT_KILLED:
	case PEN_FAULT_NO_SCENE: break;
	}
	return PEN_SCHED_FAULT_KILLED;
}

enum pen_dispatch_outcome pen_dispatch_failure(
	struct pen_dispatch *dispatch, uint64_t worker, const struct pen_msg_failure *failure)
{
	const struct pen_sched_lease *lease =
		pen_sched_find_lease(dispatch->sched, worker, failure->lease);
	enum pen_sched_fault fault = fault_of(failure->fault);

	if (dispatch->stopped || !lease)
		return PEN_OUTCOME_GONE;
	note(dispatch->jobs.find(dispatch->jobs.user, lease->job), worker, lease->frame,
		lease->tile, lease->round,
		fault == PEN_SCHED_FAULT_OWN ? PEN_LOG_WARNING : PEN_LOG_DEBUG, failure->reason);
	fail_lease(dispatch, worker, failure->lease, fault, failure->reason);
	return fault == PEN_SCHED_FAULT_OWN ? PEN_OUTCOME_BAD : PEN_OUTCOME_RETURNED;
}

void pen_dispatch_report(struct pen_dispatch *dispatch, const struct pen_msg_scene_report *report)
{
	if (!dispatch->stopped)
		dispatch->jobs.reported(dispatch->jobs.user, report);
}

bool pen_dispatch_text(const struct pen_dispatch *dispatch, const struct pen_sha256 *sha256,
	int *ret_fd, uint64_t *ret_size)
{
	return !dispatch->stopped &&
	       dispatch->jobs.text(dispatch->jobs.user, sha256, ret_fd, ret_size);
}

size_t pen_dispatch_held(const struct pen_dispatch *dispatch, uint64_t number,
	struct pen_sched_held *ret_held, size_t max)
{
	return pen_sched_held(dispatch->sched, number, ret_held, max);
}

uint64_t pen_dispatch_waiting(const struct pen_dispatch *dispatch)
{
	return pen_sched_waiting(dispatch->sched);
}

bool pen_dispatch_lacks_class(const struct pen_dispatch *dispatch)
{
	return pen_sched_lacks_class(dispatch->sched);
}

uint32_t pen_dispatch_processes(const struct pen_dispatch *dispatch)
{
	return pen_sched_processes(dispatch->sched);
}
