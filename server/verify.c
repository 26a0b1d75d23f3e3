/* SPDX-License-Identifier: Apache-2.0 */
#include "server/verify.h"

#include <stddef.h>
#include <string.h>

static const char *const names[] = {"none", "spot", "full"};

const char *pen_verify_name(enum pen_verify verify)
{
	return names[verify];
}

bool pen_verify_parse(const char *name, enum pen_verify *ret_verify)
{
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		if (strcmp(name, names[i]) != 0)
			continue;
		*ret_verify = (enum pen_verify)i;
		return true;
	}
	return false;
}
