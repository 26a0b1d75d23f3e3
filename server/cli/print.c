/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/print.h"

#include "core/base/text.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VALUE_SIZE = 128, COLUMNS_MAX = 12, LINE_MAX_BYTES = 4096 };

void pen_print_json(const json_t *answer)
{
	(void)json_dumpf(answer, stdout, JSON_INDENT(2));
	(void)putchar('\n');
}

static void value_format(const json_t *value, char *ret_text)
{
	switch (value ? json_typeof(value) : JSON_NULL) {
	case JSON_STRING:
		(void)snprintf(ret_text, VALUE_SIZE, "%s", json_string_value(value));
		break;
	case JSON_INTEGER:
		(void)snprintf(
			ret_text, VALUE_SIZE, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
		break;
	case JSON_REAL: (void)snprintf(ret_text, VALUE_SIZE, "%.4g", json_real_value(value)); break;
	case JSON_TRUE: (void)snprintf(ret_text, VALUE_SIZE, "yes"); break;
	case JSON_FALSE: (void)snprintf(ret_text, VALUE_SIZE, "no"); break;
	default: (void)snprintf(ret_text, VALUE_SIZE, "-"); break;
	}
	for (char *c = ret_text; *c; c++)
		if (iscntrl((unsigned char)*c))
			*c = '?';
}

void pen_print_members(json_t *object)
{
	char text[VALUE_SIZE];
	const char *key;
	json_t *value;

	json_object_foreach (object, key, value) {
		if (json_is_object(value) || json_is_array(value) || json_is_null(value))
			continue;
		value_format(value, text);
		(void)printf("%s: %s\n", key, text);
	}
}

static int plain(const char *text)
{
	const size_t length = pen_text_plain(text);

	return length < LINE_MAX_BYTES ? (int)length : LINE_MAX_BYTES;
}

void pen_print_errors(const json_t *answer, FILE *stream)
{
	const json_t *error;
	size_t i;

	json_array_foreach (json_object_get(answer, "errors"), i, error) {
		const char *pointer = json_string_value(json_object_get(error, "pointer"));
		const char *detail = json_string_value(json_object_get(error, "detail"));

		if (!pointer || !detail)
			continue;
		/* The scene went out inside an envelope that the user has not written. */
		if (strncmp(pointer, "/scene/", 7) == 0)
			pointer += 6;
		if (*pointer == '\0')
			pointer = "/";
		(void)fprintf(
			stream, "  %.*s: %.*s\n", plain(pointer), pointer, plain(detail), detail);
	}
}

void pen_print_warnings(const json_t *answer, const char *prefix, FILE *stream)
{
	const json_t *warning;
	size_t i;

	json_array_foreach (json_object_get(answer, "warnings"), i, warning) {
		const char *text = json_string_value(warning);

		if (text)
			(void)fprintf(stream, "%s%.*s\n", prefix, plain(text), text);
	}
}

static void widths_measure(
	const json_t *rows, const char *const *keys, size_t key_count, size_t *ret_widths)
{
	char text[VALUE_SIZE];
	const json_t *row;
	size_t i;

	for (size_t k = 0; k < key_count; k++)
		ret_widths[k] = strlen(keys[k]);
	json_array_foreach (rows, i, row) {
		for (size_t k = 0; k < key_count; k++) {
			value_format(json_object_get(row, keys[k]), text);
			if (strlen(text) > ret_widths[k])
				ret_widths[k] = strlen(text);
		}
	}
}

void pen_print_table(const json_t *rows, const char *const *keys, size_t key_count)
{
	size_t widths[COLUMNS_MAX], i;
	char text[VALUE_SIZE];
	const json_t *row;

	widths_measure(rows, keys, key_count, widths);
	for (size_t k = 0; k < key_count; k++)
		(void)printf("%-*s%s", (int)widths[k], keys[k], k + 1 < key_count ? "  " : "\n");
	json_array_foreach (rows, i, row) {
		for (size_t k = 0; k < key_count; k++) {
			value_format(json_object_get(row, keys[k]), text);
			(void)printf(
				"%-*s%s", (int)widths[k], text, k + 1 < key_count ? "  " : "\n");
		}
	}
}
