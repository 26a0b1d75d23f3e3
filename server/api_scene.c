/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_scene.h"

#include "server/fields.h"
#include "server/scene_file.h"
#include "server/shelf.h"

#include <stdlib.h>
#include <string.h>

/* False after the answer: nothing can have such a name. */
static bool name_of(struct pen_exchange *exchange, const struct pen_api_parameters *parameters,
	struct pen_sha256 *ret_name)
{
	if (strlen(parameters->hash) == PEN_SHA256_TEXT - 1 &&
		pen_sha256_parse(parameters->hash, ret_name))
		return true;
	pen_exchange_problem(exchange, 404,
		"a kept scene is named by the 64 lower-case hex digits of its text's SHA-256");
	return false;
}

/* A scene on its way to the shelf, on the thread pool. */
struct put {
	uv_work_t work;
	struct pen_exchange *exchange;
	struct pen_shelf *shelf;
	struct pen_sha256 name;
	struct pen_scene_errors errors;
	struct pen_error err;
};

static void keep(uv_work_t *work)
{
	struct put *put = work->data;
	const struct pen_buf *body = &put->exchange->body;

	(void)pen_shelf_put(put->shelf, &put->name, body->data ? body->data : "", body->size,
		&put->errors, &put->err);
}

static void kept(uv_work_t *work, int status)
{
	struct put *put = work->data;
	struct pen_answer answer;
	int code;

	if (status < 0)
		(void)pen_error_set(&put->err, PEN_ECLOSED, "the service is stopping");
	code = put->err.code;
	if (code == 0)
		pen_answer_init(&answer, 201);
	else if (put->errors.count > 0)
		pen_answer_scene_errors(&answer, &put->errors, "");
	else if (code == PEN_ECONFLICT)
		pen_answer_problem(&answer, 422, put->err.text);
	else if (code == PEN_ELIMIT)
		pen_answer_problem(&answer, 400, put->err.text);
	else
		pen_answer_error(&answer, &put->err);
	pen_exchange_answer(put->exchange, &answer);
	free(put);
}

void pen_api_scene_put(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_answer answer;
	struct pen_sha256 name;
	struct put *put;

	if (!name_of(exchange, parameters, &name))
		return;
	if (pen_shelf_has(exchange->api->shelf, &name)) {
		pen_answer_init(&answer, 200);
		pen_exchange_answer(exchange, &answer);
		return;
	}
	put = calloc(1, sizeof *put);
	if (!put) {
		(void)pen_error_memory(&err);
		pen_exchange_error(exchange, &err);
		return;
	}
	put->exchange = exchange;
	put->shelf = exchange->api->shelf;
	put->name = name;
	put->work.data = put;
	if (uv_queue_work(exchange->api->loop, &put->work, keep, kept) < 0) {
		keep(&put->work);
		kept(&put->work, 0);
	}
}

void pen_api_scene_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_answer answer;
	struct pen_sha256 name;
	uint64_t size;
	int fd;

	if (!name_of(exchange, parameters, &name))
		return;
	if (!pen_shelf_has(exchange->api->shelf, &name) ||
		pen_shelf_open(exchange->api->shelf, &name, &fd, &size, &err) < 0) {
		pen_exchange_problem(exchange, 404, "there is no such scene");
		return;
	}
	pen_answer_init(&answer, 200);
	answer.content_type = "application/json";
	answer.fd = fd;
	answer.size = size;
	/* The name is the content's; but it may be swept, and HEAD is how to find out. */
	pen_answer_field(&answer, "Cache-Control", "no-cache");
	pen_answer_field_of(&answer, "ETag", "\"%s\"", parameters->hash);
	pen_exchange_answer(exchange, &answer);
}

void pen_api_render_scene(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	struct pen_error err = PEN_ERROR_INIT;
	char hash[PEN_SHA256_TEXT];
	struct pen_answer answer;
	uint64_t size;
	int fd;

	if (!job)
		return;
	if (pen_scene_file_open(exchange->api->scenes_dir, &job->scene_sha256, &fd, &size, &err) <
		0) {
		pen_exchange_problem(exchange, 404, "the scene of this render is not kept");
		return;
	}
	pen_sha256_format(&job->scene_sha256, hash);
	pen_answer_init(&answer, 200);
	answer.content_type = "application/json";
	answer.fd = fd;
	answer.size = size;
	pen_answer_field(&answer, "Cache-Control", "no-cache");
	pen_answer_field_of(&answer, "ETag", "\"%s\"", hash);
	pen_exchange_answer(exchange, &answer);
}
