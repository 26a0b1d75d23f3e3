/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/chaos/world.h"

#include "core/base/clock.h"

#include <stdarg.h>
#include <stdio.h>

const char *const sim_fault_names[SIM_FAULTS] = {"crash", "kill", "hang", "slow", "lie", "lose",
	"repeat", "reorder", "partition", "worker", "drain", "restart", "power", "user"};

/* The clock of server/dispatch.c: the linker puts it in the place of the real one. */
static int64_t virtual_ms;

int64_t __wrap_pen_clock_ms(void);
int64_t __wrap_pen_clock_ms(void)
{
	return virtual_ms;
}

void sim_set_time(int64_t now_ms)
{
	virtual_ms = now_ms;
}

uint32_t sim_draw(struct sim *sim, uint32_t below)
{
	/* xorshift64 (Marsaglia 2003) */
	sim->random ^= sim->random << 13;
	sim->random ^= sim->random >> 7;
	sim->random ^= sim->random << 17;
	return (uint32_t)(sim->random >> 33) % below;
}

bool sim_strikes(struct sim *sim, enum sim_fault fault)
{
	if (virtual_ms >= HEAL_MS || sim_draw(sim, 1000) >= sim->rate[fault])
		return false;
	sim->result->fired[fault]++;
	return true;
}

void sim_note(struct sim *sim, uint64_t what)
{
	sim->result->log =
		(sim->result->log ^ what ^ (uint64_t)virtual_ms << 32) * 0x9e3779b97f4a7c15u;
}

void sim_violate(struct sim *sim, const char *format, ...)
{
	char *text = sim->result->violation;
	va_list args;

	if (text[0] != '\0')
		return;
	va_start(args, format);
	(void)vsnprintf(text, sizeof sim->result->violation, format, args);
	va_end(args);
}

struct sim_job *sim_find_job(struct sim *sim, uint64_t number)
{
	return &sim->jobs[number - 1];
}

void sim_push(struct sim *sim, struct event event, int64_t delay_ms)
{
	event.at_ms = virtual_ms + delay_ms;
	event_queue_push(&sim->queue, &event);
}

void sim_push_job(struct sim *sim, const struct sim_job *job, enum event_type type, uint32_t detail,
	int64_t delay_ms)
{
	sim_push(sim,
		(struct event){.type = type,
			.job = job->shown.number,
			.incarnation = job->incarnation,
			.detail = detail},
		delay_ms);
}

void sim_post(struct sim *sim, struct event event)
{
	struct sim_worker *worker = &sim->workers[event.worker];
	bool inward = event.type < EVENT_LEASE;
	int64_t at_ms = virtual_ms + 1 + sim_draw(sim, 20);
	bool essential = event.type == EVENT_HELLO || event.type == EVENT_CLOSED;

	if (!essential && sim_strikes(sim, SIM_LOSE))
		return;
	if (worker->cut_until_ms > virtual_ms)
		at_ms += worker->cut_until_ms - virtual_ms;
	if (at_ms < worker->sent_ms[inward])
		at_ms = worker->sent_ms[inward];
	if (!essential && sim_strikes(sim, SIM_REORDER))
		at_ms += sim_draw(sim, 3000);
	else
		worker->sent_ms[inward] = at_ms;
	sim_push(sim, event, at_ms - virtual_ms);
	if (!essential && sim_strikes(sim, SIM_REPEAT))
		sim_push(sim, event, at_ms - virtual_ms + sim_draw(sim, 10000));
}

void sim_post_from(struct sim *sim, uint32_t index, struct event event)
{
	event.worker = index;
	event.connection = sim->workers[index].connection;
	sim_post(sim, event);
}
