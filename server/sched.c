/* SPDX-License-Identifier: Apache-2.0 */
#include "server/sched.h"

#include "server/sched_state.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int pen_sched_create(uint64_t secret, struct pen_sched **ret_sched, struct pen_error *err)
{
	struct pen_sched *sched = calloc(1, sizeof *sched);

	if (!sched)
		return pen_error_memory(err);
	sched->secret = secret;
	*ret_sched = sched;
	return 0;
}

static void job_destroy(struct pen_sched_turn *job)
{
	if (!job)
		return;
	pen_reel_finish(&job->reel);
	free(job);
}

static void bury(struct pen_sched *sched)
{
	while (sched->dropped) {
		struct pen_sched_turn *job = sched->dropped;

		sched->dropped = job->next;
		job_destroy(job);
	}
}

void pen_sched_destroy(struct pen_sched *sched)
{
	if (!sched)
		return;
	bury(sched);
	for (size_t i = 0; i < sched->job_count; i++)
		job_destroy(sched->jobs[i]);
	for (size_t i = 0; i < sched->worker_count; i++)
		free(sched->workers[i]);
	free(sched->jobs);
	free(sched->workers);
	free(sched->actions);
	free(sched);
}

/* Makes room for count items in an array of pointers or structs. */
static int reserve(void **items, size_t *capacity, size_t count, size_t size)
{
	size_t grown = count > 2 * *capacity ? count : 2 * *capacity;
	void *moved;

	if (count <= *capacity)
		return 0;
	moved = reallocarray(*items, grown, size);
	if (!moved)
		return PEN_ENOMEM;
	*items = moved;
	*capacity = grown;
	return 0;
}

/*
 * A step ends each lease and fills its place at most once, says at most one thing of a worker and
 * two of a job, and asks for each of its frames.
 */
static int reserve_actions(struct pen_sched *sched, size_t more_leases, size_t more_jobs)
{
	size_t count = 2 * (sched->lease_places + more_leases) + 2 * sched->worker_capacity + 1 +
		       (2 + PEN_REEL_FRAMES_MAX) * (sched->job_count + more_jobs);
	void *items = sched->actions;
	int r = reserve(&items, &sched->action_capacity, count, sizeof *sched->actions);

	sched->actions = items;
	return r;
}

static int reserve_job(struct pen_sched *sched)
{
	void *items = sched->jobs;
	int r = reserve(&items, &sched->job_capacity, sched->job_count + 1, sizeof *sched->jobs);

	sched->jobs = items;
	return r < 0 ? r : reserve_actions(sched, 0, 1);
}

static int reserve_worker(struct pen_sched *sched, size_t leases)
{
	void *items = sched->workers;
	int r = reserve(
		&items, &sched->worker_capacity, sched->worker_count + 1, sizeof *sched->workers);

	sched->workers = items;
	return r < 0 ? r : reserve_actions(sched, leases, 0);
}

int pen_sched_add_job(
	struct pen_sched *sched, const struct pen_sched_job *given, struct pen_error *err)
{
	struct pen_sched_turn *job = calloc(1, sizeof *job);
	int r;

	if (!job || reserve_job(sched) < 0) {
		free(job);
		return pen_error_memory(err);
	}
	r = pen_reel_init(&job->reel, given->tiling, given->frame_first, given->frame_end,
		&given->rounds, given->merged, given->demands, err);
	if (r < 0) {
		free(job);
		return r;
	}
	job->number = given->number;
	job->priority = given->priority;
	job->paused = given->paused;
	job->absent_ms = job->disputed_ms = -1;
	job->verify = given->verify;
	job->restarted = given->restarted;
	job->unaudited = given->resumed ? UINT64_MAX : 0;
	job->virtual_seconds = sched->virtual_seconds;
	if (given->equivalence_class)
		(void)snprintf(job->equivalence_class, sizeof job->equivalence_class, "%s",
			given->equivalence_class);
	sched->jobs[sched->job_count++] = job;
	return 0;
}

int pen_sched_add_worker(
	struct pen_sched *sched, const struct pen_sched_worker *given, struct pen_error *err)
{
	uint32_t lease_max = 2 * given->processes;
	struct pen_sched_hand *worker =
		calloc(1, sizeof *worker + lease_max * sizeof *worker->leases);

