/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_submit.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "core/base/log.h"
#include "server/api_again.h"
#include "server/api_render.h"
#include "server/api_wait.h"
#include "server/asset_file.h"
#include "server/fields.h"
#include "server/glb_request.h"
#include "server/shelf.h"
#include "server/submission.h"
#include "server/trace_context.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A body of at least this size is read on the thread pool, so that the loop never stands still. */
enum { READ_INLINE_MAX = 256 << 10 };

/* A render that is being asked for: reads the body, then has the job accepted. */
struct submit {
	uv_work_t work;
	struct pen_exchange *exchange;
	struct pen_shelf *shelf;
	const char *assets_dir;
	json_t *glb_scene; /* of a GLB, whose asset is not named yet; else NULL */
	struct pen_submission_reading reading;
	struct pen_submission keyed; /* its key alone */
	int result;
	struct pen_error err;
};

/* 200 when it is over, else 202. */
static void answer_accepted(struct pen_exchange *exchange, const struct pen_job *job)
{
	const bool is_over = pen_job_is_over(job->state);
	struct pen_answer answer;

	pen_answer_json(&answer, is_over ? 200 : 202, pen_api_render_json(job));
	pen_answer_field_of(&answer, "Location", "/v1/renders/%s", job->id);
	if (!is_over)
		pen_answer_field(&answer, "Retry-After", "1");
	pen_api_add_preference(&answer, exchange);
	pen_exchange_answer(exchange, &answer);
}

/* Previews come at the pace of a mouse. */
static void note_accepted(const struct pen_exchange *exchange, const struct pen_job *job)
{
	const struct pen_log_about about = {
		.request = exchange->id, .job = job->id, .trace = job->trace};

	pen_log_of(&about, job->is_preview ? PEN_LOG_DEBUG : PEN_LOG_INFO, "render %s: accepted",
		job->id);
}

static void accepted(void *user, struct pen_job *job, const struct pen_error *err)
{
	struct pen_exchange *exchange = user;

	if (job)
		note_accepted(exchange, job);
	if (!job)
		pen_exchange_error(exchange, err);
	else if (!pen_api_hold(exchange, job, true, answer_accepted))
		answer_accepted(exchange, job);
}

static void refuse(struct submit *submit)
{
	struct pen_answer answer;
	int code = submit->err.code;

	if (submit->reading.errors.count > 0)
		pen_answer_scene_errors(&answer, &submit->reading.errors, submit->reading.prefix);
	else if (code == PEN_ENOMEM || code == PEN_EIO)
		pen_answer_error(&answer, &submit->err);
	else
		pen_answer_problem(&answer, 400, submit->err.text);
	pen_exchange_answer(submit->exchange, &answer);
}

static void drop(struct pen_submission *submission)
{
	pen_scene_destroy(submission->scene);
	free(submission->canonical);
}

/* Every asset that the scene names must be there: blames each place that names one that is not. */
static int check_assets(struct submit *submit)
{
	const struct pen_scene *scene = submit->reading.submission.scene;
	struct pen_scene_errors *errors = &submit->reading.errors;

	for (uint32_t i = 0; i < scene->asset_count && errors->count < PEN_SCENE_ERRORS_MAX; i++) {
		struct pen_scene_error *error = &errors->items[errors->count];

		if (pen_asset_file_touch(submit->assets_dir, &scene->assets[i].sha256))
			continue;
		(void)snprintf(
			error->pointer, sizeof error->pointer, "%s", scene->assets[i].pointer);
		(void)snprintf(error->detail, sizeof error->detail,
			"this asset is not stored here: PUT it to /v1/assets/sha256/… first");
		errors->count++;
	}
	if (errors->count == 0)
		return 0;
	drop(&submit->reading.submission);
	return pen_error_set(&submit->err, PEN_EINVALID, "the scene names assets that are missing");
}

static int read_glb(struct submit *submit)
{
	struct pen_exchange *exchange = submit->exchange;
	struct pen_sha256 asset;
	char *text = NULL;
	size_t size;
	int r = pen_asset_upload_finish(exchange->upload, NULL, &asset, &submit->err);

	if (r == 0)
		r = pen_glb_request_text(submit->glb_scene, &asset, &text, &size, &submit->err);
	if (r == 0)
		r = pen_submission_read(text, size, submit->shelf, &submit->reading, &submit->err);
	if (r < 0)
		submit->reading.prefix = ""; /* the client knows of no envelope */
	free(text);
	return r;
}

/* The same request again has the same bytes; a GLB's are named in its scene. */
static int take_key(struct submit *submit)
{
	struct pen_submission *submission = &submit->reading.submission;
	const struct pen_buf *body = &submit->exchange->body;
	int r = 0;

	submission->has_key = submit->keyed.has_key;
	submission->key = submit->keyed.key;
	submission->key_body = submission->sha256;
	if (submission->has_key && !submit->glb_scene)
		r = pen_sha256_of(body->data, body->size, &submission->key_body, &submit->err);
	if (r < 0)
		drop(submission);
	return r;
}

static void read_body(uv_work_t *work)
{
	struct submit *submit = work->data;
	const struct pen_buf *body = &submit->exchange->body;

	submit->result = submit->glb_scene
				 ? read_glb(submit)
				 : pen_submission_read(body->data ? body->data : "", body->size,
					   submit->shelf, &submit->reading, &submit->err);
	if (submit->result == 0)
		submit->result = check_assets(submit);
	if (submit->result == 0)
		submit->result = take_key(submit);
}

