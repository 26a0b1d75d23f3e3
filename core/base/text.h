/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_TEXT_H
#define PEN_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * The bytes of text, from its start, that are whole UTF-8 characters (Unicode's table of
 * well-formed sequences, D92) and none a control character: strlen(text) when all of it may be
 * shown to people and written to a log.
 */
size_t pen_text_plain(const char *text);

/* Makes all of it so: the ends of lines and tabs become spaces, every other misfit a '?'. */
void pen_text_clean(char *text);

/* Whether text is exactly count finite numbers with commas between them; they are then these. */
bool pen_text_reals(const char *text, size_t count, double *ret_numbers);

/* Writes the number in lower-case hex, without zeros in front and without a NUL; tells where it
 * ends. */
char *pen_text_hex(char *to, uint64_t number);

#endif
