/* SPDX-License-Identifier: Apache-2.0 */
#include "server/complaint.h"

#include <stdio.h>

int pen_complain_usage(const char *command, const char *text)
{
	(void)fprintf(stderr, "penumbra: %s\nSee `penumbra %s --help`.\n", text, command);
	return PEN_COMMAND_USAGE;
}

int pen_complain(const struct pen_error *err)
{
	(void)fprintf(stderr, "penumbra: %s\n", err->text);
	return PEN_COMMAND_FAILED;
}
