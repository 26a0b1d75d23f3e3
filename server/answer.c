/* SPDX-License-Identifier: Apache-2.0 */
#include "server/answer.h"

#include "server/tree.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PROBLEM_TYPE "application/problem+json"

void pen_answer_init(struct pen_answer *answer, unsigned status)
{
	answer->status = status;
	answer->content_type = NULL;
	answer->text = NULL;
	answer->fd = -1;
	answer->bytes = NULL;
	answer->offset = answer->size = 0;
	answer->field_count = answer->values_size = 0;
}

void pen_answer_finish(struct pen_answer *answer)
{
	free(answer->text);
	if (answer->fd >= 0)
		(void)close(answer->fd);
	pen_shared_bytes_release(answer->bytes);
	answer->text = NULL;
	answer->fd = -1;
	answer->bytes = NULL;
}

/* Makes a field of what has been written behind the values. */
static void add_field(struct pen_answer *answer, const char *name, size_t length)
{
	assert(answer->field_count < PEN_ANSWER_FIELDS_MAX && length < PEN_ANSWER_VALUE);
	answer->fields[answer->field_count++] =
		(struct pen_answer_field){name, answer->values + answer->values_size};
	answer->values_size += length + 1;
}

void pen_answer_field(struct pen_answer *answer, const char *name, const char *value)
{
	const size_t length = strlen(value);

	assert(length < sizeof answer->values - answer->values_size);
	memcpy(answer->values + answer->values_size, value, length + 1);
	add_field(answer, name, length);
}

void pen_answer_field_of(struct pen_answer *answer, const char *name, const char *format, ...)
{
	const size_t room = sizeof answer->values - answer->values_size;
	va_list args;
	int n;

	va_start(args, format);
	n = vsnprintf(answer->values + answer->values_size, room, format, args);
	va_end(args);
	assert(n >= 0 && (size_t)n < room);
	add_field(answer, name, (size_t)n);
}

void pen_answer_text(struct pen_answer *answer, unsigned status, const char *content_type,
	const char *text, size_t size)
{
	pen_answer_init(answer, status);
	answer->text = malloc(size);
	if (!answer->text) {
		pen_answer_error(answer, &(struct pen_error){PEN_ENOMEM, "out of memory"});
		return;
	}
	memcpy(answer->text, text, size);
	answer->content_type = content_type;
	answer->size = size;
}

static void body_of(struct pen_answer *answer, const char *content_type, json_t *tree)
{
	answer->text = pen_tree_text(tree);
	if (!answer->text)
		return;
	answer->content_type = content_type;
	answer->size = strlen(answer->text);
}

void pen_answer_json(struct pen_answer *answer, unsigned status, json_t *tree)
{
	pen_answer_init(answer, status);
	body_of(answer, "application/json", tree);
	if (!answer->text)
		pen_answer_error(answer, &(struct pen_error){PEN_ENOMEM, "out of memory"});
}

static const char *title_of(unsigned status)
{
	static const struct {
		unsigned status;
		const char *title;
	} titles[] = {
		{400, "Bad Request"},
		{401, "Unauthorized"},
		{403, "Forbidden"},
		{404, "Not Found"},
		{405, "Method Not Allowed"},
		{406, "Not Acceptable"},
		{409, "Conflict"},
		{410, "Gone"},
		{413, "Content Too Large"},
		{415, "Unsupported Media Type"},
		{416, "Range Not Satisfiable"},
		{421, "Misdirected Request"},
		{422, "Unprocessable Content"},
		{429, "Too Many Requests"},
		{500, "Internal Server Error"},
		{501, "Not Implemented"},
		{503, "Service Unavailable"},
		{507, "Insufficient Storage"},
	};

	for (size_t i = 0; i < sizeof titles / sizeof titles[0]; i++) {
		if (titles[i].status == status)
			return titles[i].title;
	}
	return "Error";
}

static json_t *problem(unsigned status, const char *detail)
{
	return json_pack("{s:s, s:s, s:i, s:s}", "type", "about:blank", "title", title_of(status),
		"status", (int)status, "detail", detail);
}

void pen_answer_problem(struct pen_answer *answer, unsigned status, const char *detail)
{
	pen_answer_init(answer, status);
	body_of(answer, PROBLEM_TYPE, problem(status, detail));
}

void pen_answer_scene_errors(
	struct pen_answer *answer, const struct pen_scene_errors *errors, const char *prefix)
{
	json_t *tree = problem(400, "the scene is not valid: see errors");
	json_t *list = json_array();

	for (size_t i = 0; i < errors->count; i++) {
		const struct pen_scene_error *error = &errors->items[i];

		pen_tree_append(&list, json_pack("{s:s+, s:s}", "pointer", prefix, error->pointer,
					       "detail", error->detail));
	}
	pen_tree_set(&tree, "errors", list);
	pen_answer_init(answer, 400);
	body_of(answer, PROBLEM_TYPE, tree);
	if (!answer->text)
		pen_answer_error(answer, &(struct pen_error){PEN_ENOMEM, "out of memory"});
}

static unsigned status_of(int code)
{
	switch (code) {
	case PEN_EINVALID:
	case PEN_EUNSUPPORTED: return 400;
	case PEN_ENOTFOUND: return 404;
	case PEN_ECONFLICT: return 409;
	case PEN_ELIMIT: return 413;
	case PEN_EAGAIN:
	case PEN_ENOMEM:
	case PEN_ECLOSED: return 503;
	case PEN_ENOSPACE: return 507;
	default: return 500;
	}
}

void pen_answer_error(struct pen_answer *answer, const struct pen_error *err)
{
	unsigned status = status_of(err->code);

	pen_answer_problem(answer, status, err->text);
	if (status == 503)
		pen_answer_field(answer, "Retry-After", "5");
}
