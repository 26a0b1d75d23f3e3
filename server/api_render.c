/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_render.h"

#include "core/base/clock.h"
#include "server/api_wait.h"
#include "server/fields.h"
#include "server/report.h"
#include "server/tree.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

enum { PAGE_DEFAULT = 50, ETAG_TEXT = 64 };

double pen_api_render_progress(const struct pen_job *job)
{
	return (double)job->samples_done / (double)pen_job_samples(job);
}

static json_t *text_or_null(const char *text)
{
	return text && text[0] ? json_string(text) : json_null();
}

static json_t *time_or_null(int64_t wall_ms)
{
	char text[32];

	if (wall_ms == 0)
		return json_null();
	pen_clock_format(wall_ms, text, sizeof text);
	return json_string_nocheck(text);
}

static json_t *links_json(const struct pen_job *job)
{
	json_t *links = json_object();
	json_t *images = json_object();

	pen_tree_set(&links, "self", json_sprintf("/v1/renders/%s", job->id));
	pen_tree_set(&links, "image", json_sprintf("/v1/renders/%s/image", job->id));
	for (unsigned i = 0; i < PEN_IMAGE_FORMATS; i++) {
		const char *extension = pen_image_format_extension((enum pen_image_format)i);

		pen_tree_set(&images, extension,
			json_sprintf("/v1/renders/%s/image.%s", job->id, extension));
	}
	pen_tree_set(&links, "images", images);
	pen_tree_set(&links, "frames", json_sprintf("/v1/renders/%s/frames/{number}", job->id));
	pen_tree_set(&links, "iiif", json_sprintf("/v1/renders/%s/iiif", job->id));
	pen_tree_set(&links, "events", json_sprintf("/v1/renders/%s/events", job->id));
	return links;
}

/* However long the animation is, only those that are being rendered are told one by one. */
static json_t *frames_json(const struct pen_job *job)
{
	struct pen_job_frame running[PEN_JOB_FRAMES_MAX];
	uint32_t count = pen_jobs_frames_running(job, running);
	json_t *list = json_array();

	for (uint32_t i = 0; i < count; i++)
		pen_tree_append(
			&list, json_pack("{s:I, s:f}", "frame", (json_int_t)running[i].number,
				       "progress", running[i].progress));
	return json_pack("{s:I, s:I, s:I, s:I, s:o}", "first", (json_int_t)job->frame_first, "last",
		(json_int_t)job->frame_first + job->frame_count - 1, "total",
		(json_int_t)job->frame_count, "done", (json_int_t)job->frames_done, "running",
		list);
}

/* Seconds from its first unit until now, or until it was over. */
static double seconds_of(const struct pen_job *job)
{
	int64_t end_ms = job->finished_ms ? job->finished_ms : pen_clock_wall_ms();

	if (job->started_ms == 0 || end_ms < job->started_ms)
		return 0.0;
	return (double)(end_ms - job->started_ms) / 1000.0;
}

json_t *pen_api_render_json(const struct pen_job *job)
{
	json_t *tree = json_object();
	bool failed = job->state == PEN_JOB_FAILED;

	pen_tree_set(&tree, "id", json_string_nocheck(job->id));
	pen_tree_set(&tree, "name", text_or_null(job->name));
	pen_tree_set(&tree, "state", json_string_nocheck(pen_job_state_name(job->state)));
	pen_tree_set(&tree, "progress", json_real(pen_api_render_progress(job)));
	pen_tree_set(&tree, "priority", json_integer(job->priority));
	pen_tree_set(&tree, "preview", json_boolean(job->is_preview));
	pen_tree_set(&tree, "deadline", time_or_null(job->deadline_ms));
	pen_tree_set(&tree, "width", json_integer(job->width));
	pen_tree_set(&tree, "height", json_integer(job->height));
	pen_tree_set(&tree, "samples", json_integer(job->sampling.samples));
	pen_tree_set(&tree, "samples_done", json_integer((json_int_t)job->samples_done));
	pen_tree_set(&tree, "tiles_done", json_integer((json_int_t)job->tiles_done));
	pen_tree_set(&tree, "tiles_total",
		json_integer((json_int_t)job->tiling.count * (json_int_t)job->frame_count));
	pen_tree_set(&tree, "frames", frames_json(job));
	pen_tree_set(&tree, "eta_seconds",
		job->eta_seconds < 0 ? json_null() : json_real(job->eta_seconds));
	pen_tree_set(&tree, "created", time_or_null(job->created_ms));
	pen_tree_set(&tree, "started", time_or_null(job->started_ms));
	pen_tree_set(&tree, "finished", time_or_null(job->finished_ms));
	pen_tree_set(&tree, "seconds", json_real(seconds_of(job)));
	pen_tree_set(&tree, "class", text_or_null(job->equivalence_class));
	pen_tree_set(&tree, "content", text_or_null(job->content));
	pen_tree_set(&tree, "restarts", json_integer(job->restarts));
	pen_tree_set(&tree, "warnings", pen_report_json(job->warnings));
	pen_tree_set(
		&tree, "error", job->error.code < 0 ? json_string(job->error.text) : json_null());
	pen_tree_set(&tree, "errors", pen_report_json(failed ? job->errors : NULL));
	pen_tree_set(&tree, "links", links_json(job));
	return tree;
}

