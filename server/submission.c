/* SPDX-License-Identifier: Apache-2.0 */
#include "server/submission.h"

#include "core/scene/canonical.h"
#include "server/shelf.h"
#include "server/world.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PRIORITY_DEFAULT = 50, PRIORITY_MAX = 100 };

/* Appends "/key" as RFC 6901 writes it; a key that is too long leaves the pointer at its parent. */
static void extend_pointer(char *pointer, size_t size, const char *key)
{
	size_t start = strlen(pointer), used = start;

	if (used + 1 < size)
		pointer[used++] = '/';
	for (; *key && used + 2 < size; key++) {
		bool escaped = *key == '~' || *key == '/';

		pointer[used++] = escaped ? '~' : *key;
		if (escaped)
			pointer[used++] = *key == '~' ? '0' : '1';
	}
	pointer[*key ? start : used] = '\0';
}

/* key is a member of the value at parent, or NULL for that value itself. */
static void blame(struct pen_submission_reading *reading, const char *parent, const char *key,
	const char *detail)
{
	struct pen_scene_errors *errors = &reading->errors;
	struct pen_scene_error *error;

	if (errors->count == PEN_SCENE_ERRORS_MAX)
		return;
	error = &errors->items[errors->count++];
	(void)snprintf(error->pointer, sizeof error->pointer, "%s", parent);
	if (key)
		extend_pointer(error->pointer, sizeof error->pointer, key);
	(void)snprintf(error->detail, sizeof error->detail, "%s", detail);
}

/* Each takes the value of an option into reading and returns NULL, or what is wrong with it. */

static const char *read_name(struct pen_submission_reading *reading, const json_t *value)
{
	if (!json_is_string(value) || json_string_length(value) > PEN_NAME_MAX ||
		strlen(json_string_value(value)) != json_string_length(value))
		return "must be a string of at most 256 bytes";
	(void)snprintf(reading->name, sizeof reading->name, "%s", json_string_value(value));
	reading->submission.name = reading->name;
	return NULL;
}

static const char *read_priority(struct pen_submission_reading *reading, const json_t *value)
{
	json_int_t number = json_integer_value(value);

	if (!json_is_integer(value) || number < 0 || number > PRIORITY_MAX)
		return "must be an integer from 0 to 100";
	reading->submission.priority = (uint32_t)number;
	return NULL;
}

static const char *read_verify(struct pen_submission_reading *reading, const json_t *value)
{
	const char *name = json_string_value(value);

	return name && pen_verify_parse(name, &reading->submission.verify)
		       ? NULL
		       : "must be \"none\", \"spot\" or \"full\"";
}

static const char *read_preview(struct pen_submission_reading *reading, const json_t *value)
{
	reading->submission.is_preview = json_is_true(value);
	return json_is_boolean(value) ? NULL : "must be true or false";
}

static const char *read_deadline(struct pen_submission_reading *reading, const json_t *value)
{
	const double seconds = json_number_value(value);

	reading->submission.deadline_s = seconds;
	return json_is_number(value) && seconds > 0 && seconds <= PEN_DEADLINE_S_MAX
		       ? NULL
		       : "must be a number of seconds above 0, at most a year";
}

static const char *read_replaces(struct pen_submission_reading *reading, const json_t *value)
{
	char *replaces = reading->submission.replaces;

	if (json_string_length(value) != PEN_JOB_ID_TEXT - 1)
		return "must be the id of a render";
	(void)snprintf(replaces, PEN_JOB_ID_TEXT, "%s", json_string_value(value));
	return NULL;
}

static void read_option(
	struct pen_submission_reading *reading, const char *key, const json_t *value)
{
	static const struct {
		const char *key;
		const char *(*read)(struct pen_submission_reading *reading, const json_t *value);
	} options[] = {
		{"name", read_name},
		{"priority", read_priority},
		{"verify", read_verify},
		{"preview", read_preview},
		{"deadline_s", read_deadline},
		{"replaces", read_replaces},
	};
	const char *wrong = "is no option";

