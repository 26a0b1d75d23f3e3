/* SPDX-License-Identifier: Apache-2.0 */
#include "server/sibling.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

void pen_sibling_path(const char *name, char *ret_path, size_t size)
{
	char self[PATH_MAX];
	ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
	char *slash;

	self[length > 0 ? length : 0] = '\0';
	slash = strrchr(self, '/');
	if (slash) {
		*slash = '\0';
		if (snprintf(ret_path, size, "%s/%s", self, name) < (int)size &&
			access(ret_path, X_OK) == 0)
			return;
	}
	(void)snprintf(ret_path, size, "%s", name);
}
