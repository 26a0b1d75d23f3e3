/* SPDX-License-Identifier: Apache-2.0 */
#include "server/submission.h"

#include "core/scene/canonical.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PRIORITY_DEFAULT = 50, PRIORITY_MAX = 100 };

static void blame(struct pen_submission_reading *reading, const char *pointer, const char *detail)
{
	struct pen_scene_errors *errors = &reading->errors;
	struct pen_scene_error *error;

	if (errors->count == PEN_SCENE_ERRORS_MAX)
		return;
	error = &errors->items[errors->count++];
	(void)snprintf(error->pointer, sizeof error->pointer, "%s", pointer);
	(void)snprintf(error->detail, sizeof error->detail, "%s", detail);
}

static void read_name(struct pen_submission_reading *reading, const json_t *value)
{
	if (!json_is_string(value) || json_string_length(value) > PEN_NAME_MAX ||
		strlen(json_string_value(value)) != json_string_length(value)) {
		blame(reading, "/options/name", "must be a string of at most 256 bytes");
		return;
	}
	(void)snprintf(reading->name, sizeof reading->name, "%s", json_string_value(value));
	reading->submission.name = reading->name;
}

static void read_priority(struct pen_submission_reading *reading, const json_t *value)
{
	json_int_t number = json_integer_value(value);

	if (!json_is_integer(value) || number < 0 || number > PRIORITY_MAX)
		blame(reading, "/options/priority", "must be an integer from 0 to 100");
	else
		reading->submission.priority = (uint32_t)number;
}

static void read_options(struct pen_submission_reading *reading, json_t *options)
{
	const char *key;
	json_t *value;

	if (!json_is_object(options)) {
		blame(reading, "/options", "must be an object");
		return;
	}
	json_object_foreach (options, key, value) {
		if (strcmp(key, "name") == 0) {
			read_name(reading, value);
		} else if (strcmp(key, "priority") == 0) {
			read_priority(reading, value);
		} else if (strcmp(key, "verify") == 0) {
			if (!json_is_string(value) || strcmp(json_string_value(value), "none") != 0)
				blame(reading, "/options/verify",
					"only \"none\"; anything else is not supported yet");
		} else if (strcmp(key, "preview") == 0) {
			if (!json_is_false(value))
				blame(reading, "/options/preview",
					"only false; anything else is not supported yet");
		} else if (strcmp(key, "deadline_s") == 0) {
			blame(reading, "/options/deadline_s", "not supported yet");
		} else if (strcmp(key, "replaces") == 0) {
			blame(reading, "/options/replaces", "not supported yet");
		} else {
			blame(reading, "/options",
				"has an unknown key; known are name, priority, verify, preview, "
				"deadline_s and replaces");
		}
	}
}

/* The scene of an envelope with its override merged in; NULL after blame. Borrowed from tree. */
static json_t *open_envelope(struct pen_submission_reading *reading, json_t *tree)
{
	json_t *scene = json_object_get(tree, "scene");
	json_t *override = json_object_get(tree, "override");
	struct pen_error err = PEN_ERROR_INIT;
	const char *key;
	json_t *value;

	json_object_foreach (tree, key, value) {
		if (strcmp(key, "options") == 0)
			read_options(reading, value);
		else if (strcmp(key, "scene") != 0 && strcmp(key, "override") != 0)
			blame(reading, "",
				"has an unknown key; an envelope has scene, override and options");
	}
	if (json_is_string(scene))
		blame(reading, "/scene", "a scene by its hash is not supported yet");
	else if (!json_is_object(scene))
		blame(reading, "/scene", "must be an object");
	else if (override && !json_is_object(override))
		blame(reading, "/override", "must be an object");
	else if (override && pen_json_merge_patch(scene, override, &err) < 0)
		blame(reading, "/override", err.text);
	return reading->errors.count == 0 ? scene : NULL;
}

static int read_tree(struct pen_submission_reading *reading, json_t *tree, struct pen_error *err)
{
	struct pen_buf canonical;
	struct pen_scene *scene;
	int r;

	if (json_object_get(tree, "scene")) {
		tree = open_envelope(reading, tree);
		if (!tree)
			return pen_error_set(err, PEN_EINVALID, "the envelope is not valid");
		reading->prefix = "/scene";
	}
	r = pen_scene_parse(tree, &scene, &reading->errors, err);
	if (r < 0)
		return r;
	/* Defaults make the text longer than what was sent; the limit is that of memory. */
	pen_buf_init(&canonical, PEN_SCENE_MEMORY_MAX);
	r = pen_json_canonical(tree, &canonical, err);
	if (r < 0) {
		pen_buf_finish(&canonical);
		pen_scene_destroy(scene);
		return r;
	}
	reading->submission.scene = scene;
	reading->submission.canonical_size = canonical.size;
	reading->submission.canonical = pen_buf_take(&canonical);
	return 0;
}

int pen_submission_read(const char *text, size_t size, struct pen_submission_reading *ret_reading,
	struct pen_error *err)
{
	json_t *tree;
	int r;

	*ret_reading = (struct pen_submission_reading){
		.submission.priority = PRIORITY_DEFAULT,
		.prefix = "",
	};
	r = pen_json_parse(text, size, &tree, err);
	if (r < 0)
		return r;
	r = read_tree(ret_reading, tree, err);
	json_decref(tree);
	return r;
}
