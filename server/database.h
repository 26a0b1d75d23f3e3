/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_DATABASE_H
#define PEN_SERVER_DATABASE_H

#include "core/base/error.h"

struct sqlite3;
struct sqlite3_stmt;

/* What those who use SQLite share. */

/* Its last failure as an error: PEN_ENOSPACE, PEN_ENOMEM or PEN_EIO, which is returned. */
int pen_database_error(struct sqlite3 *db, struct pen_error *err);

/* Runs statements that give no rows. */
int pen_database_execute(struct sqlite3 *db, const char *text, struct pen_error *err);

/* One statement, for as long as the database is open; the caller finalizes it. */
int pen_database_prepare(struct sqlite3 *db, const char *text, struct sqlite3_stmt **ret_statement,
	struct pen_error *err);

/* Which of the schema's versions (server/schema.h) it has. */
int pen_database_version(struct sqlite3 *db, int *ret_version, struct pen_error *err);

#endif
