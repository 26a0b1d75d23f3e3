/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_farm.h"

#include "core/base/clock.h"
#include "server/fields.h"
#include "server/metrics.h"
#include "server/tree.h"

#include <stdio.h>
#include <string.h>

static const char *state_of(const struct pen_worker *worker)
{
	if (worker->draining)
		return "draining";
	return worker->quarantined ? "quarantined" : "ready";
}

static json_t *worker_json(const struct pen_worker *worker)
{
	char id[24], connected[32], heartbeat[32];

	(void)snprintf(id, sizeof id, "%llu", (unsigned long long)worker->id);
	pen_clock_format(worker->connected_ms, connected, sizeof connected);
	pen_clock_format(worker->heartbeat_ms, heartbeat, sizeof heartbeat);
	return json_pack(
		"{s:s, s:s?, s:s?, s:i, s:s, s:s?, s:s?, s:i, s:I, s:I, s:f, s:s, s:s, s:i}", "id",
		id, "name", worker->name, "address", worker->address, "processes",
		(int)worker->processes, "state", state_of(worker), "class",
		worker->equivalence_class, "version", worker->version, "leases",
		(int)worker->leases, "tiles_done", (json_int_t)worker->units_done, "samples_done",
		(json_int_t)worker->samples_done, "rate", worker->samples_per_second, "connected",
		connected, "last_heartbeat", heartbeat, "strikes", (int)worker->strikes);
}

void pen_api_workers(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_farm *farm = exchange->api->farm;
	const struct pen_worker *worker = NULL;
	json_t *list = json_array();
	struct pen_answer answer;

	(void)parameters;
	while ((worker = pen_farm_next(farm, worker ? worker->id : 0)))
		pen_tree_append(&list, worker_json(worker));
	pen_answer_json(&answer, 200, json_pack("{s:o}", "workers", list));
	pen_answer_field(&answer, "Cache-Control", "no-store");
	pen_exchange_answer(exchange, &answer);
}

/* Its id; 0, which no worker has, when the text is none. */
static uint64_t worker_id(const struct pen_api_parameters *parameters)
{
	uint64_t id;

	return pen_field_number(parameters->id, INT64_MAX, &id) ? id : 0;
}

static void answer_worker(
	struct pen_exchange *exchange, uint64_t id, int r, const struct pen_error *err)
{
	struct pen_answer answer;

	if (r < 0) {
		pen_exchange_error(exchange, err);
		return;
	}
	pen_answer_json(&answer, 200, worker_json(pen_farm_next(exchange->api->farm, id - 1)));
	pen_answer_field(&answer, "Cache-Control", "no-store");
	pen_exchange_answer(exchange, &answer);
}

void pen_api_worker_drain(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const uint64_t id = worker_id(parameters);
	struct pen_error err = PEN_ERROR_INIT;

	answer_worker(exchange, id, pen_farm_drain(exchange->api->farm, id, &err), &err);
}

void pen_api_worker_reset(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const uint64_t id = worker_id(parameters);
	struct pen_error err = PEN_ERROR_INIT;

	answer_worker(exchange, id, pen_farm_reset(exchange->api->farm, id, &err), &err);
}

/* What can be mended by people comes first. */
static const char *why_waiting(const struct pen_api *api)
{
	if (pen_jobs_lack_room(api->jobs))
		return "A render waits for room on the disk, or for memory.";
	return pen_farm_why_waiting(api->farm);
}

void pen_api_farm(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_farm *farm = exchange->api->farm;
	const struct pen_worker *worker = NULL;
	int workers = 0, processes = 0;
	double rate = 0.0;
	struct pen_answer answer;

	(void)parameters;
	while ((worker = pen_farm_next(farm, worker ? worker->id : 0))) {
		workers++;
		processes += (int)worker->processes;
		rate += worker->samples_per_second;
	}
	pen_answer_json(&answer, 200,
		json_pack("{s:s, s:b, s:i, s:i, s:I, s:f, s:s}", "version", PEN_VERSION, "draining",
			exchange->api->draining, "workers", workers, "processes", processes,
			"queue_depth", (json_int_t)pen_farm_queue_depth(farm), "rate", rate,
			"why_waiting", why_waiting(exchange->api)));
	pen_answer_field(&answer, "Cache-Control", "no-store");
	pen_exchange_answer(exchange, &answer);
}

static void answer_text(struct pen_exchange *exchange, unsigned status, const char *text)
{
	struct pen_answer answer;

	pen_answer_init(&answer, status);
	answer.content_type = "text/plain; charset=utf-8";
	answer.text = strdup(text);
	answer.size = answer.text ? strlen(text) : 0;
	pen_answer_field(&answer, "Cache-Control", "no-store");
	pen_exchange_answer(exchange, &answer);
}

void pen_api_metrics(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_api *api = exchange->api;
	struct pen_answer answer;
	struct pen_buf text;

	(void)parameters;
	pen_buf_init(&text, PEN_METRICS_BYTES_MAX);
	if (pen_metrics_write(api->farm, api->jobs, &text) < 0) {
		pen_buf_finish(&text);
		pen_exchange_problem(exchange, 500, "there is no memory for the metrics");
		return;
	}
	pen_answer_init(&answer, 200);
	answer.content_type = "text/plain; version=0.0.4; charset=utf-8";
	answer.size = text.size;
	answer.text = pen_buf_take(&text);
	pen_answer_field(&answer, "Cache-Control", "no-store");
	pen_exchange_answer(exchange, &answer);
}

void pen_api_livez(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	(void)parameters;
	answer_text(exchange, 200, "ok\n");
}

void pen_api_readyz(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	bool draining = exchange->api->draining;

	(void)parameters;
	answer_text(exchange, draining ? 503 : 200, draining ? "draining\n" : "ok\n");
}
