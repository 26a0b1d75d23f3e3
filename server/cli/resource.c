/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/resource.h"

#include "core/base/limits.h"

#include <stdio.h>
#include <string.h>

bool pen_resource_id_valid(const char *text)
{
	static const char letters[] =
		"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";
	size_t length = strspn(text, letters);

	return length > 0 && length <= PEN_RESOURCE_ID_MAX && text[length] == '\0';
}

static double number(const json_t *tree, const char *key, double absent)
{
	const json_t *value = json_object_get(tree, key);

	return json_is_number(value) ? json_number_value(value) : absent;
}

static uint32_t count(const json_t *tree, const char *key, uint32_t absent)
{
	json_int_t value = json_integer_value(json_object_get(tree, key));

	return value > 0 && value <= PEN_FRAMES_MAX ? (uint32_t)value : absent;
}

int pen_resource_read(const json_t *tree, struct pen_resource *ret_resource, struct pen_error *err)
{
	const char *id = json_string_value(json_object_get(tree, "id"));
	const char *state = json_string_value(json_object_get(tree, "state"));
	const json_t *frames = json_object_get(tree, "frames");
	double samples = number(tree, "samples_done", 0);
	struct pen_resource resource = {
		.progress = number(tree, "progress", 0),
		.eta_seconds = number(tree, "eta_seconds", -1),
		.seconds = number(tree, "seconds", 0),
		.frame_first = (uint32_t)number(frames, "first", 1),
		.frames_total = count(frames, "total", 1),
		.frames_done = count(frames, "done", 0),
		.samples_done = samples > 0 && samples < 1e18 ? (uint64_t)samples : 0,
	};

	if (!id || !pen_resource_id_valid(id) || !state || strlen(state) >= sizeof resource.state)
		return pen_error_set(err, PEN_EPROTOCOL, "the server's answer is no render");
	(void)snprintf(resource.id, sizeof resource.id, "%s", id);
	(void)snprintf(resource.state, sizeof resource.state, "%s", state);
	*ret_resource = resource;
	return 0;
}

bool pen_resource_over(const struct pen_resource *resource)
{
	return strcmp(resource->state, "done") == 0 || strcmp(resource->state, "failed") == 0 ||
	       strcmp(resource->state, "cancelled") == 0;
}

const char *pen_resource_reason(const json_t *tree)
{
	const char *text = json_string_value(json_object_get(tree, "error"));

	return text ? text : "no reason given";
}
