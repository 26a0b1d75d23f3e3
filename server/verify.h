/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_VERIFY_H
#define PEN_SERVER_VERIFY_H

#include <stdbool.h>

/*
 * How much of a render is rendered a second time, by another worker, and compared bit by bit before
 * it counts. With spot it is every unit of a worker of which less than PEN_AUDITS_FIRST have been
 * found right in a row, then one in as many as have been, but never less than one in
 * PEN_AUDIT_INTERVAL; a worker cannot know which. Who falsifies a share f of n units goes unfound
 * with a chance of (1 - f / PEN_AUDIT_INTERVAL)^n at most: 0.7 % for f = 0.1, n = 1000.
 */
enum pen_verify { PEN_VERIFY_NONE, PEN_VERIFY_SPOT, PEN_VERIFY_FULL };

enum { PEN_AUDITS_FIRST = 10, PEN_AUDIT_INTERVAL = 20 };

/* "none", "spot", "full". */
const char *pen_verify_name(enum pen_verify verify);
bool pen_verify_parse(const char *name, enum pen_verify *ret_verify);

#endif
