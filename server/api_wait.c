/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_wait.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "server/fields.h"
#include "server/watch.h"

#include <stdio.h>
#include <stdlib.h>

/* An answer that is held. */
struct held {
	struct pen_watch watch; /* first, so that a watch is its held answer */
	struct pen_exchange *exchange;
	char id[PEN_JOB_ID_TEXT];
	pen_api_held_fn *answer;
};

static uint32_t seconds_of(const struct pen_exchange *exchange)
{
	uint32_t seconds = pen_field_wait(pen_exchange_field(exchange, "Prefer"));

	return seconds < PEN_WAIT_S_MAX ? seconds : PEN_WAIT_S_MAX;
}

static void handle_due(struct pen_watch *watch)
{
	struct held *held = (struct held *)watch;
	struct pen_exchange *exchange = held->exchange;
	struct pen_error err = PEN_ERROR_INIT;
	const struct pen_job *job;

	if (!exchange->api) {
		(void)pen_error_set(&err, PEN_ECLOSED, "the service is stopping");
		pen_exchange_error(exchange, &err);
	} else {
		job = pen_api_find_render(exchange, held->id);
		if (job)
			held->answer(exchange, job);
	}
	free(held);
}

bool pen_api_hold(struct pen_exchange *exchange, const struct pen_job *job, bool until_over,
	pen_api_held_fn *answer)
{
	const uint32_t seconds = seconds_of(exchange);
	struct held *held;

	if (seconds == 0 || pen_job_is_over(job->state) || !exchange->api)
		return false;
	held = calloc(1, sizeof *held);
	if (!held)
		return false;
	held->exchange = exchange;
	held->answer = answer;
	(void)snprintf(held->id, sizeof held->id, "%s", job->id);
	held->watch = (struct pen_watch){
		.id = held->id,
		.revision = job->revision,
		.until_over = until_over,
		.latest_ms = pen_clock_ms() + 1000 * (int64_t)seconds,
		.due = handle_due,
	};
	if (pen_watch_start(exchange->api->watches, &held->watch))
		return true;
	free(held);
	return false;
}

void pen_api_add_preference(struct pen_answer *answer, const struct pen_exchange *exchange)
{
	const uint32_t seconds = seconds_of(exchange);

	if (seconds > 0)
		pen_answer_field_of(answer, "Preference-Applied", "wait=%u", seconds);
}
