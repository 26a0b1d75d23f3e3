/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_LOG_H
#define PEN_BASE_LOG_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * One line an event on standard error, for programs (libraries return errors instead).
 * Levels are defined by rate: error and warning by fault, info at most a few a render,
 * debug a few a unit of work.
 */
enum pen_log_level { PEN_LOG_ERROR, PEN_LOG_WARNING, PEN_LOG_INFO, PEN_LOG_DEBUG };

/* "2026-01-31T12:00:00.123Z NAME[PID] level: text", or the same and the ids as a JSON object. */
enum pen_log_format { PEN_LOG_TEXT, PEN_LOG_JSON };

/* What an event is about; what is NULL, "" or zero is not known. For people it is in the text. */
struct pen_log_about {
	const char *request; /* the HTTP request's id */
	const char *job;     /* the render's id */
	const char *trace;   /* the render's traceparent, see server/trace_context.h */
	uint64_t worker;
	bool has_unit; /* then, of a unit of work: */
	uint32_t frame, tile, round;
};

/* Lines above level are dropped; name stands in each line. Call once, before threads. */
void pen_log_open(const char *name, enum pen_log_level level, enum pen_log_format format);

/* Writes a line in one write(2), cut to its longest length; never blocks on a lock. */
void pen_log(enum pen_log_level level, const char *format, ...)
	__attribute__((format(printf, 2, 3)));
void pen_log_of(const struct pen_log_about *about, enum pen_log_level level, const char *format,
	...) __attribute__((format(printf, 3, 4)));

/* What was opened: programs that this one starts shall write the same. */
enum pen_log_format pen_log_format(void);

/* As --log-level and --log-format take them; PEN_EINVALID says what they take. */
const char *pen_log_level_name(enum pen_log_level level);
const char *pen_log_format_name(enum pen_log_format format);
int pen_log_level_parse(const char *text, enum pen_log_level *ret_level, struct pen_error *err);
int pen_log_format_parse(const char *text, enum pen_log_format *ret_format, struct pen_error *err);

#endif
