/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/chaos/simulated_worker.h"

#include "core/base/clock.h"
#include "core/base/limits.h"

#include <string.h>

static struct unit *find_unit(struct sim_worker *worker, uint64_t lease)
{
	for (uint32_t i = 0; i < worker->count; i++)
		if (worker->units[i].lease.lease == lease)
			return &worker->units[i];
	return NULL;
}

static void remove_unit(struct sim_worker *worker, struct unit *unit)
{
	size_t after = worker->count - (size_t)(unit - worker->units) - 1;

	memmove(unit, unit + 1, after * sizeof *unit);
	worker->count--;
}

static void start_unit(struct sim *sim, uint32_t index, struct unit *unit)
{
	const struct sim_job *job = sim_find_job(sim, unit->lease.job);
	struct event end = {.type = EVENT_UNIT_END,
		.worker = index,
		.connection = sim->workers[index].connection,
		.lease = unit->lease};
	int64_t delay_ms = 50 + sim_draw(sim, 3000);

	unit->running = true;
	unit->hung = sim_strikes(sim, SIM_HANG);
	if (unit->hung)
		delay_ms = unit->lease.deadline_ms;
	else if (sim_strikes(sim, SIM_SLOW))
		delay_ms *= 2 + sim_draw(sim, 49);
	if (unit->hung)
		end.detail = PEN_FAULT_DEADLINE;
	else if (sim_cell(job, unit->lease.frame, unit->lease.tile) == job->poison ||
		 sim_strikes(sim, SIM_CRASH))
		end.detail = PEN_FAULT_CRASH;
	else if (sim_strikes(sim, SIM_KILL))
		end.detail = PEN_FAULT_KILLED;
	sim_push(sim, end, delay_ms);
}

static void start_units(struct sim *sim, uint32_t index)
{
	struct sim_worker *worker = &sim->workers[index];
	uint32_t running = 0;

	for (uint32_t i = 0; i < worker->count; i++)
		running += worker->units[i].running;
	for (uint32_t i = 0; i < worker->count && running < worker->processes; i++) {
		if (worker->units[i].running)
			continue;
		start_unit(sim, index, &worker->units[i]);
		running++;
	}
}

static void leave_when_done(struct sim *sim, uint32_t index)
{
	struct sim_worker *worker = &sim->workers[index];

	if (!worker->leaving || worker->count > 0)
		return;
	sim_post_from(sim, index, (struct event){.type = EVENT_GONE});
	worker->connection = 0;
	sim_push(sim, (struct event){.type = EVENT_DIAL, .worker = index},
		1000 + sim_draw(sim, 20000));
}

static void end_unit(struct sim *sim, uint32_t index, const struct event *event)
{
	struct sim_worker *worker = &sim->workers[index];
	struct unit *unit = find_unit(worker, event->lease.lease);
	struct event answer = {
		.type = EVENT_RESULT, .lease = event->lease, .detail = event->detail};

	if (!unit)
		return;
	if (event->detail != PEN_FAULT_NONE)
		answer.type = EVENT_FAILURE;
	else if (worker->liar && pen_clock_ms() < HEAL_MS && sim_draw(sim, 10) < 3)
		answer.detail = LIE_PIXELS;
	else if (sim_strikes(sim, SIM_LIE))
		answer.detail = LIE_NONE + 1 + sim_draw(sim, LIES - 1);
	sim_post_from(sim, index, answer);
	remove_unit(worker, unit);
}

/* A waiting unit goes; a running one may finish: that its result is late must not matter. */
static void revoke_unit(struct sim *sim, uint32_t index, uint64_t lease)
{
	struct sim_worker *worker = &sim->workers[index];
	struct unit *unit = find_unit(worker, lease);

	if (unit && (!unit->running || unit->hung || sim_draw(sim, 2) == 0))
		remove_unit(worker, unit);
}

static void beat(struct sim *sim, uint32_t index)
{
	struct sim_worker *worker = &sim->workers[index];

	sim_post_from(sim, index, (struct event){.type = EVENT_PROGRESS});
	for (uint32_t i = 0; i < worker->count; i++) {
		struct unit *unit = &worker->units[i];

		if (!unit->running)
			continue;
		unit->samples += !unit->hung;
		sim_post_from(sim, index,
			(struct event){.type = EVENT_PROGRESS,
				.lease = unit->lease,
				.samples = unit->samples});
	}
	sim_push(sim,
		(struct event){
			.type = EVENT_BEAT, .worker = index, .connection = worker->connection},
		PEN_HEARTBEAT_MS);
}

static void dial(struct sim *sim, uint32_t index)
{
	struct sim_worker *worker = &sim->workers[index];

	if (worker->connection != 0)
		return;
	worker->connection = ++sim->connection_last;
	worker->leaving = false;
	worker->count = 0;
	sim_post_from(sim, index, (struct event){.type = EVENT_HELLO});
	beat(sim, index);
}

void sim_worker_lose(struct sim *sim, uint32_t index, int64_t away_ms)
{
	sim->workers[index].connection = 0;
	sim->workers[index].count = 0;
	sim_push(sim, (struct event){.type = EVENT_DIAL, .worker = index}, away_ms);
}

static void accept_unit(struct sim *sim, struct sim_worker *worker, const struct event *event)
{
	if (find_unit(worker, event->lease.lease))
		return; /* the message was repeated */
	if (worker->leaving || worker->count == UNITS_MAX) {
		sim_post_from(sim, event->worker,
			(struct event){.type = EVENT_FAILURE,
				.lease = event->lease,
				.detail = PEN_FAULT_RETURNED});
		return;
	}
	worker->units[worker->count++] = (struct unit){.lease = event->lease};
}

void sim_worker_handle(struct sim *sim, const struct event *event)
{
	struct sim_worker *worker = &sim->workers[event->worker];

	if (event->type == EVENT_DIAL) {
		dial(sim, event->worker);
		return;
	}
	if (worker->connection == 0 || event->connection != worker->connection)
		return;
	switch (event->type) {
	case EVENT_LEASE: accept_unit(sim, worker, event); break;
	case EVENT_REVOKE: revoke_unit(sim, event->worker, event->lease.lease); break;
	case EVENT_CLOSED: sim_worker_lose(sim, event->worker, 500 + sim_draw(sim, 5000)); return;
	case EVENT_BEAT: beat(sim, event->worker); break;
	default: end_unit(sim, event->worker, event); break;
	}
	start_units(sim, event->worker);
	leave_when_done(sim, event->worker);
}

void sim_worker_drain(struct sim *sim, uint32_t index)
{
	struct sim_worker *worker = &sim->workers[index];

	worker->leaving = true;
	sim_post_from(sim, index, (struct event){.type = EVENT_DRAINING});
	for (uint32_t i = worker->count; i-- > 0;) {
		if (worker->units[i].running)
			continue;
		sim_post_from(sim, index,
			(struct event){.type = EVENT_FAILURE,
				.lease = worker->units[i].lease,
				.detail = PEN_FAULT_RETURNED});
		remove_unit(worker, &worker->units[i]);
	}
	leave_when_done(sim, index);
}
