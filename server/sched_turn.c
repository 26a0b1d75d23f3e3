/* SPDX-License-Identifier: Apache-2.0 */
#include "server/sched_state.h"

#include <stdio.h>
#include <string.h>

/* How far ahead, in virtual seconds, a job may get before a waiting one takes its place. */
#define TURN_SECONDS 0.1

bool pen_sched_serves(const struct pen_sched_hand *worker, const struct pen_sched_turn *job)
{
	return pen_sched_takes(worker) &&
	       (job->equivalence_class[0] == '\0' ||
		       strcmp(worker->equivalence_class, job->equivalence_class) == 0);
}

/* Whether a tile that failed on worker had better wait for another one. */
static bool avoids(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_backlog *backlog, uint32_t tile, const struct pen_sched_hand *worker)
{
	if (!pen_backlog_failed_on(backlog, tile, worker->id))
		return false;
	for (size_t i = 0; i < sched->worker_count; i++) {
		const struct pen_sched_hand *other = sched->workers[i];

		if (pen_sched_serves(other, job) &&
			!pen_backlog_failed_on(backlog, tile, other->id) &&
			pen_sched_may_opine(sched, job, backlog, tile, other))
			return true;
	}
	return false;
}

static bool suits(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_backlog *backlog, uint32_t tile, const struct pen_sched_hand *worker)
{
	return !avoids(sched, job, backlog, tile, worker) &&
	       pen_sched_may_opine(sched, job, backlog, tile, worker);
}

/* A unit that waits: its place in the queue of its frame. */
struct unit {
	uint32_t frame, place;
};

