/* SPDX-License-Identifier: Apache-2.0 */
#include "server/sched.h"

#include "core/base/limits.h"
#include "server/reel.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How far ahead, in virtual seconds, a job may get before a waiting one takes its place. */
#define TURN_SECONDS 0.1

/* What a unit is taken to cost while none of its job has been measured. */
#define UNMEASURED_SECONDS 0.01

struct job {
	uint64_t number;
	struct pen_reel reel;
	uint32_t priority;
	bool paused;
	bool started; /* it has had a lease since it was added */
	bool active;
	char equivalence_class[PEN_CLASS_BYTES_MAX + 1]; /* "": not chosen yet */
	int64_t absent_ms;	   /* since when its class is absent; < 0: it is not */
	double virtual_seconds;	   /* render seconds over weight, leased units included */
	double seconds_per_sample; /* measured; 0: not yet */
	struct pen_error reason;
	struct job *next; /* of the dropped ones */
};

struct worker {
	uint64_t id;
	uint32_t processes;
	char equivalence_class[PEN_CLASS_BYTES_MAX + 1];
	bool draining;
	bool idle; /* there is nothing for it in this step */
	uint32_t lease_count, lease_max;
	struct pen_sched_lease leases[]; /* lease_max */
};

struct pen_sched {
	struct job **jobs;
	size_t job_count, job_capacity;
	struct worker **workers;
	size_t worker_count, worker_capacity;
	struct pen_sched_action *actions;
	size_t action_count, action_capacity;
	size_t lease_places; /* of all workers */
	struct job *dropped; /* freed by the next step: actions point into them */
	uint64_t lease_last;
	uint32_t merging;
	double virtual_seconds; /* of the job leased from last: where a new one starts */
	int64_t now_ms;
};

int pen_sched_create(struct pen_sched **ret_sched, struct pen_error *err)
{
	struct pen_sched *sched = calloc(1, sizeof *sched);

	if (!sched)
		return pen_error_memory(err);
	*ret_sched = sched;
	return 0;
}

static void job_destroy(struct job *job)
{
	if (!job)
		return;
	pen_reel_finish(&job->reel);
	free(job);
}

