/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_asset.h"

#include "core/base/limits.h"
#include "server/asset_file.h"
#include "server/tree.h"

#include <stdlib.h>
#include <string.h>

static const char prefix[] = "sha256:";

/* False after the answer: nothing can have such a name. */
static bool name_of(struct pen_exchange *exchange, const struct pen_api_parameters *parameters,
	struct pen_sha256 *ret_sha256)
{
	if (strlen(parameters->hash) == PEN_SHA256_TEXT - 1 &&
		pen_sha256_parse(parameters->hash, ret_sha256))
		return true;
	pen_exchange_problem(
		exchange, 404, "an asset is named by the 64 lower-case hex digits of its SHA-256");
	return false;
}

bool pen_api_asset_admit(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const char *dir = exchange->api->assets_dir;
	const char *length = pen_exchange_field(exchange, "Content-Length");
	uint64_t size = length ? strtoull(length, NULL, 10) : 0;
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_sha256 sha256;

	if (!name_of(exchange, parameters, &sha256))
		return false;
	if (size > PEN_ASSET_BYTES_MAX) {
		pen_exchange_problem(
			exchange, 413, "the asset is too large: at most 1 GiB is taken");
		return false;
	}
	exchange->ignores_body = pen_asset_file_touch(dir, &sha256);
	if (exchange->ignores_body ||
		pen_asset_upload_create(dir, size, &exchange->upload, &err) == 0)
		return true;
	pen_exchange_error(exchange, &err);
	return false;
}

/* The end of an upload, on the thread pool. */
struct finish {
	uv_work_t work;
	struct pen_exchange *exchange;
	struct pen_asset_upload *upload;
	struct pen_sha256 sha256;
	struct pen_error err;
};

static void store(uv_work_t *work)
{
	struct finish *finish = work->data;

	(void)pen_asset_upload_finish(
		finish->upload, &finish->sha256, &finish->sha256, &finish->err);
	pen_asset_upload_destroy(finish->upload);
}

static void stored(uv_work_t *work, int status)
{
	struct finish *finish = work->data;
	struct pen_answer answer;

	if (status < 0)
		(void)pen_error_set(&finish->err, PEN_ECLOSED, "the service is stopping");
	if (finish->err.code == 0)
		pen_answer_init(&answer, 201);
	else if (finish->err.code == PEN_EINVALID)
		pen_answer_problem(&answer, 422, finish->err.text);
	else
		pen_answer_error(&answer, &finish->err);
	pen_exchange_answer(finish->exchange, &answer);
	free(finish);
}

static void finish_upload(struct pen_exchange *exchange, const struct pen_sha256 *sha256)
{
	struct finish *finish = calloc(1, sizeof *finish);
	struct pen_error err = PEN_ERROR_INIT;

	if (!finish) {
		(void)pen_error_memory(&err);
		pen_exchange_error(exchange, &err);
		return;
	}
	finish->exchange = exchange;
	finish->sha256 = *sha256;
	finish->upload = exchange->upload;
	exchange->upload = NULL;
	finish->work.data = finish;
	if (uv_queue_work(exchange->api->loop, &finish->work, store, stored) < 0) {
		store(&finish->work);
		stored(&finish->work, 0);
	}
}

void pen_api_asset_put(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_answer answer;
	struct pen_sha256 sha256;

	if (!name_of(exchange, parameters, &sha256))
		return;
	if (exchange->upload) {
		finish_upload(exchange, &sha256);
		return;
	}
	pen_answer_init(&answer, 200);
	pen_exchange_answer(exchange, &answer);
}

void pen_api_asset_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_answer answer;
	struct pen_sha256 sha256;

	if (!name_of(exchange, parameters, &sha256))
		return;
	if (!pen_asset_file_touch(exchange->api->assets_dir, &sha256)) {
		pen_exchange_problem(exchange, 404, "there is no such asset");
		return;
	}
	pen_answer_init(&answer, 200);
	pen_answer_field(&answer, "Cache-Control", "no-store");
	pen_exchange_answer(exchange, &answer);
}

/* Whether the body is {"assets": [...]} with names of assets alone, and not too many. */
static bool are_names(const json_t *tree, json_t *names)
{
	struct pen_sha256 sha256;
	json_t *name;
	size_t index;

	if (json_object_size(tree) != 1 || !json_is_array(names) ||
		json_array_size(names) > PEN_ASSETS_MAX)
		return false;
	json_array_foreach (names, index, name) {
		const char *text = json_string_value(name);

		if (json_string_length(name) != strlen(prefix) + PEN_SHA256_TEXT - 1 ||
			strncmp(text, prefix, strlen(prefix)) != 0 ||
			!pen_sha256_parse(text + strlen(prefix), &sha256))
			return false;
	}
	return true;
}

/* NULL without memory. */
static json_t *missing_of(const char *dir, json_t *names)
{
	json_t *list = json_array(), *name;
	struct pen_sha256 sha256;
	size_t index;

	json_array_foreach (names, index, name) {
		pen_sha256_parse(json_string_value(name) + strlen(prefix), &sha256);
		if (!pen_asset_file_touch(dir, &sha256))
			pen_tree_append(&list, json_incref(name));
	}
	return list;
}

void pen_api_assets_missing(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_buf *body = &exchange->body;
	struct pen_error err = PEN_ERROR_INIT;
	json_t *tree = NULL, *names, *answered;
	struct pen_answer answer;

	(void)parameters;
	if (pen_json_parse(body->data ? body->data : "", body->size, &tree, &err) < 0) {
		err.code = err.code == PEN_ENOMEM ? PEN_ENOMEM : PEN_EINVALID;
		pen_exchange_error(exchange, &err);
		return;
	}
	names = json_object_get(tree, "assets");
	if (are_names(tree, names)) {
		answered = json_object();
		pen_tree_set(&answered, "missing", missing_of(exchange->api->assets_dir, names));
		pen_answer_json(&answer, 200, answered);
	} else {
		pen_answer_problem(&answer, 400,
			"the body must be {\"assets\": […]}, with at most 4096 names like "
			"\"sha256:\" and 64 lower-case hex digits");
	}
	json_decref(tree);
	pen_exchange_answer(exchange, &answer);
}
