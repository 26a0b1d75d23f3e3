/* SPDX-License-Identifier: Apache-2.0 */

/*
 * Any bytes as what workers and users do, true or not and in any order; the coordinator's own
 * answers (merged, decided) come late and in any order, but only to what was asked. No lease is
 * granted twice or to a worker that has left, none has more than two for each process, and nothing
 * is committed but the result of a live lease.
 */
#include "core/base/limits.h"
#include "server/sched.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { JOBS = 4, WORKERS = 4, TILES = 4, LEASES = 64, ASKED = 64 };

struct bytes {
	const uint8_t *data;
	size_t size;
};

struct lease {
	uint64_t id, worker;
};

/* A unit to merge, or a frame to decide; job 0: none. */
struct asked {
	uint64_t job;
	uint32_t frame, tile;
};

struct farm {
	struct pen_sched *sched;
	struct asked merges[ASKED], decisions[ASKED];
	uint64_t workers[WORKERS], jobs[JOBS]; /* 0: none */
	uint32_t processes[WORKERS];
	struct lease leases[LEASES]; /* live ones, as told by the actions; id 0: none */
	uint64_t last_id, last_lease;
	struct pen_tiling tiling;
	int64_t now_ms;
};

static void check(bool holds)
{
	if (!holds)
		abort();
}

static uint8_t take(struct bytes *bytes)
{
	if (bytes->size == 0)
		return 0;
	bytes->size--;
	return *bytes->data++;
}

static struct lease *find_lease(struct farm *farm, uint64_t id)
{
	for (unsigned i = 0; i < LEASES; i++)
		if (farm->leases[i].id == id)
			return &farm->leases[i];
	return NULL;
}

static void granted(struct farm *farm, const struct pen_sched_action *action)
{
	struct lease *place = find_lease(farm, 0);
	uint32_t count = 0, most = 0;

	check(action->lease > farm->last_lease && action->tile < TILES && place);
	farm->last_lease = action->lease;
	*place = (struct lease){action->lease, action->worker};
	for (unsigned i = 0; i < WORKERS; i++)
		if (farm->workers[i] == action->worker)
			most = 2 * farm->processes[i];
	for (unsigned i = 0; i < LEASES; i++)
		count += farm->leases[i].id != 0 && farm->leases[i].worker == action->worker;
	check(count <= most);
	check(pen_sched_find_lease(farm->sched, action->worker, action->lease));
}

static void ask(struct asked *asked, const struct pen_sched_action *action)
{
	unsigned i = 0;

	while (i < ASKED && asked[i].job != 0)
		i++;
	check(i < ASKED);
	asked[i] = (struct asked){action->job, action->frame, action->tile};
}

static void forget_job(struct farm *farm, uint64_t number)
{
	for (unsigned i = 0; i < JOBS; i++)
		if (farm->jobs[i] == number)
			farm->jobs[i] = 0;
	for (unsigned i = 0; i < ASKED; i++) {
		if (farm->merges[i].job == number)
			farm->merges[i].job = 0;
		if (farm->decisions[i].job == number)
			farm->decisions[i].job = 0;
	}
}

/* Leases that the scheduler holds no more. */
static void sweep(struct farm *farm)
{
	for (unsigned i = 0; i < LEASES; i++)
		if (farm->leases[i].id != 0 && !pen_sched_find_lease(farm->sched,
						       farm->leases[i].worker, farm->leases[i].id))
			farm->leases[i].id = 0;
}

static void step(struct farm *farm, const struct pen_sched_event *event)
{
	const bool is_live = event->type == PEN_SCHED_RESULT &&
			     pen_sched_find_lease(farm->sched, event->worker, event->lease);
	struct pen_sched_actions actions;

	actions = pen_sched_step(farm->sched, event, farm->now_ms);
	sweep(farm);
	for (size_t i = 0; i < actions.count; i++) {
		const struct pen_sched_action *action = &actions.items[i];

		switch (action->type) {
		case PEN_SCHED_LEASE: granted(farm, action); break;
		case PEN_SCHED_COMMIT:
			check(is_live);
			ask(farm->merges, action);
			break;
		case PEN_SCHED_DECIDE: ask(farm->decisions, action); break;
		case PEN_SCHED_RENDERED:
		case PEN_SCHED_FAILED:
		case PEN_SCHED_ABANDONED:
		case PEN_SCHED_TAINTED: forget_job(farm, action->job); break;
		default: break;
		}
	}
}

