/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_DURABLE_H
#define PEN_SERVER_DURABLE_H

#include "core/base/error.h"

#include <stddef.h>

/*
 * Writes DIR/NAME as a whole: whoever opens it finds the earlier file or this one, also after a
 * power cut, and when it returns this one. May block on the disk. On the way it is NAME.tmp.
 */
int pen_durable_write(
	const char *dir, const char *name, const void *data, size_t size, struct pen_error *err);

/* The same for now, but a power cut may leave nothing of it, or less than all. */
int pen_durable_place(
	const char *dir, const char *name, const void *data, size_t size, struct pen_error *err);

/*
 * The two halves of pen_durable_write: puts the file there, whole, but its name is only durable
 * once its directory was settled, which settles all names that were put there before.
 */
int pen_durable_put(
	const char *dir, const char *name, const void *data, size_t size, struct pen_error *err);
int pen_durable_settle(const char *dir, struct pen_error *err);

/* Removes what an interrupted write has left in DIR, and makes durable what it had completed. */
void pen_durable_sweep(const char *dir);

#endif
