/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_BACKUP_H
#define PEN_SERVER_BACKUP_H

#include "core/base/error.h"

/*
 * Copies a data directory to one that is not there yet, durably, and all or nothing. A coordinator
 * may be at work on the source: the database is copied as it is at one moment, then the files that
 * it names; a render that is removed meanwhile is not in the copy, and of one that is at work the
 * tiles that do not fit its rows are rendered again by whoever serves the copy. PEN_ECONFLICT when
 * the target is there.
 */
int pen_backup(const char *source, const char *target, struct pen_error *err);

#endif
