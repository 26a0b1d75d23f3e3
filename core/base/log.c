/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static struct {
	const char *name;
	enum pen_log_level level;
} sink = {"penumbra", PEN_LOG_INFO};

void pen_log_open(const char *name, enum pen_log_level level)
{
	sink.name = name;
	sink.level = level;
}

void pen_log(enum pen_log_level level, const char *format, ...)
{
	static const char *const names[] = {"error", "warning", "info", "debug"};
	char line[1024];
	struct timespec now;
	struct tm utc;
	va_list args;
	size_t used;
	int n;

	if (level > sink.level)
		return;
	(void)clock_gettime(CLOCK_REALTIME, &now);
	(void)gmtime_r(&now.tv_sec, &utc);
	used = strftime(line, sizeof line, "%Y-%m-%dT%H:%M:%S", &utc);
	n = snprintf(line + used, sizeof line - used, ".%03ldZ %s[%ld] %s: ", now.tv_nsec / 1000000,
		sink.name, (long)getpid(), names[level]);
	used += n > 0 ? (size_t)n : 0;
	va_start(args, format);
	n = vsnprintf(line + used, sizeof line - used - 1, format, args);
	va_end(args);
	if (n > 0)
		used += (size_t)n;
	if (used > sizeof line - 2)
		used = sizeof line - 2;
	line[used++] = '\n';
	(void)!write(STDERR_FILENO, line, used);
}