static bool client_has(const struct pen_exchange *exchange, const char *etag)
{
	return exchange->method != PEN_PATCH &&
	       pen_field_etag_matches(pen_exchange_field(exchange, "If-None-Match"), etag);
}

static void format_etag(const struct pen_exchange *exchange, const struct pen_job *job,
	char ret_etag[static ETAG_TEXT])
{
	(void)snprintf(ret_etag, ETAG_TEXT, "W/\"%" PRIx64 "-%" PRIu64 "\"", exchange->api->boot,
		job->revision);
}

static void answer_resource(
	struct pen_answer *answer, struct pen_recent *recent, const struct pen_job *job)
{
	const int64_t now_ms = pen_clock_ms();
	const struct pen_recent_text *found = pen_recent_find(recent, job, now_ms);

	if (found) {
		pen_answer_text(answer, 200, "application/json", found->text, found->size);
		return;
	}
	pen_answer_json(answer, 200, pen_api_render_json(job));
	if (answer->status == 200)
		pen_recent_put(recent, job, now_ms, answer->text, (size_t)answer->size);
}

/* 200 with the resource, or 304 without it. */
static void answer_render(struct pen_exchange *exchange, const struct pen_job *job)
{
	struct pen_answer answer;
	char etag[ETAG_TEXT];

	format_etag(exchange, job, etag);
	if (client_has(exchange, etag))
		pen_answer_init(&answer, 304);
	else
		answer_resource(&answer, &exchange->api->recent, job);
	pen_answer_field(&answer, "ETag", etag);
	pen_answer_field(&answer, "Cache-Control", "no-cache");
	if (!pen_job_is_over(job->state))
		pen_answer_field(&answer, "Retry-After", "1");
	pen_api_add_preference(&answer, exchange);
	pen_exchange_answer(exchange, &answer);
}

void pen_api_render_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	const bool conditional = pen_exchange_field(exchange, "If-None-Match") != NULL;
	char etag[ETAG_TEXT];
	bool has_changed;

	if (!job)
		return;
	format_etag(exchange, job, etag);
	has_changed = conditional && !client_has(exchange, etag);
	if (has_changed || !pen_api_hold(exchange, job, false, answer_render))
		answer_render(exchange, job);
}

static void job_changed(void *user, struct pen_job *job, const struct pen_error *err)
{
	struct pen_exchange *exchange = user;

	if (job && exchange->api)
		answer_render(exchange, job);
	else
		pen_exchange_error(exchange, err);
}

/* What a PATCH asks for: one of the two. */
struct change {
	bool has_state;
	enum pen_job_state state;
	uint32_t priority;
};

static int change_of(const json_t *tree, struct change *ret_change, struct pen_error *err)
{
	const json_t *state = json_object_get(tree, "state");
	const json_t *priority = json_object_get(tree, "priority");
	json_int_t number = json_integer_value(priority);

	if (json_object_size(tree) != 1 || (!state && !priority))
		return pen_error_set(err, PEN_EINVALID,
			"the body must be an object with either \"state\" or \"priority\"");
	ret_change->has_state = state != NULL;
	if (!state) {
		if (!json_is_integer(priority) || number < 0 || number > 100)
			return pen_error_set(
				err, PEN_EINVALID, "priority must be an integer from 0 to 100");
		ret_change->priority = (uint32_t)number;
		return 0;
	}
	if (!json_is_string(state) ||
		!pen_job_state_parse(json_string_value(state), &ret_change->state) ||
		(ret_change->state != PEN_JOB_PAUSED && ret_change->state != PEN_JOB_RUNNING &&
			ret_change->state != PEN_JOB_CANCELLED))
		return pen_error_set(err, PEN_EINVALID,
			"state must be \"paused\", \"running\" or \"cancelled\"");
	return 0;
}