	assert(given->processes <= PEN_PROCESSES_MAX);
	if (!worker || reserve_worker(sched, lease_max) < 0) {
		free(worker);
		return pen_error_memory(err);
	}
	worker->id = given->id;
	worker->processes = given->processes;
	worker->trusted = given->trusted;
	worker->quarantined = given->convicted;
	worker->release_ms = INT64_MAX;
	worker->lease_max = lease_max;
	(void)snprintf(worker->equivalence_class, sizeof worker->equivalence_class, "%s",
		given->equivalence_class);
	sched->workers[sched->worker_count++] = worker;
	sched->lease_places += lease_max;
	return 0;
}

struct pen_sched_turn *pen_sched_find_job(const struct pen_sched *sched, uint64_t number)
{
	for (size_t i = 0; i < sched->job_count; i++)
		if (sched->jobs[i]->number == number)
			return sched->jobs[i];
	return NULL;
}

/* A lease lives no longer than its job. */
struct pen_sched_turn *pen_sched_job_of(
	const struct pen_sched *sched, const struct pen_sched_lease *lease)
{
	struct pen_sched_turn *job = pen_sched_find_job(sched, lease->job);

	assert(job);
	return job;
}

struct pen_sched_hand *pen_sched_find_worker(const struct pen_sched *sched, uint64_t id)
{
	for (size_t i = 0; i < sched->worker_count; i++)
		if (sched->workers[i]->id == id)
			return sched->workers[i];
	return NULL;
}

static struct pen_sched_lease *find_lease(struct pen_sched_hand *worker, uint64_t id)
{
	for (uint32_t i = 0; id != 0 && i < worker->lease_max; i++)
		if (worker->leases[i].id == id)
			return &worker->leases[i];
	return NULL;
}

struct pen_sched_action *pen_sched_act(
	struct pen_sched *sched, enum pen_sched_action_type type, const struct pen_sched_turn *job)
{
	struct pen_sched_action *action = &sched->actions[sched->action_count++];

	assert(sched->action_count <= sched->action_capacity);
	*action = (struct pen_sched_action){.type = type, .job = job->number};
	return action;
}

/* Events */

static void handle_job(struct pen_sched *sched, const struct pen_sched_event *event)
{
	struct pen_sched_turn *job = pen_sched_find_job(sched, event->job);

	if (!job)
		return;
	switch (event->type) {
	case PEN_SCHED_JOB_REMOVE: pen_sched_drop_job(sched, job); break;
	case PEN_SCHED_JOB_PAUSE:
		job->paused = true;
		job->active = false;
		pen_sched_revoke_all(sched, job);
		break;
	case PEN_SCHED_JOB_RESUME:
		job->paused = false;
		if (job->virtual_seconds < sched->virtual_seconds)
			job->virtual_seconds = sched->virtual_seconds;
		break;
	default: job->priority = event->u.priority; break;
	}
}

static void handle_leave(struct pen_sched *sched, struct pen_sched_hand *worker)
{
	size_t place = 0;

	/* Only what it was rendering may have killed it. */
	for (uint32_t i = 0; i < worker->lease_max; i++) {
		struct pen_sched_lease *lease = &worker->leases[i];

		if (lease->id != 0)
			pen_sched_lose(sched, worker, lease,
				lease->started ? PEN_SCHED_FAULT_KILLED : PEN_SCHED_FAULT_RETURNED,
				"the worker was lost");
	}
	pen_sched_take_leave(sched, worker->id);
	while (sched->workers[place] != worker)
		place++;
	sched->workers[place] = sched->workers[--sched->worker_count];
	sched->lease_places -= worker->lease_max;
	free(worker);
}

/* A lease is renewed by progress alone; a worker that says nothing is the connection's concern. */
static void handle_progress(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, uint64_t samples)
{
	const struct pen_sched_turn *job = pen_sched_job_of(sched, lease);
	double quiet_ms = 4000.0 * pen_sched_predict(job, lease);

	if (!lease->started) {
		lease->started = true;
		lease->started_ms = lease->progress_ms = sched->now_ms;
	}
	if (samples > lease->samples) {
		lease->samples = samples;
		lease->progress_ms = sched->now_ms;
	}
	if (quiet_ms < PEN_LEASE_MS)
		quiet_ms = PEN_LEASE_MS;
	if ((double)(sched->now_ms - lease->progress_ms) > quiet_ms)
		pen_sched_expire(sched, worker, lease, PEN_SCHED_FAULT_OWN, "it made no progress");
}

