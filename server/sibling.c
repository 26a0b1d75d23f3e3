/* SPDX-License-Identifier: Apache-2.0 */
#include "server/sibling.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

void pen_sibling_path(const char *name, char *ret_path, size_t size)
{
	/* A build's directory of programs, then an installation's of those that only we call. */
	static const char *const places[] = {"", "/../libexec/penumbra"};
	char self[PATH_MAX];
	ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
	char *slash;

	self[length > 0 ? length : 0] = '\0';
	slash = strrchr(self, '/');
	if (slash)
		*slash = '\0';
	for (size_t i = 0; slash && i < sizeof places / sizeof *places; i++)
		if (snprintf(ret_path, size, "%s%s/%s", self, places[i], name) < (int)size &&
			access(ret_path, X_OK) == 0)
			return;
	(void)snprintf(ret_path, size, "%s", name);
}
