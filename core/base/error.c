/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/error.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static void fill(struct pen_error *err, int code, const char *format, va_list args)
	__attribute__((format(printf, 3, 0)));

static void fill(struct pen_error *err, int code, const char *format, va_list args)
{
	err->code = code;
	(void)vsnprintf(err->text, sizeof err->text, format, args);
}

int pen_error_set(struct pen_error *err, int code, const char *format, ...)
{
	va_list args;

	if (!err)
		return code;
	va_start(args, format);
	fill(err, code, format, args);
	va_end(args);
	return code;
}

int pen_error_system(struct pen_error *err, int errno_value, const char *format, ...)
{
	int code = errno_value == ENOSPC || errno_value == EDQUOT ? PEN_ENOSPACE : PEN_EIO;
	char reason[128];
	va_list args;
	size_t used;

	if (!err)
		return code;
	va_start(args, format);
	fill(err, code, format, args);
	va_end(args);
	used = strlen(err->text);
	(void)snprintf(err->text + used, sizeof err->text - used, ": %s",
		strerror_r(errno_value, reason, sizeof reason));
	return code;
}

int pen_error_memory(struct pen_error *err)
{
	return pen_error_set(err, PEN_ENOMEM, "out of memory");
}
