/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_PRINT_H
#define PEN_SERVER_CLI_PRINT_H

#include <jansson.h>
#include <stddef.h>

/* Answers for people, on standard output; control characters in them are shown as '?'. */

/* The answer as it came, indented, for programs. */
void pen_print_json(const json_t *answer);

/* Each member that is a text, a number or a boolean, as "key: value". */
void pen_print_members(json_t *object);

/* Rows (an array of objects) under the keys given, in aligned columns. */
void pen_print_table(const json_t *rows, const char *const *keys, size_t key_count);

#endif
