/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_KEY_FILE_H
#define PEN_SERVER_KEY_FILE_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * Files that hold keys: lines of words between blanks, at most PEN_KEY_FILE_MAX bytes, which
 * nobody but their owner may read. Empty lines, and those that begin with #, say nothing.
 */

enum { PEN_KEY_WORDS_MAX = 3 };

/* The words of one line; those that are not there are "". A refusal needs no place in its text. */
typedef int (*pen_key_line)(void *user, char *words[PEN_KEY_WORDS_MAX], struct pen_error *err);

/*
 * Hands each line to take, in order. PEN_ENOTFOUND: there is no such file. PEN_EINVALID: others
 * may read it (unless it is a credential of the service manager), or a line is wrong.
 */
int pen_key_file_read(const char *path, pen_key_line take, void *user, struct pen_error *err);

/* Replaces it as a whole, of mode 0600, for the owner of its directory. */
int pen_key_file_write(const char *path, const char *text, size_t size, struct pen_error *err);

/*
 * Holds off others that would change a file of the same directory; *ret_lock is a descriptor,
 * closing which lets go.
 */
int pen_key_file_lock(const char *path, int *ret_lock, struct pen_error *err);

/* Which version of the file is there: differs whenever it was replaced; 0 when there is none. */
uint64_t pen_key_file_version(const char *path);

/* 1 to PEN_KEY_NAME_MAX letters, digits, dots, dashes and underscores: safe in logs and files. */
bool pen_key_name_valid(const char *name);

#endif