static void handle_result(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, double seconds, uint64_t digest)
{
	struct pen_sched_turn *job = pen_sched_job_of(sched, lease);
	const struct pen_backlog *backlog = pen_reel_backlog(&job->reel, lease->frame);

	job->virtual_seconds += seconds / pen_sched_weight(job) - lease->charge;
	pen_sched_measure(job, seconds, (double)pen_backlog_samples(backlog, lease->tile));
	pen_sched_take_result(sched, worker, lease, digest);
}

/* Asks for a decision on each frame that waits for one, once. */
static void ask(struct pen_sched *sched, struct pen_sched_turn *job)
{
	for (uint32_t i = job->reel.first; i < job->reel.open; i++)
		if (pen_backlog_asks(pen_reel_backlog(&job->reel, i)))
			pen_sched_act(sched, PEN_SCHED_DECIDE, job)->frame = i;
}

/* Something of the job is merged or decided: it may be rendered now. */
static void advance(struct pen_sched *sched, struct pen_sched_turn *job)
{
	pen_reel_advance(&job->reel);
	ask(sched, job);
	if (job->reel.first < job->reel.end)
		return;
	(void)pen_sched_act(sched, PEN_SCHED_RENDERED, job);
	pen_sched_drop_job(sched, job);
}

static void handle_decided(struct pen_sched *sched, const struct pen_sched_event *event)
{
	struct pen_sched_turn *job = pen_sched_find_job(sched, event->job);

	if (!job || event->u.decided.frame < job->reel.first ||
		event->u.decided.frame >= job->reel.open)
		return;
	(void)pen_backlog_decided(
		pen_reel_backlog(&job->reel, event->u.decided.frame), event->u.decided.demands);
	advance(sched, job);
}

static void handle_merged(
	struct pen_sched *sched, struct pen_sched_turn *job, uint32_t frame, uint32_t tile)
{
	sched->merging--;
	(void)pen_backlog_merged(pen_reel_backlog(&job->reel, frame), tile);
	advance(sched, job);
}

/* A worker that never gets round to a lease, or never ends it, loses it. */
static void check_leases(struct pen_sched *sched, struct pen_sched_hand *worker)
{
	for (uint32_t i = 0; i < worker->lease_max; i++) {
		struct pen_sched_lease *lease = &worker->leases[i];

		if (lease->id == 0)
			continue;
		if (lease->started && sched->now_ms - lease->started_ms > PEN_LEASE_HARD_MS)
			pen_sched_expire(
				sched, worker, lease, PEN_SCHED_FAULT_OWN, "it took too long");
		else if (!lease->started && sched->now_ms - lease->granted_ms > PEN_LEASE_HARD_MS)
			pen_sched_expire(sched, worker, lease, PEN_SCHED_FAULT_RETURNED, "");
	}
}

/* A job outlives its class: when other workers are there it shall start again with them. */
static void check_class(struct pen_sched *sched, struct pen_sched_turn *job)
{
	bool others = false;

	for (size_t i = 0; i < sched->worker_count; i++) {
		if (pen_sched_serves(sched->workers[i], job)) {
			job->absent_ms = -1;
			return;
		}
		others = others || pen_sched_takes(sched->workers[i]);
	}
	if (job->paused)
		return;
	if (job->absent_ms < 0)
		job->absent_ms = sched->now_ms;
	if (!others || sched->now_ms - job->absent_ms < PEN_CLASS_ABSENT_MS)
		return;
	pen_sched_drop_job(sched, job);
	(void)pen_sched_act(sched, PEN_SCHED_ABANDONED, job);
}

static void handle_tick(struct pen_sched *sched)
{
	for (size_t i = 0; i < sched->worker_count; i++) {
		struct pen_sched_hand *worker = sched->workers[i];

		check_leases(sched, worker);
		/* On probation: the next strike sends it back. */
		if (worker->quarantined && sched->now_ms >= worker->release_ms)
			pen_sched_release(sched, worker, PEN_STRIKES_MAX - 1);
	}
	for (size_t i = sched->job_count; i-- > 0;) {
		ask(sched, sched->jobs[i]);
		check_class(sched, sched->jobs[i]);
	}
	pen_sched_check_disputes(sched);
}

static void handle_reset(struct pen_sched *sched, struct pen_sched_hand *worker)
{
	worker->draining = false;
	pen_sched_release(sched, worker, 0);
}

