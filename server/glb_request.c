/* SPDX-License-Identifier: Apache-2.0 */
#include "server/glb_request.h"

#include "core/base/text.h"
#include "server/tree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum parameter_kind {
	KIND_WHOLE,
	KIND_REAL,
	KIND_TEXT,
	KIND_LIST,
	KIND_COLOR,
	KIND_TIME,
	KIND_NAME
};

static const struct parameter {
	const char *name;
	enum parameter_kind kind;
	const char *section; /* of the scene, which the parameter is a member of */
} parameters[] = {
	{"width", KIND_WHOLE, "image"},
	{"height", KIND_WHOLE, "image"},
	{"aovs", KIND_LIST, "image"},
	{"samples", KIND_WHOLE, "sampling"},
	{"seed", KIND_WHOLE, "sampling"},
	{"mode", KIND_TEXT, "sampling"},
	{"aperture_radius", KIND_REAL, "camera"},
	{"focus_distance", KIND_REAL, "camera"},
	{"background", KIND_COLOR, "background"},
	{"time", KIND_TIME, NULL},
	{"shutter", KIND_TIME, NULL},
	{"name", KIND_NAME, NULL},
};

enum { PARAMETERS = sizeof parameters / sizeof parameters[0] };

/* A reading of the query; the first fault stays. */
struct reading {
	json_t *scene, *name; /* of the render, or NULL */
	double time, shutter;
	bool has_time;
	struct pen_error *err;
	int result;
};

/* The scene becomes NULL where memory lacks. */
static void set(json_t **scene, const char *section, const char *key, json_t *value)
{
	json_t *object = json_incref(json_object_get(*scene, section));

	if (!object)
		object = json_object();
	pen_tree_set(&object, key, value);
	pen_tree_set(scene, section, object);
}

/* Words with commas between them. */
static json_t *list_of(const char *text)
{
	json_t *list = json_array();

	for (;; text++) {
		const size_t length = strcspn(text, ",");

		pen_tree_append(&list, json_stringn(text, length));
		text += length;
		if (*text == '\0')
			return list;
	}
}

static json_t *value_of(const struct parameter *parameter, const char *text)
{
	double n[3];

	switch (parameter->kind) {
	case KIND_NAME:
	case KIND_TEXT: return json_string(text);
	case KIND_LIST: return list_of(text);
	case KIND_COLOR:
		return pen_text_reals(text, 3, n) ? json_pack("[f, f, f]", n[0], n[1], n[2]) : NULL;
	case KIND_WHOLE:
		if (!pen_text_reals(text, 1, n) || n[0] != floor(n[0]) || fabs(n[0]) > 1e15)
			return NULL;
		return json_integer((json_int_t)n[0]);
	default: return pen_text_reals(text, 1, n) ? json_real(n[0]) : NULL;
	}
}

static void take_time(struct reading *reading, const char *name, double seconds)
{
	*(strcmp(name, "time") == 0 ? &reading->time : &reading->shutter) = seconds;
	reading->has_time = true;
}

static const char *what_it_must_be(enum parameter_kind kind)
{
	switch (kind) {
	case KIND_COLOR: return "must be three numbers, as in 0.1,0.2,0.3";
	case KIND_NAME:
	case KIND_LIST:
	case KIND_TEXT: return "must be UTF-8";
	default: return "must be a number";
	}
}

static void take(void *user, const char *name, const char *text)
{
	struct reading *reading = user;
	const struct parameter *parameter = parameters;
	json_t *value;

	while (parameter < parameters + PARAMETERS && strcmp(parameter->name, name) != 0)
		parameter++;
	if (reading->result < 0)
		return;
	if (parameter == parameters + PARAMETERS) {
		reading->result = pen_error_set(reading->err, PEN_EINVALID,
			"the query has an unknown parameter; a GLB takes name, width, height, "
			"aovs, samples, seed, mode, aperture_radius, focus_distance, time, "
			"shutter and background");
		return;
	}
	value = value_of(parameter, text);
	if (!value) {
		reading->result = pen_error_set(reading->err, PEN_EINVALID, "%s in the query %s",
			parameter->name, what_it_must_be(parameter->kind));
		return;
	}
	if (parameter->kind == KIND_NAME) {
		json_decref(reading->name);
		reading->name = value;
	} else if (parameter->kind == KIND_TIME) {
		take_time(reading, name, json_real_value(value));
		json_decref(value);
	} else {
		set(&reading->scene, parameter->section,
			parameter->kind == KIND_COLOR ? "color" : name, value);
	}
}

int pen_glb_request_read(
	const struct pen_exchange *exchange, json_t **ret_envelope, struct pen_error *err)
{
	struct reading reading = {
		.scene = json_pack("{s:i, s:{s:i, s:i}, s:{s:s}, s:[{s:s}]}", "version", 1, "image",
			"width", 640, "height", 360, "integrator", "type", "path", "objects",
			"type", "gltf"),
		.err = err,
	};

	if (!reading.scene)
		return pen_error_memory(err);
	pen_exchange_each_query(exchange, take, &reading);
	if (reading.result < 0) {
		json_decref(reading.scene);
		json_decref(reading.name);
		return reading.result;
	}
	if (reading.has_time)
		set(&reading.scene, "camera", "shutter",
			json_pack("{s:f, s:f}", "open", reading.time, "close",
				reading.time + reading.shutter));
	*ret_envelope = reading.name ? json_pack("{s:o, s:{s:o}}", "scene", reading.scene,
					       "options", "name", reading.name)
				     : json_pack("{s:o}", "scene", reading.scene);
	if (!*ret_envelope)
		return pen_error_memory(err);
	return 0;
}

int pen_glb_request_text(json_t *envelope, const struct pen_sha256 *asset, char **ret_text,
	size_t *ret_size, struct pen_error *err)
{
	json_t *scene = json_object_get(envelope, "scene");
	json_t *object = json_array_get(json_object_get(scene, "objects"), 0);
	char name[PEN_SHA256_TEXT];
	char *text;

	pen_sha256_format(asset, name);
	if (json_object_set_new(object, "asset", json_sprintf("sha256:%s", name)) < 0)
		return pen_error_memory(err);
	text = pen_tree_text(json_incref(envelope));
	if (!text)
		return pen_error_memory(err);
	*ret_text = text;
	*ret_size = strlen(text);
	return 0;
}