/* False when there is such a render already, or the request has been answered otherwise. */
static bool is_new(struct pen_exchange *exchange, struct pen_submission *submission)
{
	struct pen_job *job;

	if (pen_api_again_find(exchange, submission, &job)) {
		if (!job)
			return true;
		if (submission->replaces[0] && strcmp(submission->replaces, job->id) != 0)
			pen_jobs_replace(exchange->api->jobs, submission->replaces);
		accepted(exchange, job, NULL);
	}
	drop(submission);
	return false;
}

static void refuse_for_now(struct pen_exchange *exchange, const char *detail, uint32_t retry_s)
{
	struct pen_answer answer;

	pen_answer_problem(&answer, 429, detail);
	pen_answer_field_of(&answer, "Retry-After", "%u", retry_s);
	pen_exchange_answer(exchange, &answer);
}

/* A render that another one is to replace and who asks may not see is one that is not there. */
static void begin(struct submit *submit)
{
	struct pen_exchange *exchange = submit->exchange;
	struct pen_submission *submission = &submit->reading.submission;
	int r;

	submission->owner = exchange->caller.owner;
	if (!pen_trace_context_continue(
		    pen_exchange_field(exchange, "traceparent"), submission->trace))
		submission->trace[0] = '\0';
	if (!pen_api_look_for_render(exchange, submission->replaces))
		submission->replaces[0] = '\0';
	if (!is_new(exchange, submission))
		return;
	r = pen_jobs_submit(exchange->api->jobs, submission, accepted, exchange, &submit->err);
	if (r == PEN_ELIMIT)
		refuse_for_now(exchange, submit->err.text, submission->retry_s);
	else if (r < 0)
		pen_exchange_error(exchange, &submit->err);
}

static void body_read(uv_work_t *work, int status)
{
	struct submit *submit = work->data;
	struct pen_exchange *exchange = submit->exchange;
	struct pen_submission *submission = &submit->reading.submission;

	if (status < 0 || !exchange->api) {
		(void)pen_error_set(&submit->err, PEN_ECLOSED, "the service is stopping");
		if (submit->result == 0)
			drop(submission);
		pen_exchange_error(exchange, &submit->err);
	} else if (submit->result < 0) {
		refuse(submit);
	} else {
		begin(submit);
	}
	json_decref(submit->glb_scene);
	free(submit);
}

/* curl --data calls what it sends a form unless it is told otherwise: that is read as JSON too. */
static bool is_json(const char *content_type)
{
	return !content_type || pen_field_media_type_is(content_type, "application/json") ||
	       pen_field_media_type_is(content_type, "text/json") ||
	       pen_field_media_type_is(content_type, "application/x-www-form-urlencoded");
}

bool pen_api_submit_admit(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const char *length = pen_exchange_field(exchange, "Content-Length");
	uint64_t size = length ? strtoull(length, NULL, 10) : 0;
	struct pen_error err = PEN_ERROR_INIT;
	int64_t wait_ms;

	(void)parameters;
	wait_ms = pen_rates_take(&exchange->api->rates, &exchange->caller.owner, pen_clock_ms());
	if (wait_ms > 0) {
		refuse_for_now(exchange, "this token asks for renders too often",
			(uint32_t)((wait_ms + 999) / 1000));
		return false;
	}
	if (!pen_field_media_type_is(
		    pen_exchange_field(exchange, "Content-Type"), "model/gltf-binary"))
		return true;
	if (size > PEN_ASSET_BYTES_MAX) {
		pen_exchange_problem(exchange, 413, "the GLB is too large: at most 1 GiB is taken");
		return false;
	}
	if (pen_asset_upload_create(exchange->api->assets_dir, size, &exchange->upload, &err) == 0)
		return true;
	pen_exchange_error(exchange, &err);
	return false;
}

void pen_api_submit(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct submit *submit;

	(void)parameters;
	if (!exchange->upload && !is_json(pen_exchange_field(exchange, "Content-Type"))) {
		pen_exchange_problem(exchange, 415,
			"the body must be application/json, or model/gltf-binary for a GLB");
		return;
	}
	if (exchange->api->draining) {
		(void)pen_error_set(&err, PEN_ECLOSED, "the service is stopping");
		pen_exchange_error(exchange, &err);
		return;
	}
	submit = calloc(1, sizeof *submit);
	if (!submit) {
		(void)pen_error_memory(&err);
		pen_exchange_error(exchange, &err);
		return;
	}
	submit->exchange = exchange;
	submit->shelf = exchange->api->shelf;
	submit->assets_dir = exchange->api->assets_dir;
	submit->work.data = submit;
	if (pen_api_again_read_key(exchange, &submit->keyed, &err) < 0 ||
		(exchange->upload &&
			pen_glb_request_read(exchange, &submit->glb_scene, &err) < 0)) {
		free(submit);
		pen_exchange_error(exchange, &err);
		return;
	}
	if ((!exchange->upload && exchange->body.size < READ_INLINE_MAX &&
		    !pen_shelf_is_slow(submit->shelf)) ||
		uv_queue_work(exchange->api->loop, &submit->work, read_body, body_read) < 0) {
		read_body(&submit->work);
		body_read(&submit->work, 0);
	}
}
