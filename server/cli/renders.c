/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/renders.h"

#include "core/base/buf.h"
#include "core/base/clock.h"
#include "core/base/limits.h"
#include "server/cli/interrupt.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_SIZE = PEN_RESOURCE_ID_MAX + 64, BUSY_WAIT_MS = 200, BUSY_TRIES = 150 };

/* The scene's own text goes into the envelope, so that its numbers stay as they were written. */
static int envelope_write(const struct pen_buf *scene, const json_t *override, struct pen_buf *out,
	struct pen_error *err)
{
	char *patch = override ? json_dumps(override, JSON_COMPACT) : NULL;

	if (override && !patch)
		return pen_error_memory(err);
	(void)pen_buf_text(out, "{\"scene\":");
	(void)pen_buf_append(out, scene->data, scene->size);
	if (patch) {
		(void)pen_buf_text(out, ",\"override\":");
		(void)pen_buf_text(out, patch);
	}
	(void)pen_buf_text(out, "}");
	free(patch);
	return out->failed ? pen_error_memory(err) : 0;
}

static int answer_read(
	struct pen_client *client, struct pen_resource *ret_resource, struct pen_error *err)
{
	return pen_resource_read(pen_client_answer(client), ret_resource, err);
}

int pen_renders_submit(struct pen_client *client, const struct pen_buf *scene,
	const json_t *override, struct pen_resource *ret_resource, struct pen_error *err)
{
	struct pen_buf body;
	int r;

	pen_buf_init(&body, PEN_HTTP_BODY_MAX);
	r = envelope_write(scene, override, &body, err);
	if (r == 0)
		r = pen_client_call(client, "POST", "/v1/renders", body.data, body.size, err);
	if (r == 0)
		r = answer_read(client, ret_resource, err);
	pen_buf_finish(&body);
	return r;
}

/* Only an id that is one becomes part of a path. */
static int path_of(const char *id, const char *rest, char *ret_path, struct pen_error *err)
{
	if (!pen_resource_id_valid(id))
		return pen_error_set(err, PEN_ENOTFOUND, "'%.80s' is no render's id", id);
	(void)snprintf(ret_path, PATH_SIZE, "/v1/renders/%s%s", id, rest);
	return 0;
}

int pen_renders_get(struct pen_client *client, const char *id, struct pen_resource *ret_resource,
	struct pen_error *err)
{
	char path[PATH_SIZE];
	int r = path_of(id, "", path, err);

	if (r == 0)
		r = pen_client_call(client, "GET", path, NULL, 0, err);
	return r < 0 ? r : answer_read(client, ret_resource, err);
}

/* Asks for the change that body says. */
static int patch(struct pen_client *client, const char *id, const char *body,
	struct pen_resource *ret_resource, struct pen_error *err)
{
	char path[PATH_SIZE];
	int r = path_of(id, "", path, err);

	if (r == 0)
		r = pen_client_call(client, "PATCH", path, body, strlen(body), err);
	return r < 0 ? r : answer_read(client, ret_resource, err);
}

int pen_renders_set_state(struct pen_client *client, const char *id, const char *state,
	struct pen_resource *ret_resource, struct pen_error *err)
{
	char body[64];

	(void)snprintf(body, sizeof body, "{\"state\":\"%s\"}", state);
	return patch(client, id, body, ret_resource, err);
}

int pen_renders_set_priority(struct pen_client *client, const char *id, unsigned priority,
	struct pen_resource *ret_resource, struct pen_error *err)
{
	char body[64];

	(void)snprintf(body, sizeof body, "{\"priority\":%u}", priority);
	return patch(client, id, body, ret_resource, err);
}

/* Short renders are asked for often, long ones seldom. */
static int64_t pause_ms(int64_t since_ms, int64_t interval_ms)
{
	int64_t pause = (pen_clock_ms() - since_ms) / 20 + 2;

	return pause < interval_ms ? pause : interval_ms;
}

int pen_renders_follow(struct pen_client *client, const struct pen_follow *follow,
	struct pen_resource *resource, struct pen_error *err)
{
	int64_t start_ms = pen_clock_ms(), heard_ms = start_ms;
	int r = 0;

	while (!pen_resource_over(resource)) {
		pen_interrupt_sleep(pause_ms(start_ms, follow->interval_ms));
		r = pen_renders_get(client, resource->id, resource, err);
		if (pen_interrupted())
			return pen_error_set(err, PEN_ECLOSED, "interrupted");
		if (r == 0)
			heard_ms = pen_clock_ms();
		else if (r != PEN_ECLOSED || pen_clock_ms() - heard_ms >= follow->patience_ms)
			return r;
		pen_progress_update(follow->progress, resource);
		if (r == 0 && follow->news)
			r = follow->news(follow->user, resource, err);
		if (r < 0 && follow->news && r != PEN_ECLOSED)
			return r;
	}
	return 0;
}

int pen_renders_outcome(
	struct pen_client *client, const struct pen_resource *resource, struct pen_error *err)
{
	if (strcmp(resource->state, "done") == 0)
		return 0;
	if (strcmp(resource->state, "cancelled") == 0)
		return pen_error_set(err, PEN_ECONFLICT, "the render was cancelled");
	return pen_error_set(err, PEN_EIO, "the render failed: %s",
		pen_resource_reason(pen_client_answer(client)));
}

int pen_renders_download(struct pen_client *client, const char *id, uint32_t frame,
	enum pen_image_format format, int fd, struct pen_error *err)
{
	const char *extension = pen_image_format_extension(format);
	char path[PATH_SIZE], name[32];
	int r;

	if (frame == 0)
		(void)snprintf(name, sizeof name, "/image.%s", extension);
	else
		(void)snprintf(name, sizeof name, "/frames/%u.%s", frame, extension);
	r = path_of(id, name, path, err);
	if (r == 0)
		r = pen_client_download(client, path, fd, err);
	for (int tries = 0; r == PEN_EAGAIN && tries < BUSY_TRIES; tries++) {
		pen_interrupt_sleep(BUSY_WAIT_MS);
		r = pen_client_download(client, path, fd, err);
	}
	return r;
}
