/* SPDX-License-Identifier: Apache-2.0 */
#include "server/sched_state.h"

#include <assert.h>

static void end_lease(
	const struct pen_sched *sched, struct pen_sched_hand *worker, struct pen_sched_lease *lease)
{
	worker->lease_count--;
	*lease = (struct pen_sched_lease){0};
	pen_sched_note_begin(sched, worker);
}

static void revoke(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, const struct pen_sched_turn *job)
{
	struct pen_sched_action *action = pen_sched_act(sched, PEN_SCHED_REVOKE, job);

	action->worker = worker->id;
	action->lease = lease->id;
	end_lease(sched, worker, lease);
}

/* The other lease of a unit that two workers are at; NULL when it has gone. */
static struct pen_sched_lease *find_twin(const struct pen_sched *sched,
	const struct pen_sched_lease *lease, struct pen_sched_hand **ret_worker)
{
	for (size_t i = 0; lease->doubled && i < sched->worker_count; i++)
		for (uint32_t k = 0; k < sched->workers[i]->lease_max; k++) {
			struct pen_sched_lease *other = &sched->workers[i]->leases[k];

			if (other->id == 0 || other->id == lease->id || other->job != lease->job ||
				other->frame != lease->frame || other->tile != lease->tile)
				continue;
			*ret_worker = sched->workers[i];
			return other;
		}
	return NULL;
}

/* The unit of a lease that brought nothing waits again, or is left to its twin; nobody pays. */
static void requeue(
	struct pen_sched *sched, struct pen_sched_turn *job, const struct pen_sched_lease *lease)
{
	struct pen_sched_hand *holder;
	struct pen_sched_lease *twin = find_twin(sched, lease, &holder);

	job->virtual_seconds -= lease->charge;
	if (twin)
		twin->doubled = false;
	else
		pen_backlog_return(pen_reel_backlog(&job->reel, lease->frame), lease->tile);
}

void pen_sched_revoke_all(struct pen_sched *sched, struct pen_sched_turn *job)
{
	for (size_t i = 0; i < sched->worker_count; i++) {
		struct pen_sched_hand *worker = sched->workers[i];

		for (uint32_t k = 0; k < worker->lease_max; k++) {
			struct pen_sched_lease *lease = &worker->leases[k];

			if (lease->id == 0 || lease->job != job->number)
				continue;
			requeue(sched, job, lease);
			revoke(sched, worker, lease, job);
		}
	}
}

void pen_sched_drop_job(struct pen_sched *sched, struct pen_sched_turn *job)
{
	size_t place = 0;

	pen_sched_revoke_all(sched, job);
	sched->merging -= pen_reel_merging(&job->reel);
	while (sched->jobs[place] != job)
		place++;
	sched->jobs[place] = sched->jobs[--sched->job_count];
	job->next = sched->dropped;
	sched->dropped = job;
}

void pen_sched_fail_job(struct pen_sched *sched, struct pen_sched_turn *job)
{
	pen_sched_act(sched, PEN_SCHED_FAILED, job)->text = job->reason.text;
	pen_sched_drop_job(sched, job);
}

static void tell_blame(
	struct pen_sched_turn *job, const struct pen_sched_lease *lease, const char *reason)
{
	struct pen_rect rect =
		pen_tiling_rect(&pen_reel_backlog(&job->reel, lease->frame)->tiling, lease->tile);

	(void)pen_error_set(&job->reason, PEN_EIO,
		"tile %u of frame %u (pixels %u,%u to %u,%u) failed %u times; the last time: %s",
		lease->tile, lease->frame, rect.x0, rect.y0, rect.x1, rect.y1, PEN_BLAME_MAX,
		reason);
}

void pen_sched_lose(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, enum pen_sched_fault fault, const char *reason)
{
	struct pen_sched_turn *job = pen_sched_job_of(sched, lease);
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
	requeue(sched, job, lease);
	end_lease(sched, worker, lease);
	if (!survives)
		pen_sched_fail_job(sched, job);
}

