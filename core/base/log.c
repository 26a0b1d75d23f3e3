/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/log.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
	TEXT_MAX = 896, /* of an event, before JSON makes it longer */
	LINE_MAX_BYTES = 8192,
	TRACE_ID_AT = 3, /* in a traceparent */
	TRACE_ID = 32,
	SPAN_ID_AT = TRACE_ID_AT + TRACE_ID + 1,
	SPAN_ID = 16
};

struct line {
	size_t used;
	char bytes[LINE_MAX_BYTES];
};

static struct {
	const char *name;
	enum pen_log_level level;
	enum pen_log_format format;
} sink = {"penumbra", PEN_LOG_INFO, PEN_LOG_TEXT};

static const char *const level_names[] = {"error", "warning", "info", "debug"};
static const char *const format_names[] = {"text", "json"};

void pen_log_open(const char *name, enum pen_log_level level, enum pen_log_format format)
{
	sink.name = name;
	sink.level = level;
	sink.format = format;
}

enum pen_log_format pen_log_format(void)
{
	return sink.format;
}

static __attribute__((format(printf, 2, 3))) void put(struct line *line, const char *format, ...)
{
	const size_t room = sizeof line->bytes - line->used;
	va_list args;
	int n;

	va_start(args, format);
	n = vsnprintf(line->bytes + line->used, room, format, args);
	va_end(args);
	if (n > 0)
		line->used += (size_t)n < room ? (size_t)n : room - 1;
}

/* RFC 8259; the text is UTF-8, or its readers find what it is. */
static void put_string(struct line *line, const char *key, const char *text, size_t size)
{
	put(line, ",\"%s\":\"", key);
	for (size_t i = 0; i < size && text[i] != '\0'; i++) {
		const unsigned char c = (unsigned char)text[i];

		if (c < 0x20 || c == 0x7f)
			put(line, "\\u%04x", c);
		else
			put(line, c == '"' || c == '\\' ? "\\%c" : "%c", c);
	}
	put(line, "\"");
}

static void put_id(struct line *line, const char *key, const char *id)
{
	if (id && id[0] != '\0')
		put_string(line, key, id, TEXT_MAX);
}

static void put_ids(struct line *line, const struct pen_log_about *about)
{
	put_id(line, "request", about->request);
	put_id(line, "job", about->job);
	if (about->has_unit)
		put(line, ",\"frame\":%u,\"tile\":%u,\"round\":%u", about->frame, about->tile,
			about->round);
	if (about->worker > 0)
		put(line, ",\"worker\":%" PRIu64, about->worker);
	if (about->trace && strlen(about->trace) > SPAN_ID_AT + SPAN_ID) {
		put_string(line, "trace_id", about->trace + TRACE_ID_AT, TRACE_ID);
		put_string(line, "span_id", about->trace + SPAN_ID_AT, SPAN_ID);
	}
}

static void put_time(struct line *line)
{
	struct timespec now;
	struct tm utc;

	(void)clock_gettime(CLOCK_REALTIME, &now);
	(void)gmtime_r(&now.tv_sec, &utc);
	line->used += strftime(line->bytes + line->used, sizeof line->bytes - line->used,
		"%Y-%m-%dT%H:%M:%S", &utc);
	put(line, ".%03ldZ", now.tv_nsec / 1000000);
}

static void __attribute__((format(printf, 3, 0))) write_line(const struct pen_log_about *about,
	enum pen_log_level level, const char *format, va_list args)
{
	char text[TEXT_MAX];
	struct line line;

	line.used = 0;
	(void)vsnprintf(text, sizeof text, format, args);
	if (sink.format == PEN_LOG_JSON) {
		put(&line, "{\"time\":\"");
		put_time(&line);
		put(&line, "\",\"level\":\"%s\",\"program\":\"%s\",\"pid\":%ld", level_names[level],
			sink.name, (long)getpid());
		put_string(&line, "message", text, sizeof text);
		put_ids(&line, about);
		put(&line, "}\n");
	} else {
		put_time(&line);
		put(&line, " %s[%ld] %s: %s\n", sink.name, (long)getpid(), level_names[level],
			text);
	}
	(void)!write(STDERR_FILENO, line.bytes, line.used);
}

void pen_log(enum pen_log_level level, const char *format, ...)
{
	va_list args;

	if (level > sink.level)
		return;
	va_start(args, format);
	write_line(&(struct pen_log_about){0}, level, format, args);
	va_end(args);
}

void pen_log_of(
	const struct pen_log_about *about, enum pen_log_level level, const char *format, ...)
{
	va_list args;

	if (level > sink.level)
		return;
	va_start(args, format);
	write_line(about, level, format, args);
	va_end(args);
}

const char *pen_log_level_name(enum pen_log_level level)
{
	return level_names[level];
}

const char *pen_log_format_name(enum pen_log_format format)
{
	return format_names[format];
}

int pen_log_level_parse(const char *text, enum pen_log_level *ret_level, struct pen_error *err)
{
	for (size_t i = 0; i < sizeof level_names / sizeof *level_names; i++)
		if (strcmp(text, level_names[i]) == 0) {
			*ret_level = (enum pen_log_level)i;
			return 0;
		}
	return pen_error_set(err, PEN_EINVALID, "--log-level takes error, warning, info or debug");
}

int pen_log_format_parse(const char *text, enum pen_log_format *ret_format, struct pen_error *err)
{
	for (size_t i = 0; i < sizeof format_names / sizeof *format_names; i++)
		if (strcmp(text, format_names[i]) == 0) {
			*ret_format = (enum pen_log_format)i;
			return 0;
		}
	return pen_error_set(err, PEN_EINVALID, "--log-format takes text or json");
}
