/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/chaos/simulation.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "tests/chaos/simulated_coordinator.h"
#include "tests/chaos/simulated_worker.h"

#include <stdlib.h>

static void strike_worker(struct sim *sim, uint32_t index)
{
	struct sim_worker *worker = &sim->workers[index];

	if (worker->connection == 0)
		return;
	if (sim_strikes(sim, SIM_PARTITION))
		worker->cut_until_ms = pen_clock_ms() + sim_draw(sim, 30000);
	if (!worker->leaving && sim_strikes(sim, SIM_DRAIN))
		sim_worker_drain(sim, index);
	if (worker->connection != 0 && sim_strikes(sim, SIM_WORKER)) {
		/* Its end is heard of at once, or by silence alone. */
		if (sim_draw(sim, 2) == 0)
			sim_post_from(sim, index, (struct event){.type = EVENT_GONE});
		sim_worker_lose(sim, index, 1000 + sim_draw(sim, 60000));
	}
}

static void strike_job(struct sim *sim, struct sim_job *job)
{
	if (!job->listed || !sim_strikes(sim, SIM_USER))
		return;
	if (sim_draw(sim, 4) == 0)
		sim_coordinator_cancel(sim, job);
	else
		sim_coordinator_pause(sim, job, !job->paused);
}

static void handle_nemesis(struct sim *sim)
{
	strike_worker(sim, sim_draw(sim, sim->worker_count));
	strike_job(sim, &sim->jobs[sim_draw(sim, sim->job_count)]);
	if (sim_strikes(sim, SIM_RESTART))
		sim_coordinator_restart(sim, false);
	else if (sim_strikes(sim, SIM_POWER))
		sim_coordinator_restart(sim, true);
	if (pen_clock_ms() < HEAL_MS)
		sim_push(sim, (struct event){.type = EVENT_NEMESIS}, 200 + sim_draw(sim, 4000));
}

static void heal(struct sim *sim)
{
	for (uint32_t i = 0; i < sim->worker_count; i++)
		sim->workers[i].cut_until_ms = 0;
	for (uint32_t i = 0; i < sim->job_count; i++)
		if (sim->jobs[i].paused)
			sim_coordinator_pause(sim, &sim->jobs[i], false);
}

static void create_job(struct sim *sim, struct sim_job *job, uint64_t number)
{
	struct pen_rect crop = {0, 0, 1 + sim_draw(sim, 64), 1 + sim_draw(sim, 64)};
	static const enum pen_sampling_mode modes[] = {
		PEN_SAMPLING_UNIFORM, PEN_SAMPLING_EDGE, PEN_SAMPLING_ADAPTIVE};

	job->shown = (struct pen_job){.number = number,
		.sampling.samples = 1 + sim_draw(sim, 80),
		.frame_first = 1,
		.frame_count = sim_draw(sim, 2) == 0 ? 1 : 1 + sim_draw(sim, FRAMES_MAX),
		.priority = sim_draw(sim, 100),
		.verify = (enum pen_verify)sim_draw(sim, 3)};
	pen_tiling_init(&job->shown.tiling, crop, 16);
	job->shown.sampling.mode = modes[sim_draw(sim, 3)];
	job->shown.sampling.min_samples = 1 + sim_draw(sim, job->shown.sampling.samples);
	job->rounds = pen_sampling_rounds(&job->shown.sampling);
	job->round_count = pen_round_count(&job->rounds);
	job->poison = sim_draw(sim, 8) == 0 ? sim_draw(sim, sim_cell_count(job)) : CELLS_MAX;
	sim_push(sim, (struct event){.type = EVENT_SUBMIT, .job = number},
		sim_draw(sim, HEAL_MS / 2));
}

/* Each seed has its own mixture of faults; about a third of them never strike. */
static void create_world(struct sim *sim, uint64_t seed)
{
	sim->random = seed * 0x9e3779b97f4a7c15u + 1;
	for (uint32_t i = 0; i < SIM_FAULTS; i++)
		sim->rate[i] =
			sim_draw(sim, 3) == 0 ? 0 : 1 + sim_draw(sim, i < SIM_PARTITION ? 30 : 100);
	sim->worker_count = 1 + sim_draw(sim, WORKERS_MAX);
	for (uint32_t i = 0; i < sim->worker_count; i++) {
		sim->workers[i].processes = 1 + sim_draw(sim, PROCESSES_MAX);
		sim->workers[i].trusted = sim_draw(sim, 4) == 0;
		sim->workers[i].class_text = sim_draw(sim, 4) == 0 ? "b" : "a";
		sim_push(sim, (struct event){.type = EVENT_DIAL, .worker = i}, sim_draw(sim, 2000));
	}
	/* At most one of them lies: against two of the same mind nobody is safe. */
	if (sim_draw(sim, 3) == 0) {
		struct sim_worker *liar = &sim->workers[sim_draw(sim, sim->worker_count)];

		liar->liar = true;
		liar->trusted = false;
	}
	sim->job_count = 1 + sim_draw(sim, JOBS_MAX);
	for (uint32_t i = 0; i < sim->job_count; i++)
		create_job(sim, &sim->jobs[i], i + 1);
	sim_push(sim, (struct event){.type = EVENT_TICK}, 0);
	sim_push(sim, (struct event){.type = EVENT_NEMESIS}, 1000);
	sim_push(sim, (struct event){.type = EVENT_HEAL}, HEAL_MS);
}

static bool all_over(const struct sim *sim)
{
	const struct sim_result *result = sim->result;

	return result->done + result->failed + result->cancelled == sim->job_count;
}

static void handle(struct sim *sim, const struct event *event)
{
	if (event->type == EVENT_NEMESIS)
		handle_nemesis(sim);
	else if (event->type == EVENT_HEAL)
		heal(sim);
	else if (event->type >= EVENT_LEASE)
		sim_worker_handle(sim, event);
	else
		sim_coordinator_handle(sim, event);
}

void sim_run(uint64_t seed, struct sim_result *ret_result)
{
	struct sim *sim = calloc(1, sizeof *sim);
	struct event event;

	if (!sim)
		abort();
	*ret_result = (struct sim_result){0};
	sim->result = ret_result;
	sim_set_time(0);
	sim_coordinator_start(sim);
	create_world(sim, seed);
	while (ret_result->violation[0] == '\0' && !all_over(sim) && pen_clock_ms() < END_MS &&
		event_queue_pop(&sim->queue, &event)) {
		sim_set_time(event.at_ms);
		ret_result->steps++;
		handle(sim, &event);
	}
	if (!all_over(sim))
		sim_violate(sim, "a render has not come to its end");
	pen_dispatch_destroy(sim->dispatch);
	event_queue_finish(&sim->queue);
	free(sim);
}