void pen_sched_expire(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, enum pen_sched_fault fault, const char *reason)
{
	struct pen_sched_action *action =
		pen_sched_act(sched, PEN_SCHED_REVOKE, pen_sched_job_of(sched, lease));

	action->worker = worker->id;
	action->lease = lease->id;
	pen_sched_lose(sched, worker, lease, fault, reason);
}

static void tell_of(struct pen_sched *sched, enum pen_sched_action_type type,
	const struct pen_sched_hand *worker)
{
	struct pen_sched_action *action = &sched->actions[sched->action_count++];

	assert(sched->action_count <= sched->action_capacity);
	*action = (struct pen_sched_action){.type = type, .worker = worker->id};
}

void pen_sched_release(struct pen_sched *sched, struct pen_sched_hand *worker, uint32_t strikes)
{
	worker->strikes = strikes;
	if (worker->quarantined)
		tell_of(sched, PEN_SCHED_RELEASED, worker);
	worker->quarantined = false;
}

/* It keeps its connection, and what it has done; it is given nothing more. */
void pen_sched_quarantine(struct pen_sched *sched, struct pen_sched_hand *worker, bool for_good)
{
	tell_of(sched, for_good ? PEN_SCHED_CONVICTED : PEN_SCHED_QUARANTINED, worker);
	worker->quarantined = true;
	worker->release_ms = for_good ? INT64_MAX : sched->now_ms + PEN_QUARANTINE_MS;
	for (uint32_t i = 0; i < worker->lease_max; i++)
		if (worker->leases[i].id != 0)
			pen_sched_expire(
				sched, worker, &worker->leases[i], PEN_SCHED_FAULT_RETURNED, "");
}

void pen_sched_defer(
	struct pen_sched *sched, struct pen_sched_hand *worker, struct pen_sched_lease *lease)
{
	struct pen_sched_turn *job = pen_sched_job_of(sched, lease);

	/* The time was spent: it is not given back. */
	lease->charge = 0;
	requeue(sched, job, lease);
	end_lease(sched, worker, lease);
}

void pen_sched_strike(struct pen_sched *sched, struct pen_sched_hand *worker)
{
	if (++worker->strikes == PEN_STRIKES_MAX)
		pen_sched_quarantine(sched, worker, false);
}

/* A unit that others failed at can be rendered: it was their fault. */
static void strike_blamed(struct pen_sched *sched, const struct pen_sched_hand *winner,
	const struct pen_backlog *backlog, uint32_t tile)
{
	for (size_t i = 0; i < sched->worker_count; i++) {
		struct pen_sched_hand *worker = sched->workers[i];

		if (worker == winner || worker->quarantined ||
			!pen_backlog_failed_on(backlog, tile, worker->id))
			continue;
		pen_sched_strike(sched, worker);
	}
}

void pen_sched_win(
	struct pen_sched *sched, struct pen_sched_hand *worker, struct pen_sched_lease *lease)
{
	struct pen_sched_turn *job = pen_sched_job_of(sched, lease);
	struct pen_backlog *backlog = pen_reel_backlog(&job->reel, lease->frame);
	const uint32_t tile = lease->tile, frame = lease->frame, round = lease->round;
	struct pen_sched_action *action;
	struct pen_sched_hand *holder;
	struct pen_sched_lease *twin = find_twin(sched, lease, &holder);

	if (twin) {
		job->virtual_seconds -= twin->charge;
		revoke(sched, holder, twin, job);
	}
	action = pen_sched_act(sched, PEN_SCHED_COMMIT, job);
	action->frame = frame;
	action->tile = tile;
	action->round = round;
	pen_backlog_deliver(backlog, tile);
	sched->merging++;
	end_lease(sched, worker, lease);
	if (++worker->units % PEN_STRIKE_UNITS == 0 && worker->strikes > 0)
		worker->strikes--;
	strike_blamed(sched, worker, backlog, tile);
}