static void handle_worker(struct pen_sched *sched, const struct pen_sched_event *event)
{
	struct pen_sched_hand *worker = pen_sched_find_worker(sched, event->worker);
	struct pen_sched_lease *lease = worker ? find_lease(worker, event->lease) : NULL;

	if (worker && event->type == PEN_SCHED_WORKER_LEAVE)
		handle_leave(sched, worker);
	else if (worker && event->type == PEN_SCHED_WORKER_DRAIN)
		worker->draining = true;
	else if (worker && event->type == PEN_SCHED_WORKER_RESET)
		handle_reset(sched, worker);
	else if (lease && event->type == PEN_SCHED_PROGRESS)
		handle_progress(sched, worker, lease, event->u.samples);
	else if (lease && event->type == PEN_SCHED_RESULT)
		handle_result(sched, worker, lease, event->u.seconds, event->digest);
	else if (lease && event->type == PEN_SCHED_FAILURE)
		pen_sched_lose(
			sched, worker, lease, event->u.failure.fault, event->u.failure.reason);
}

struct pen_sched_actions pen_sched_step(
	struct pen_sched *sched, const struct pen_sched_event *event, int64_t now_ms)
{
	struct pen_sched_turn *job;

	bury(sched);
	sched->action_count = 0;
	sched->now_ms = now_ms;
	switch (event->type) {
	case PEN_SCHED_JOB_REMOVE:
	case PEN_SCHED_JOB_PAUSE:
	case PEN_SCHED_JOB_RESUME:
	case PEN_SCHED_JOB_PRIORITY: handle_job(sched, event); break;
	case PEN_SCHED_WORKER_LEAVE:
	case PEN_SCHED_WORKER_DRAIN:
	case PEN_SCHED_WORKER_RESET:
	case PEN_SCHED_PROGRESS:
	case PEN_SCHED_RESULT:
	case PEN_SCHED_FAILURE: handle_worker(sched, event); break;
	case PEN_SCHED_MERGED:
		job = pen_sched_find_job(sched, event->job);
		if (job)
			handle_merged(sched, job, event->u.merged.frame, event->u.merged.tile);
		break;
	case PEN_SCHED_DECIDED: handle_decided(sched, event); break;
	case PEN_SCHED_TICK: handle_tick(sched); break;
	}
	pen_sched_grant_leases(sched);
	if (event->type == PEN_SCHED_TICK)
		pen_sched_double_stragglers(sched);
	return (struct pen_sched_actions){sched->actions, sched->action_count};
}

const struct pen_sched_lease *pen_sched_find_lease(
	const struct pen_sched *sched, uint64_t worker, uint64_t lease)
{
	struct pen_sched_hand *holder = pen_sched_find_worker(sched, worker);

	return holder ? find_lease(holder, lease) : NULL;
}

size_t pen_sched_held(
	const struct pen_sched *sched, uint64_t job, struct pen_sched_held *ret_held, size_t max)
{
	size_t count = 0;

	for (size_t i = 0; i < sched->worker_count; i++) {
		const struct pen_sched_hand *worker = sched->workers[i];

		for (uint32_t k = 0; k < worker->lease_max && count < max; k++) {
			const struct pen_sched_lease *lease = &worker->leases[k];

			if (lease->id != 0 && lease->job == job && lease->begun_ms >= 0)
				ret_held[count++] = (struct pen_sched_held){
					worker->id, lease->frame, lease->tile};
		}
	}
	return count;
}

uint64_t pen_sched_waiting(const struct pen_sched *sched)
{
	uint64_t count = 0;

	for (size_t i = 0; i < sched->job_count; i++)
		if (!sched->jobs[i]->paused)
			count += pen_reel_waiting(&sched->jobs[i]->reel);
	return count;
}

bool pen_sched_lacks_class(const struct pen_sched *sched)
{
	for (size_t i = 0; i < sched->job_count; i++)
		if (!sched->jobs[i]->paused && sched->jobs[i]->absent_ms >= 0)
			return true;
	return false;
}

uint32_t pen_sched_processes(const struct pen_sched *sched)
{
	uint32_t count = 0;

	for (size_t i = 0; i < sched->worker_count; i++)
		if (pen_sched_takes(sched->workers[i]))
			count += sched->workers[i]->processes;
	return count;
}
