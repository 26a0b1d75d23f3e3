/* SPDX-License-Identifier: Apache-2.0 */
#include "server/content.h"

#include "core/base/limits.h"

#include <stdio.h>
#include <string.h>

int pen_content_of(const struct pen_sha256 *scene, const char *equivalence_class,
	struct pen_sha256 *ret_content, struct pen_error *err)
{
	char text[PEN_SHA256_TEXT + PEN_CLASS_BYTES_MAX + 2];

	pen_sha256_format(scene, text);
	(void)snprintf(text + PEN_SHA256_TEXT - 1, sizeof text - PEN_SHA256_TEXT + 1, " %s",
		equivalence_class);
	return pen_sha256_of(text, strlen(text), ret_content, err);
}
