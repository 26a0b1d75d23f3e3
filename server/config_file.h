/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CONFIG_FILE_H
#define PEN_SERVER_CONFIG_FILE_H

#include "core/base/error.h"

/* One setting of a file. A refusal's text says what the setting takes, nothing of the file. */
typedef int (*pen_config_set)(
	void *user, const char *key, const char *value, struct pen_error *err);

/*
 * Hands each "key = value" of the file to set, in order, without the blanks about either. A line
 * may be empty; # begins a comment at the start of a line or behind a blank. Stops at the first
 * fault, whose text begins with "FILE:LINE: ". PEN_ENOTFOUND: there is no such file.
 */
int pen_config_file_read(const char *path, pen_config_set set, void *user, struct pen_error *err);

#endif
