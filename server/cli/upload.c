/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/upload.h"

#include "core/base/limits.h"
#include "server/cli/interrupt.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_SIZE = 96, BUSY_WAIT_MS = 200, BUSY_TRIES = 150 };

static const char hash_prefix[] = "sha256:";

/* {"assets": ["sha256:…", …]} of all that the scene mentions. */
static char *question_write(const struct pen_source *source)
{
	json_t *list = json_array(), *question = json_pack("{s:o}", "assets", list);
	char digits[PEN_SHA256_TEXT], *text;

	for (size_t i = 0; i < source->asset_count; i++) {
		pen_sha256_format(&source->assets[i].sha256, digits);
		(void)json_array_append_new(list, json_sprintf("%s%s", hash_prefix, digits));
	}
	text = json_dumps(question, JSON_COMPACT);
	json_decref(question);
	return text;
}

static int missing_ask(struct pen_client *client, const struct pen_source *source,
	json_t **ret_missing, struct pen_error *err)
{
	char *question = question_write(source);
	json_t *missing;
	int r;

	if (!question)
		return pen_error_memory(err);
	r = pen_client_call(client, "POST", "/v1/assets/missing", question, strlen(question), err);
	free(question);
	if (r < 0)
		return r;
	missing = json_object_get(pen_client_answer(client), "missing");
	if (!json_is_array(missing))
		return pen_error_set(
			err, PEN_EPROTOCOL, "the server does not say which files it lacks");
	*ret_missing = json_incref(missing);
	return 0;
}

/* The asset that an element of the answer names; NULL when it is none of ours. */
static const struct pen_source_asset *asset_find(
	const struct pen_source *source, const json_t *element)
{
	const char *text = json_string_value(element);
	const size_t length = sizeof hash_prefix - 1;
	struct pen_sha256 digest;

	if (!text || strncmp(text, hash_prefix, length) != 0 ||
		!pen_sha256_parse(text + length, &digest))
		return NULL;
	for (size_t i = 0; i < source->asset_count; i++)
		if (pen_sha256_equal(&source->assets[i].sha256, &digest))
			return &source->assets[i];
	return NULL;
}

struct upload {
	struct pen_progress *progress;
	const char *name;
};

static void handle_moved(void *user, double share)
{
	const struct upload *upload = user;

	pen_progress_transfer(upload->progress, upload->name, share);
}

static int bytes_put(struct pen_client *client, const struct pen_source_asset *asset,
	const struct pen_buf *bytes, struct pen_progress *progress, struct pen_error *err)
{
	struct upload upload = {progress, asset->path ? asset->path : "glTF"};
	const struct pen_client_watch watch = {handle_moved, &upload};
	const char *data = bytes->size ? bytes->data : "";
	char path[PATH_SIZE], digits[PEN_SHA256_TEXT];
	int r;

	pen_sha256_format(&asset->sha256, digits);
	(void)snprintf(path, sizeof path, "/v1/assets/sha256/%s", digits);
	r = pen_client_upload(client, path, data, bytes->size, &watch, err);
	for (int tries = 0; r == PEN_EAGAIN && tries < BUSY_TRIES; tries++) {
		pen_interrupt_sleep(BUSY_WAIT_MS);
		r = pen_client_upload(client, path, data, bytes->size, &watch, err);
	}
	return r;
}

static int asset_put(struct pen_client *client, const struct pen_source *source,
	const struct pen_source_asset *asset, struct pen_progress *progress, struct pen_error *err)
{
	struct pen_buf bytes;
	int r;

	if (!asset->path)
		return bytes_put(client, asset, &source->held, progress, err);
	pen_buf_init(&bytes, PEN_ASSET_BYTES_MAX);
	r = pen_source_asset_read(source, asset->path, &bytes, err);
	if (r == 0)
		r = bytes_put(client, asset, &bytes, progress, err);
	pen_buf_finish(&bytes);
	return r;
}

int pen_upload_missing(struct pen_client *client, const struct pen_source *source,
	struct pen_progress *progress, struct pen_error *err)
{
	json_t *missing = NULL, *element;
	size_t i;
	int r;

	if (source->asset_count == 0)
		return 0;
	r = missing_ask(client, source, &missing, err);
	if (r < 0)
		return r;
	json_array_foreach (missing, i, element) {
		const struct pen_source_asset *asset = asset_find(source, element);

		if (r == 0 && asset)
			r = asset_put(client, source, asset, progress, err);
	}
	json_decref(missing);
	pen_progress_finish(progress);
	return r;
}
