/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_LOG_H
#define PEN_BASE_LOG_H

/*
 * One line an event on standard error, for programs (libraries return errors instead).
 * Levels are defined by rate: error and warning by fault, info at most a few a render,
 * debug a few a unit of work.
 */
enum pen_log_level { PEN_LOG_ERROR, PEN_LOG_WARNING, PEN_LOG_INFO, PEN_LOG_DEBUG };

/* Lines above level are dropped; name stands in front of each line. Call once, before threads. */
void pen_log_open(const char *name, enum pen_log_level level);

/* Writes "2026-01-31T12:00:00.123Z NAME level: text" in one write(2); never blocks on a lock. */
void pen_log(enum pen_log_level level, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

#endif
