/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_PRINT_H
#define PEN_SERVER_CLI_PRINT_H

#include <jansson.h>
#include <stddef.h>
#include <stdio.h>

/*
 * Answers for people, on standard output unless a stream is given; what of them could drive a
 * terminal is not shown.
 */

/* The answer as it came, indented, for programs. */
void pen_print_json(const json_t *answer);

/* Each member that is a text, a number or a boolean, as "key: value". */
void pen_print_members(json_t *object);

/* The errors that a render or a refusal lists, as "  pointer: detail". */
void pen_print_errors(const json_t *answer, FILE *stream);

/* The warnings that a render lists, behind prefix. */
void pen_print_warnings(const json_t *answer, const char *prefix, FILE *stream);

/* Rows (an array of objects) under the keys given, in aligned columns. */
void pen_print_table(const json_t *rows, const char *const *keys, size_t key_count);

#endif
