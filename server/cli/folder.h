/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_FOLDER_H
#define PEN_SERVER_CLI_FOLDER_H

#include "core/base/buf.h"
#include "core/base/error.h"

/*
 * Files below a folder, by relative paths that somebody else may have written: none leads out of
 * it, by "..", by a symbolic link or from the root, and nothing is fetched from elsewhere.
 */

/* The folder that file lies in ("-": the current one), as a descriptor for the caller to close. */
int pen_folder_open(const char *file, int *ret_folder, struct pen_error *err);

/*
 * Appends the file at path to out, which has a ceiling. PEN_EINVALID when path is none that may
 * be, PEN_ENOTFOUND when no file is there, PEN_ELIMIT when it is larger than out may become.
 */
int pen_folder_read(int folder, const char *path, struct pen_buf *out, struct pen_error *err);

/* Appends all that fd has to give; name is for messages. */
int pen_folder_drain(int fd, const char *name, struct pen_buf *out, struct pen_error *err);

#endif