static int apply(struct pen_exchange *exchange, struct pen_job *job, struct pen_error *err)
{
	struct pen_jobs *jobs = exchange->api->jobs;
	struct change change;
	json_t *tree;
	int r;

	r = pen_json_parse(
		exchange->body.data ? exchange->body.data : "", exchange->body.size, &tree, err);
	if (r < 0) {
		err->code = r == PEN_ENOMEM ? PEN_ENOMEM : PEN_EINVALID;
		return r;
	}
	r = change_of(tree, &change, err);
	json_decref(tree);
	if (r < 0)
		return r;
	if (change.has_state)
		return pen_jobs_set_state(jobs, job, change.state, job_changed, exchange, err);
	return pen_jobs_set_priority(jobs, job, change.priority, job_changed, exchange, err);
}

void pen_api_render_patch(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	struct pen_error err = PEN_ERROR_INIT;

	if (job && apply(exchange, job, &err) < 0)
		pen_exchange_error(exchange, &err);
}

static void job_deleted(void *user, struct pen_job *job, const struct pen_error *err)
{
	struct pen_exchange *exchange = user;
	struct pen_answer answer;

	(void)job;
	if (err->code != 0) {
		pen_exchange_error(exchange, err);
		return;
	}
	pen_answer_init(&answer, 204);
	pen_exchange_answer(exchange, &answer);
}

void pen_api_render_delete(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	struct pen_error err = PEN_ERROR_INIT;

	if (!job)
		return;
	pen_encoders_forget(exchange->api->encoders, job->id);
	if (pen_jobs_delete(exchange->api->jobs, job, job_deleted, exchange, &err) < 0)
		pen_exchange_error(exchange, &err);
}

struct page {
	bool any_state;
	enum pen_job_state state;
	uint64_t limit;
	uint64_t before; /* job numbers */
};

/* Takes what the query says into page, which holds the defaults. */
static int read_page(const struct pen_exchange *exchange, struct page *page, struct pen_error *err)
{
	const char *state = pen_exchange_query(exchange, "state");
	const char *limit = pen_exchange_query(exchange, "limit");
	const char *cursor = pen_exchange_query(exchange, "cursor");

	page->any_state = !state;
	if (state && !pen_job_state_parse(state, &page->state))
		return pen_error_set(err, PEN_EINVALID,
			"state must be queued, running, paused, done, failed or cancelled");
	if (limit &&
		(!pen_field_number(limit, PEN_LIST_PAGE_MAX, &page->limit) || page->limit == 0))
		return pen_error_set(err, PEN_EINVALID, "limit must be an integer from 1 to %u",
			PEN_LIST_PAGE_MAX);
	if (cursor && !pen_field_number(cursor, UINT64_MAX, &page->before))
		return pen_error_set(
			err, PEN_EINVALID, "cursor must be the next of an earlier list");
	return 0;
}

static bool is_of_page(
	const struct pen_exchange *exchange, const struct page *page, const struct pen_job *job)
{
	return (page->any_state || job->state == page->state) &&
	       pen_api_may_see(exchange, &job->owner);
}

static struct pen_job *next_of_page(
	const struct pen_exchange *exchange, const struct page *page, uint64_t before)
{
	struct pen_jobs *jobs = exchange->api->jobs;
	struct pen_job *job = pen_jobs_older(jobs, before);

	while (job && !is_of_page(exchange, page, job))
		job = pen_jobs_older(jobs, job->number);
	return job;
}

void pen_api_render_list(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct page page = {.limit = PAGE_DEFAULT, .before = UINT64_MAX};
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_answer answer;
	struct pen_job *job;
	uint64_t last = 0;
	json_t *list;

	(void)parameters;
	if (read_page(exchange, &page, &err) < 0) {
		pen_exchange_error(exchange, &err);
		return;
	}
	list = json_array();
	job = next_of_page(exchange, &page, page.before);
	while (job && list && json_array_size(list) < page.limit) {
		pen_tree_append(&list, pen_api_render_json(job));
		last = job->number;
		job = next_of_page(exchange, &page, last);
	}
	pen_answer_json(&answer, 200,
		json_pack("{s:o, s:o}", "renders", list, "next",
			job ? json_sprintf("%" PRIu64, last) : json_null()));
	pen_answer_field(&answer, "Cache-Control", "no-store");
	pen_exchange_answer(exchange, &answer);
}