static bool find_unit_of_frame(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_sched_hand *worker, struct unit *unit)
{
	const struct pen_backlog *backlog = pen_reel_backlog(&job->reel, unit->frame);
	const struct pen_tile_queue *waiting = &backlog->waiting;
	bool found = false;

	for (uint32_t i = 0; i < waiting->count; i++) {
		if (!suits(sched, job, backlog, pen_tile_queue_at(waiting, i), worker))
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
static bool find_unit(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_sched_hand *worker, struct unit *ret_unit)
{
	struct unit unit = {.frame = job->reel.first};

	for (; unit.frame < job->reel.open; unit.frame++)
		if (find_unit_of_frame(sched, job, worker, &unit)) {
			*ret_unit = unit;
			return true;
		}
	return false;
}

static uint64_t class_processes(const struct pen_sched *sched, const char *equivalence_class)
{
	uint64_t count = 0;

	for (size_t i = 0; i < sched->worker_count; i++)
		if (pen_sched_takes(sched->workers[i]) &&
			strcmp(sched->workers[i]->equivalence_class, equivalence_class) == 0)
			count += sched->workers[i]->processes;
	return count;
}

/* A new job is begun by whoever is free; one that has lost its class shall not choose a poor one.
 */
static bool may_start(const struct pen_sched *sched, const struct pen_sched_hand *worker,
	const struct pen_sched_turn *job)
{
	uint64_t own;

	if (!job->restarted || job->equivalence_class[0] != '\0')
		return true;
	own = class_processes(sched, worker->equivalence_class);
	for (size_t i = 0; i < sched->worker_count; i++)
		if (class_processes(sched, sched->workers[i]->equivalence_class) > own)
			return false;
	return true;
}

/* Whose turn it is among the jobs that have a unit for worker; NULL when there is none. */
static struct pen_sched_turn *choose_job(
	struct pen_sched *sched, const struct pen_sched_hand *worker)
{
	struct pen_sched_turn *turn = NULL, *waiting = NULL, *ahead = NULL;
	uint32_t active = 0;
	struct unit unit;

	for (size_t i = 0; i < sched->job_count; i++) {
		struct pen_sched_turn *job = sched->jobs[i];
		struct pen_sched_turn **best = job->active ? &turn : &waiting;

		if (job->paused || !pen_sched_serves(worker, job) || !may_start(sched, worker, job))
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

static void start_job(
	struct pen_sched *sched, struct pen_sched_turn *job, const struct pen_sched_hand *worker)
{
	(void)snprintf(job->equivalence_class, sizeof job->equivalence_class, "%s",
		worker->equivalence_class);
	job->started = true;
	pen_sched_act(sched, PEN_SCHED_STARTED, job)->text = job->equivalence_class;
}

/* A lease on a tile that is out. */
static struct pen_sched_lease *lend(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_turn *job, uint32_t frame, uint32_t tile)
{
	const struct pen_backlog *backlog = pen_reel_backlog(&job->reel, frame);
	struct pen_sched_lease *lease = worker->leases;
	struct pen_sched_action *action;

	while (lease->id != 0)
		lease++;
	*lease = (struct pen_sched_lease){
		.id = ++sched->lease_last,
		.job = job->number,
		.frame = frame,
		.tile = tile,
		.round = pen_backlog_round(backlog, tile),
		.epoch = pen_backlog_epoch(backlog, tile),
		.granted_ms = sched->now_ms,
		.begun_ms = -1,
	};
	worker->lease_count++;
	pen_sched_note_begin(sched, worker);

	action = pen_sched_act(sched, PEN_SCHED_LEASE, job);
	action->worker = worker->id;
	action->lease = lease->id;
	action->frame = frame;
	action->tile = tile;
	action->round = lease->round;
	action->epoch = lease->epoch;
	return lease;
}

static void grant(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_turn *job, const struct unit *unit)
{
	struct pen_sched_lease *lease;

	if (!job->started)
		start_job(sched, job, worker);
	lease = lend(sched, worker, job, unit->frame,
		pen_backlog_take(pen_reel_backlog(&job->reel, unit->frame), unit->place));
	lease->charge = pen_sched_predict(job, lease) / pen_sched_weight(job);
	sched->virtual_seconds = job->virtual_seconds;
	job->virtual_seconds += lease->charge;
	pen_reel_advance(&job->reel);
}

/* The worker with the fewest leases a process, so that nobody idles while another hoards. */
static struct pen_sched_hand *least_loaded(const struct pen_sched *sched)
{
	struct pen_sched_hand *best = NULL;

	for (size_t i = 0; i < sched->worker_count; i++) {
		struct pen_sched_hand *worker = sched->workers[i];

		if (worker->idle || !pen_sched_takes(worker) ||
			worker->lease_count == worker->lease_max)
			continue;
		if (!best || (uint64_t)worker->lease_count * best->processes <
				     (uint64_t)best->lease_count * worker->processes)
			best = worker;
	}
	return best;
}

void pen_sched_grant_leases(struct pen_sched *sched)
{
	struct pen_sched_hand *worker;
	struct unit unit;
	struct pen_sched_turn *job;

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

/* Stragglers */

/* Whether nothing but stragglers can be left of a frame: three quarters of its tiles are done. */
static bool is_at_tail(const struct pen_backlog *backlog)
{
	return backlog->waiting.count == 0 && 4 * (uint64_t)backlog->out <= backlog->tiling.count;
}

/* Whether worker had better render the unit of a lease of another one once more. */
static bool may_double(const struct pen_sched *sched, const struct pen_sched_hand *worker,
	const struct pen_sched_lease *lease)
{
	const struct pen_sched_turn *job;
	const struct pen_backlog *backlog;

	if (lease->id == 0 || lease->doubled)
		return false;
	job = pen_sched_job_of(sched, lease);
	backlog = pen_reel_backlog(&job->reel, lease->frame);
	return pen_sched_serves(worker, job) && is_at_tail(backlog) &&
	       !pen_backlog_failed_on(backlog, lease->tile, worker->id) &&
	       !pen_backlog_has_opinion(backlog, lease->tile, worker->id) &&
	       pen_sched_lateness(sched, job, lease) > PEN_STRAGGLER_LATENESS;
}

/* The latest of all units that other workers are at; NULL when nobody straggles. */
static struct pen_sched_lease *find_straggler(
	const struct pen_sched *sched, const struct pen_sched_hand *worker)
{
	struct pen_sched_lease *latest = NULL;
	double lateness = 0;

	for (size_t i = 0; i < sched->worker_count; i++) {
		struct pen_sched_hand *other = sched->workers[i];

		if (other == worker || other->lease_count == 0)
			continue;
		for (uint32_t k = 0; k < other->lease_max; k++) {
			struct pen_sched_lease *lease = &other->leases[k];
			double its;

			if (!may_double(sched, worker, lease))
				continue;
			its = pen_sched_lateness(sched, pen_sched_job_of(sched, lease), lease);
			if (its > lateness) {
				latest = lease;
				lateness = its;
			}
		}
	}
	return latest;
}

/*
 * A process that would idle renders what another worker should have finished long since: whoever
 * comes first wins, their pixels are the same. The job is not charged for it.
 */
static void double_stragglers_with(struct pen_sched *sched, struct pen_sched_hand *worker)
{
	struct pen_sched_lease *late;

	while (worker->lease_count < worker->processes &&
		(late = find_straggler(sched, worker)) != NULL) {
		struct pen_sched_turn *job = pen_sched_job_of(sched, late);

		late->doubled = true;
		lend(sched, worker, job, late->frame, late->tile)->doubled = true;
	}
}

void pen_sched_double_stragglers(struct pen_sched *sched)
{
	for (size_t i = 0; i < sched->worker_count; i++)
		if (pen_sched_takes(sched->workers[i]))
			double_stragglers_with(sched, sched->workers[i]);
}
