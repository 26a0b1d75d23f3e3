/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/print.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VALUE_SIZE = 128, COLUMNS_MAX = 12 };

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