static void add_job(struct farm *farm, unsigned place, uint8_t how)
{
	struct pen_sched_job job = {.number = ++farm->last_id,
		.tiling = &farm->tiling,
		.frame_first = 1,
		.frame_end = 2 + how % 3,
		.rounds = pen_rounds_of((enum pen_rounds_kind)(how / 4 % 3), 40, 16),
		.priority = how,
		.paused = how % 7 == 0,
		.verify = (enum pen_verify)(how / 16 % 3)};

	if (farm->jobs[place] == 0 && pen_sched_add_job(farm->sched, &job, NULL) == 0)
		farm->jobs[place] = job.number;
}

static void add_worker(struct farm *farm, unsigned place, uint8_t how)
{
	static const char *const classes[] = {"a", "b"};
	struct pen_sched_worker worker = {.id = ++farm->last_id,
		.processes = 1 + how % 3,
		.equivalence_class = classes[how / 4 % 2],
		.trusted = how % 5 == 0};

	if (farm->workers[place] != 0)
		return;
	farm->workers[place] = worker.id;
	farm->processes[place] = worker.processes;
	check(pen_sched_add_worker(farm->sched, &worker, NULL) == 0);
}

static void decide(struct farm *farm, unsigned place, uint8_t how)
{
	struct asked *asked = &farm->decisions[place % ASKED];
	struct pen_demand demands[TILES];
	struct asked answer = *asked;

	if (answer.job == 0)
		return;
	for (unsigned i = 0; i < TILES; i++)
		demands[i] = (struct pen_demand){.rounds = (uint16_t)(how % 2 ? 3 : 1),
			.is_final = true,
			.pixels = 1u + how,
			.samples = 40};
	asked->job = 0;
	step(farm, &(struct pen_sched_event){.type = PEN_SCHED_DECIDED,
			   .job = answer.job,
			   .u.decided = {answer.frame, demands}});
}

static void merge(struct farm *farm, unsigned place)
{
	struct asked *asked = &farm->merges[place % ASKED];
	struct asked answer = *asked;

	if (answer.job == 0)
		return;
	asked->job = 0;
	step(farm, &(struct pen_sched_event){.type = PEN_SCHED_MERGED,
			   .job = answer.job,
			   .u.merged = {answer.frame, answer.tile}});
}

static void happen(struct farm *farm, struct bytes *bytes)
{
	const uint8_t what = take(bytes), which = take(bytes), how = take(bytes);
	const struct lease *lease = &farm->leases[which % LEASES];
	struct pen_sched_event event = {
		.job = farm->jobs[which % JOBS],
		.worker = how % 8 == 7 ? farm->workers[how % WORKERS] : lease->worker,
		.lease = lease->id,
		.digest = how % 3,
	};

	farm->now_ms += what / 16 * what / 16 * 40;
	event.type = (enum pen_sched_event_type)(what % 16);
	switch (what % 16) {
	case 14: add_job(farm, which % JOBS, how); return;
	case 15: add_worker(farm, which % WORKERS, how); return;
	case PEN_SCHED_DECIDED: decide(farm, which, how); return;
	case PEN_SCHED_MERGED: merge(farm, which); return;
	case PEN_SCHED_JOB_PRIORITY: event.u.priority = how % 101; break;
	case PEN_SCHED_PROGRESS: event.u.samples = how; break;
	case PEN_SCHED_RESULT: event.u.seconds = how / 16.0; break;
	case PEN_SCHED_FAILURE:
		event.u.failure.fault = (enum pen_sched_fault)(how % 4);
		event.u.failure.reason = "by a fault";
		break;
	case PEN_SCHED_WORKER_LEAVE:
	case PEN_SCHED_WORKER_DRAIN:
	case PEN_SCHED_WORKER_RESET: event.worker = farm->workers[which % WORKERS]; break;
	case 13: event.type = PEN_SCHED_TICK; break;
	default: break;
	}
	step(farm, &event);
	if (event.type == PEN_SCHED_WORKER_LEAVE)
		farm->workers[which % WORKERS] = 0;
	if (event.type == PEN_SCHED_JOB_REMOVE)
		forget_job(farm, event.job);
	sweep(farm);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct bytes bytes = {data, size};
	struct farm farm = {.now_ms = 1000};

	pen_tiling_init(&farm.tiling, (struct pen_rect){0, 0, 32, 32}, 16);
	check(pen_sched_create(1, &farm.sched, NULL) == 0);
	while (bytes.size >= 3)
		happen(&farm, &bytes);
	pen_sched_destroy(farm.sched);
	return 0;
}