	for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
		if (strcmp(key, options[i].key) == 0)
			wrong = options[i].read(reading, value);
	}
	if (wrong)
		blame(reading, "/options", key, wrong);
}

/* In place of its name the scene that is kept; NULL after blame. */
static json_t *take_kept(
	struct pen_submission_reading *reading, json_t *tree, struct pen_shelf *shelf)
{
	static const char prefix[] = "sha256:";
	const char *text = json_string_value(json_object_get(tree, "scene"));
	struct pen_sha256 name;
	json_t *kept;

	if (strncmp(text, prefix, strlen(prefix)) != 0 ||
		strlen(text) != strlen(prefix) + PEN_SHA256_TEXT - 1 ||
		!pen_sha256_parse(text + strlen(prefix), &name)) {
		blame(reading, "/scene", NULL,
			"must be an object, or \"sha256:\" and 64 hex digits");
		return NULL;
	}
	if (pen_shelf_get(shelf, &name, &kept, NULL) < 0) {
		blame(reading, "/scene", NULL,
			"this scene is not kept here: PUT it to /v1/scenes/sha256/… first");
		return NULL;
	}
	return json_object_set_new(tree, "scene", kept) == 0 ? kept : NULL;
}

/* The scene of an envelope with its override merged in; NULL after blame. Borrowed from tree. */
static json_t *open_envelope(
	struct pen_submission_reading *reading, json_t *tree, struct pen_shelf *shelf)
{
	json_t *scene = json_object_get(tree, "scene");
	json_t *override = json_object_get(tree, "override");
	json_t *options = json_object_get(tree, "options");
	struct pen_error err = PEN_ERROR_INIT;
	const char *key;
	json_t *value;

	json_object_foreach (tree, key, value) {
		if (value != scene && value != override && value != options)
			blame(reading, "", key, "is unknown beside scene, override and options");
	}
	if (options && !json_is_object(options))
		blame(reading, "/options", NULL, "must be an object");
	json_object_foreach (options, key, value) {
		read_option(reading, key, value);
	}
	if (json_is_string(scene))
		scene = take_kept(reading, tree, shelf);
	else if (!json_is_object(scene))
		blame(reading, "/scene", NULL, "must be an object");
	if (override && !json_is_object(override))
		blame(reading, "/override", NULL, "must be an object");
	else if (override && json_is_object(scene) &&
		 pen_json_merge_patch(scene, override, &err) < 0)
		blame(reading, "/override", NULL, err.text);
	return reading->errors.count == 0 ? scene : NULL;
}

static int read_tree(struct pen_submission_reading *reading, json_t *tree, struct pen_error *err)
{
	struct pen_buf canonical;
	struct pen_scene *scene;
	int r;

	r = pen_scene_parse(tree, &scene, &reading->errors, err);
	if (r < 0)
		return r;
	/* Defaults make the text longer than what was sent; the limit is that of memory. */
	pen_buf_init(&canonical, PEN_SCENE_MEMORY_MAX);
	r = pen_json_canonical(tree, &canonical, err);
	if (r == 0)
		r = pen_sha256_of(canonical.data, canonical.size, &reading->submission.sha256, err);
	if (r == 0)
		r = pen_world_of(
			tree, &reading->submission.has_world, &reading->submission.world, err);
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

static int read_envelope(struct pen_submission_reading *reading, json_t *tree,
	struct pen_shelf *shelf, struct pen_error *err)
{
	json_t *scene = open_envelope(reading, tree, shelf);

	if (!scene)
		return pen_error_set(err, PEN_EINVALID, "the envelope is not valid");
	reading->prefix = "/scene";
	return read_tree(reading, scene, err);
}

int pen_submission_read(const char *text, size_t size, struct pen_shelf *shelf,
	struct pen_submission_reading *ret_reading, struct pen_error *err)
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
	if (json_object_get(tree, "scene"))
		r = read_envelope(ret_reading, tree, shelf, err);
	else
		r = read_tree(ret_reading, tree, err);
	json_decref(tree);
	return r;
}
