/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_COMPLAINT_H
#define PEN_SERVER_COMPLAINT_H

#include "core/base/error.h"

/* How the commands that work on this machine's files end, and what they then say on standard error.
 */
enum pen_command_end { PEN_COMMAND_OK, PEN_COMMAND_FAILED, PEN_COMMAND_USAGE };

/* Says what is wrong with the words after a command; PEN_COMMAND_USAGE. */
int pen_complain_usage(const char *command, const char *text);

/* Says what went wrong; PEN_COMMAND_FAILED. */
int pen_complain(const struct pen_error *err);

#endif