static void bury(struct pen_sched *sched)
{
	while (sched->dropped) {
		struct job *job = sched->dropped;

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
 * A step ends each lease and fills its place at most once, says at most two things of a job, and
 * asks for each of its frames.
 */
static int reserve_actions(struct pen_sched *sched, size_t more_leases, size_t more_jobs)
{
	size_t count = 2 * (sched->lease_places + more_leases) +
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
	struct job *job = calloc(1, sizeof *job);
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
	job->absent_ms = -1;
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
	struct worker *worker = calloc(1, sizeof *worker + lease_max * sizeof *worker->leases);

	assert(given->processes <= PEN_PROCESSES_MAX);
	if (!worker || reserve_worker(sched, lease_max) < 0) {
		free(worker);
		return pen_error_memory(err);
	}
	worker->id = given->id;
	worker->processes = given->processes;
	worker->lease_max = lease_max;
	(void)snprintf(worker->equivalence_class, sizeof worker->equivalence_class, "%s",
		given->equivalence_class);
	sched->workers[sched->worker_count++] = worker;
	sched->lease_places += lease_max;
	return 0;
}

static struct job *find_job(const struct pen_sched *sched, uint64_t number)
{
	for (size_t i = 0; i < sched->job_count; i++)
		if (sched->jobs[i]->number == number)
			return sched->jobs[i];
	return NULL;
}

/* A lease lives no longer than its job. */
static struct job *job_of(const struct pen_sched *sched, const struct pen_sched_lease *lease)
{
	struct job *job = find_job(sched, lease->job);

	assert(job);
	return job;
}

static struct worker *find_worker(const struct pen_sched *sched, uint64_t id)
{
	for (size_t i = 0; i < sched->worker_count; i++)
		if (sched->workers[i]->id == id)
			return sched->workers[i];
	return NULL;
}

static struct pen_sched_lease *find_lease(struct worker *worker, uint64_t id)
{
	for (uint32_t i = 0; id != 0 && i < worker->lease_max; i++)
		if (worker->leases[i].id == id)
			return &worker->leases[i];
	return NULL;
}

static struct pen_sched_action *act(
	struct pen_sched *sched, enum pen_sched_action_type type, const struct job *job)
{
	struct pen_sched_action *action = &sched->actions[sched->action_count++];

	assert(sched->action_count <= sched->action_capacity);
	*action = (struct pen_sched_action){.type = type, .job = job->number};
	return action;
}

static double predicted_seconds(const struct job *job, const struct pen_sched_lease *lease)
{
	if (job->seconds_per_sample <= 0)
		return UNMEASURED_SECONDS;
	return job->seconds_per_sample *
	       (double)pen_backlog_samples(pen_reel_backlog(&job->reel, lease->frame), lease->tile);
}

static double weight(const struct job *job)
{
	return 1.0 + job->priority;
}

/* Leases end */

static void end_lease(struct worker *worker, struct pen_sched_lease *lease)
{
	worker->lease_count--;
	*lease = (struct pen_sched_lease){0};
}

static void revoke(struct pen_sched *sched, struct worker *worker, struct pen_sched_lease *lease,
	const struct job *job)
{
	struct pen_sched_action *action = act(sched, PEN_SCHED_REVOKE, job);

	action->worker = worker->id;
	action->lease = lease->id;
	end_lease(worker, lease);
}

/* The unit of a lease that brought nothing waits again; nobody pays for it. */
static void requeue(struct job *job, const struct pen_sched_lease *lease)
{
	job->virtual_seconds -= lease->charge;
	pen_backlog_return(pen_reel_backlog(&job->reel, lease->frame), lease->tile);
}

static void revoke_all(struct pen_sched *sched, struct job *job)
{
	for (size_t i = 0; i < sched->worker_count; i++) {
		struct worker *worker = sched->workers[i];

		for (uint32_t k = 0; k < worker->lease_max; k++) {
			struct pen_sched_lease *lease = &worker->leases[k];

			if (lease->id == 0 || lease->job != job->number)
				continue;
			requeue(job, lease);
			revoke(sched, worker, lease, job);
		}
	}
}

/* The job leaves; its memory stays for the actions of this step. */
static void drop_job(struct pen_sched *sched, struct job *job)
{
	size_t place = 0;

	revoke_all(sched, job);
	sched->merging -= pen_reel_merging(&job->reel);
	while (sched->jobs[place] != job)
		place++;
	sched->jobs[place] = sched->jobs[--sched->job_count];
	job->next = sched->dropped;
	sched->dropped = job;
}

static void fail_job(struct pen_sched *sched, struct job *job)
{
	act(sched, PEN_SCHED_FAILED, job)->text = job->reason.text;
	drop_job(sched, job);
}

static void tell_blame(struct job *job, const struct pen_sched_lease *lease, const char *reason)
{
	struct pen_rect rect =
		pen_tiling_rect(&pen_reel_backlog(&job->reel, lease->frame)->tiling, lease->tile);

	(void)pen_error_set(&job->reason, PEN_EIO,
		"tile %u of frame %u (pixels %u,%u to %u,%u) failed %u times; the last time: %s",
		lease->tile, lease->frame, rect.x0, rect.y0, rect.x1, rect.y1, PEN_BLAME_MAX,
		reason);
}

/* Ends a lease without pixels, whatever the fault. */
static void lose_unit(struct pen_sched *sched, struct worker *worker, struct pen_sched_lease *lease,
	enum pen_sched_fault fault, const char *reason)
{
	struct job *job = job_of(sched, lease);
	struct pen_backlog *backlog = pen_reel_backlog(&job->reel, lease->frame);
	bool survives = true;

	if (fault == PEN_SCHED_FAULT_KILLED && !pen_backlog_excuse(backlog, lease->tile))
		fault = PEN_SCHED_FAULT_OWN;
	if (fault == PEN_SCHED_FAULT_SCENE) {
		(void)pen_error_set(&job->reason, PEN_EINVALID, "%s", reason);
		survives = false;
	} else if (fault == PEN_SCHED_FAULT_OWN) {
		survives = pen_backlog_blame(backlog, lease->tile, worker->id);
		if (!survives)
			tell_blame(job, lease, reason);
	}
	requeue(job, lease);
	end_lease(worker, lease);
	if (!survives)
		fail_job(sched, job);
}

/* Leases begin */

static bool serves(const struct worker *worker, const struct job *job)
{
	return !worker->draining &&
	       (job->equivalence_class[0] == '\0' ||
		       strcmp(worker->equivalence_class, job->equivalence_class) == 0);
}

/* Whether a tile that failed on worker had better wait for another one. */
static bool avoids(const struct pen_sched *sched, const struct job *job,
	const struct pen_backlog *backlog, uint32_t tile, const struct worker *worker)
{
	if (!pen_backlog_failed_on(backlog, tile, worker->id))
		return false;
	for (size_t i = 0; i < sched->worker_count; i++) {
		const struct worker *other = sched->workers[i];

		if (serves(other, job) && !pen_backlog_failed_on(backlog, tile, other->id))
			return true;
	}
	return false;
}

/* A unit that waits: its place in the queue of its frame. */
struct unit {
	uint32_t frame, place;
};

static bool find_unit_of_frame(const struct pen_sched *sched, const struct job *job,
	const struct worker *worker, struct unit *unit)
{
	const struct pen_backlog *backlog = pen_reel_backlog(&job->reel, unit->frame);
	const struct pen_tile_queue *waiting = &backlog->waiting;
	bool found = false;

	for (uint32_t i = 0; i < waiting->count; i++) {
		if (avoids(sched, job, backlog, pen_tile_queue_at(waiting, i), worker))
			continue;
		if (!found || pen_tile_queue_before(waiting, i, unit->place))
			unit->place = i;
		found = true;
		if (i == 0)
			break;
	}
	return found;
}

/* The job's best unit for worker; false when there is none. */
static bool find_unit(const struct pen_sched *sched, const struct job *job,
	const struct worker *worker, struct unit *ret_unit)
{
	struct unit unit = {.frame = job->reel.first};

	for (; unit.frame < job->reel.open; unit.frame++)
		if (find_unit_of_frame(sched, job, worker, &unit)) {
			*ret_unit = unit;
			return true;
		}
	return false;
}

/* Whose turn it is among the jobs that have a unit for worker; NULL when there is none. */
static struct job *choose_job(struct pen_sched *sched, const struct worker *worker)
{
	struct job *turn = NULL, *waiting = NULL, *ahead = NULL;
	uint32_t active = 0;
	struct unit unit;

	for (size_t i = 0; i < sched->job_count; i++) {
		struct job *job = sched->jobs[i];
		struct job **best = job->active ? &turn : &waiting;

		if (job->paused || !serves(worker, job))
			continue;
		active += job->active;
		if (job->active && (!ahead || job->virtual_seconds > ahead->virtual_seconds))
			ahead = job;
		if ((!*best || job->virtual_seconds < (*best)->virtual_seconds) &&
			find_unit(sched, job, worker, &unit))
			*best = job;
	}
	if (!waiting)
		return turn;
	if (turn && active >= PEN_SCHED_JOBS_ACTIVE) {
		if (ahead->virtual_seconds - waiting->virtual_seconds < TURN_SECONDS)
			return turn;
		ahead->active = false;
	}
	waiting->active = true;
	return !turn || waiting->virtual_seconds < turn->virtual_seconds ? waiting : turn;
}

static void start_job(struct pen_sched *sched, struct job *job, const struct worker *worker)
{
	(void)snprintf(job->equivalence_class, sizeof job->equivalence_class, "%s",
		worker->equivalence_class);
	job->started = true;
	act(sched, PEN_SCHED_STARTED, job)->text = job->equivalence_class;
}

static void grant(
	struct pen_sched *sched, struct worker *worker, struct job *job, const struct unit *unit)
{
	struct pen_backlog *backlog = pen_reel_backlog(&job->reel, unit->frame);
	struct pen_sched_lease *lease = worker->leases;
	struct pen_sched_action *action;
	uint32_t tile;

	if (!job->started)
		start_job(sched, job, worker);
	while (lease->id != 0)
		lease++;
	tile = pen_backlog_take(backlog, unit->place);
	*lease = (struct pen_sched_lease){
		.id = ++sched->lease_last,
		.job = job->number,
		.frame = unit->frame,
		.tile = tile,
		.round = pen_backlog_round(backlog, tile),
		.epoch = pen_backlog_epoch(backlog, tile),
		.granted_ms = sched->now_ms,
	};
	lease->charge = predicted_seconds(job, lease) / weight(job);
	sched->virtual_seconds = job->virtual_seconds;
	job->virtual_seconds += lease->charge;
	worker->lease_count++;
	pen_reel_advance(&job->reel);

	action = act(sched, PEN_SCHED_LEASE, job);
	action->worker = worker->id;
	action->lease = lease->id;
	action->frame = unit->frame;
	action->tile = tile;
	action->round = lease->round;
	action->epoch = lease->epoch;
}

/* The worker with the fewest leases a process, so that nobody idles while another hoards. */
static struct worker *least_loaded(const struct pen_sched *sched)
{
	struct worker *best = NULL;

	for (size_t i = 0; i < sched->worker_count; i++) {
		struct worker *worker = sched->workers[i];

		if (worker->idle || worker->draining || worker->lease_count == worker->lease_max)
			continue;
		if (!best || (uint64_t)worker->lease_count * best->processes <
				     (uint64_t)best->lease_count * worker->processes)
			best = worker;
	}
	return best;
}

static void grant_leases(struct pen_sched *sched)
{
	struct worker *worker;
	struct unit unit;
	struct job *job;

	for (size_t i = 0; i < sched->worker_count; i++)
		sched->workers[i]->idle = false;
	while (sched->merging < PEN_MERGING_MAX && (worker = least_loaded(sched)) != NULL) {
		job = choose_job(sched, worker);
		if (job && find_unit(sched, job, worker, &unit))
			grant(sched, worker, job, &unit);
		else
			worker->idle = true;
	}
}

/* Events */

static void handle_job(struct pen_sched *sched, const struct pen_sched_event *event)
{
	struct job *job = find_job(sched, event->job);

	if (!job)
		return;
	switch (event->type) {
	case PEN_SCHED_JOB_REMOVE: drop_job(sched, job); break;
	case PEN_SCHED_JOB_PAUSE:
		job->paused = true;
		job->active = false;
		revoke_all(sched, job);
		break;
	case PEN_SCHED_JOB_RESUME:
		job->paused = false;
		if (job->virtual_seconds < sched->virtual_seconds)
			job->virtual_seconds = sched->virtual_seconds;
		break;
	default: job->priority = event->u.priority; break;
	}
}

static void handle_leave(struct pen_sched *sched, struct worker *worker)
{
	size_t place = 0;

	/* Only what it was rendering may have killed it. */
	for (uint32_t i = 0; i < worker->lease_max; i++) {
		struct pen_sched_lease *lease = &worker->leases[i];

		if (lease->id != 0)
			lose_unit(sched, worker, lease,
				lease->started ? PEN_SCHED_FAULT_KILLED : PEN_SCHED_FAULT_RETURNED,
				"the worker was lost");
	}
	while (sched->workers[place] != worker)
		place++;
	sched->workers[place] = sched->workers[--sched->worker_count];
	sched->lease_places -= worker->lease_max;
	free(worker);
}

static void expire(struct pen_sched *sched, struct worker *worker, struct pen_sched_lease *lease,
	enum pen_sched_fault fault, const char *reason)
{
	struct pen_sched_action *action = act(sched, PEN_SCHED_REVOKE, job_of(sched, lease));

	action->worker = worker->id;
	action->lease = lease->id;
	lose_unit(sched, worker, lease, fault, reason);
}

/* A lease is renewed by progress alone; a worker that says nothing is the connection's concern. */
static void handle_progress(struct pen_sched *sched, struct worker *worker,
	struct pen_sched_lease *lease, uint64_t samples)
{
	const struct job *job = job_of(sched, lease);
	double quiet_ms = 4000.0 * predicted_seconds(job, lease);

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
		expire(sched, worker, lease, PEN_SCHED_FAULT_OWN, "it made no progress");
}

static void handle_result(struct pen_sched *sched, struct worker *worker,
	struct pen_sched_lease *lease, double seconds)
{
	struct job *job = job_of(sched, lease);
	struct pen_backlog *backlog = pen_reel_backlog(&job->reel, lease->frame);
	double samples = (double)pen_backlog_samples(backlog, lease->tile);

	job->virtual_seconds += seconds / weight(job) - lease->charge;
	job->seconds_per_sample += (job->seconds_per_sample > 0 ? 0.25 : 1.0) *
				   (seconds / samples - job->seconds_per_sample);
	pen_backlog_deliver(backlog, lease->tile);
	sched->merging++;
	end_lease(worker, lease);
}

/* Asks for a decision on each frame that waits for one, once. */
static void ask(struct pen_sched *sched, struct job *job)
{
	for (uint32_t i = job->reel.first; i < job->reel.open; i++)
		if (pen_backlog_asks(pen_reel_backlog(&job->reel, i)))
			act(sched, PEN_SCHED_DECIDE, job)->frame = i;
}

/* Something of the job is merged or decided: it may be rendered now. */
static void advance(struct pen_sched *sched, struct job *job)
{
	pen_reel_advance(&job->reel);
	ask(sched, job);
	if (job->reel.first < job->reel.end)
		return;
	(void)act(sched, PEN_SCHED_RENDERED, job);
	drop_job(sched, job);
}

static void handle_decided(struct pen_sched *sched, const struct pen_sched_event *event)
{
	struct job *job = find_job(sched, event->job);

	if (!job || event->u.decided.frame < job->reel.first ||
		event->u.decided.frame >= job->reel.open)
		return;
	(void)pen_backlog_decided(
		pen_reel_backlog(&job->reel, event->u.decided.frame), event->u.decided.demands);
	advance(sched, job);
}

static void handle_merged(struct pen_sched *sched, struct job *job, uint32_t frame, uint32_t tile)
{
	sched->merging--;
	(void)pen_backlog_merged(pen_reel_backlog(&job->reel, frame), tile);
	advance(sched, job);
}

/* A worker that never gets round to a lease, or never ends it, loses it. */
static void check_leases(struct pen_sched *sched, struct worker *worker)
{
	for (uint32_t i = 0; i < worker->lease_max; i++) {
		struct pen_sched_lease *lease = &worker->leases[i];

		if (lease->id == 0)
			continue;
		if (lease->started && sched->now_ms - lease->started_ms > PEN_LEASE_HARD_MS)
			expire(sched, worker, lease, PEN_SCHED_FAULT_OWN, "it took too long");
		else if (!lease->started && sched->now_ms - lease->granted_ms > PEN_LEASE_HARD_MS)
			expire(sched, worker, lease, PEN_SCHED_FAULT_RETURNED, "");
	}
}

/* A job outlives its class: when other workers are there it shall start again with them. */
static void check_class(struct pen_sched *sched, struct job *job)
{
	bool others = false;

	for (size_t i = 0; i < sched->worker_count; i++) {
		if (serves(sched->workers[i], job)) {
			job->absent_ms = -1;
			return;
		}
		others = others || !sched->workers[i]->draining;
	}
	if (job->paused)
		return;
	if (job->absent_ms < 0)
		job->absent_ms = sched->now_ms;
	if (!others || sched->now_ms - job->absent_ms < PEN_CLASS_ABSENT_MS)
		return;
	(void)act(sched, PEN_SCHED_ABANDONED, job);
	drop_job(sched, job);
}

static void handle_tick(struct pen_sched *sched)
{
	for (size_t i = 0; i < sched->worker_count; i++)
		check_leases(sched, sched->workers[i]);
	for (size_t i = sched->job_count; i-- > 0;) {
		ask(sched, sched->jobs[i]);
		check_class(sched, sched->jobs[i]);
	}
}

static void handle_worker(struct pen_sched *sched, const struct pen_sched_event *event)
{
	struct worker *worker = find_worker(sched, event->worker);
	struct pen_sched_lease *lease = worker ? find_lease(worker, event->lease) : NULL;

	if (worker && event->type == PEN_SCHED_WORKER_LEAVE)
		handle_leave(sched, worker);
	else if (worker && event->type == PEN_SCHED_WORKER_DRAIN)
		worker->draining = true;
	else if (lease && event->type == PEN_SCHED_PROGRESS)
		handle_progress(sched, worker, lease, event->u.samples);
	else if (lease && event->type == PEN_SCHED_RESULT)
		handle_result(sched, worker, lease, event->u.seconds);
	else if (lease && event->type == PEN_SCHED_FAILURE)
		lose_unit(sched, worker, lease, event->u.failure.fault, event->u.failure.reason);
}

struct pen_sched_actions pen_sched_step(
	struct pen_sched *sched, const struct pen_sched_event *event, int64_t now_ms)
{
	struct job *job;

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
	case PEN_SCHED_PROGRESS:
	case PEN_SCHED_RESULT:
	case PEN_SCHED_FAILURE: handle_worker(sched, event); break;
	case PEN_SCHED_MERGED:
		job = find_job(sched, event->job);
		if (job)
			handle_merged(sched, job, event->u.merged.frame, event->u.merged.tile);
		break;
	case PEN_SCHED_DECIDED: handle_decided(sched, event); break;
	case PEN_SCHED_TICK: handle_tick(sched); break;
	}
	grant_leases(sched);
	return (struct pen_sched_actions){sched->actions, sched->action_count};
}

const struct pen_sched_lease *pen_sched_find_lease(
	const struct pen_sched *sched, uint64_t worker, uint64_t lease)
{
	struct worker *holder = find_worker(sched, worker);

	return holder ? find_lease(holder, lease) : NULL;
}

uint64_t pen_sched_waiting(const struct pen_sched *sched)
{
	uint64_t count = 0;

	for (size_t i = 0; i < sched->job_count; i++)
		if (!sched->jobs[i]->paused)
			count += pen_reel_waiting(&sched->jobs[i]->reel);
	return count;
}

uint32_t pen_sched_processes(const struct pen_sched *sched)
{
	uint32_t count = 0;

	for (size_t i = 0; i < sched->worker_count; i++)
		if (!sched->workers[i]->draining)
			count += sched->workers[i]->processes;
	return count;
}
