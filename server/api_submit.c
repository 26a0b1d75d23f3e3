/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_submit.h"

#include "server/api_render.h"
#include "server/fields.h"
#include "server/submission.h"

#include <stdlib.h>

/* A body of at least this size is read on the thread pool, so that the loop never stands still. */
enum { READ_INLINE_MAX = 256 << 10 };

/* A render that is being asked for: reads the body, then has the job accepted. */
struct submit {
	uv_work_t work;
	struct pen_exchange *exchange;
	struct pen_submission_reading reading;
	int result;
	struct pen_error err;
};

static void accepted(void *user, struct pen_job *job, const struct pen_error *err)
{
	struct pen_exchange *exchange = user;
	struct pen_answer answer;

	if (!job) {
		pen_exchange_error(exchange, err);
		return;
	}
	pen_answer_json(&answer, 202, pen_api_render_json(job));
	pen_answer_field(&answer, "Location", "/v1/renders/%s", job->id);
	pen_answer_field(&answer, "Retry-After", "1");
	pen_exchange_answer(exchange, &answer);
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

static void read_body(uv_work_t *work)
{
	struct submit *submit = work->data;
	const struct pen_buf *body = &submit->exchange->body;

	submit->result = pen_submission_read(
		body->data ? body->data : "", body->size, &submit->reading, &submit->err);
}

static void body_read(uv_work_t *work, int status)
{
	struct submit *submit = work->data;
	struct pen_exchange *exchange = submit->exchange;
	struct pen_submission *submission = &submit->reading.submission;

	if (status < 0 || !exchange->api) {
		(void)pen_error_set(&submit->err, PEN_ECLOSED, "the service is stopping");
		if (submit->result == 0) {
			pen_scene_destroy(submission->scene);
			free(submission->canonical);
		}
		pen_exchange_error(exchange, &submit->err);
	} else if (submit->result < 0) {
		refuse(submit);
	} else if (pen_jobs_submit(
			   exchange->api->jobs, submission, accepted, exchange, &submit->err) < 0) {
		pen_exchange_error(exchange, &submit->err);
	}
	free(submit);
}

/* curl --data calls what it sends a form unless it is told otherwise: that is read as JSON too. */
static bool is_json(const char *content_type)
{
	return !content_type || pen_field_media_type_is(content_type, "application/json") ||
	       pen_field_media_type_is(content_type, "text/json") ||
	       pen_field_media_type_is(content_type, "application/x-www-form-urlencoded");
}

void pen_api_submit(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct submit *submit;

	(void)parameters;
	if (!is_json(pen_exchange_field(exchange, "Content-Type"))) {
		pen_exchange_problem(exchange, 415,
			"the body must be application/json; other types are not supported yet");
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
	submit->work.data = submit;
	if (exchange->body.size < READ_INLINE_MAX ||
		uv_queue_work(exchange->api->loop, &submit->work, read_body, body_read) < 0) {
		read_body(&submit->work);
		body_read(&submit->work, 0);
	}
}
