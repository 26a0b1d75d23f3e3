/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_FSCK_H
#define PEN_SERVER_FSCK_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * Looks through a data directory that no coordinator uses: the database, every render's row, every
 * scene against its name, and every finished frame against its seal. Each fault is told as a
 * sentence.
 */
struct pen_fsck_report {
	uint64_t renders, frames, faults;
	uint64_t repaired;		    /* renders that will be rendered again */
	void (*told)(const char *sentence); /* of a fault */
};

/* repair: renders with a frame that is damaged or gone are rendered again at the next start. */
int pen_fsck(const char *dir, bool repair, struct pen_fsck_report *report, struct pen_error *err);

#endif
