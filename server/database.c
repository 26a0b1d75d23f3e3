/* SPDX-License-Identifier: Apache-2.0 */
#include "server/database.h"

#include <errno.h>
#include <sqlite3.h>
#include <stdbool.h>
#include <stddef.h>

int pen_database_error(struct sqlite3 *db, struct pen_error *err)
{
	/* The index of the log could not grow: nothing is amiss with what is written. */
	const int wrong = sqlite3_extended_errcode(db);
	bool is_full = (wrong & 0xff) == SQLITE_FULL ||
		       (wrong == SQLITE_IOERR_SHMSIZE && sqlite3_system_errno(db) == ENOSPC);
	int code = is_full ? PEN_ENOSPACE : PEN_EIO;

	if ((wrong & 0xff) == SQLITE_NOMEM || wrong == SQLITE_IOERR_NOMEM)
		code = PEN_ENOMEM;
	return pen_error_set(err, code, "database: %s", sqlite3_errmsg(db));
}

int pen_database_execute(struct sqlite3 *db, const char *text, struct pen_error *err)
{
	return sqlite3_exec(db, text, NULL, NULL, NULL) == SQLITE_OK ? 0
								     : pen_database_error(db, err);
}

int pen_database_prepare(struct sqlite3 *db, const char *text, struct sqlite3_stmt **ret_statement,
	struct pen_error *err)
{
	if (sqlite3_prepare_v3(db, text, -1, SQLITE_PREPARE_PERSISTENT, ret_statement, NULL) !=
		SQLITE_OK)
		return pen_database_error(db, err);
	return 0;
}

int pen_database_version(struct sqlite3 *db, int *ret_version, struct pen_error *err)
{
	sqlite3_stmt *row = NULL;
	int r = pen_database_prepare(db, "PRAGMA user_version", &row, err);

	if (r == 0 && sqlite3_step(row) != SQLITE_ROW)
		r = pen_database_error(db, err);
	if (r == 0)
		*ret_version = sqlite3_column_int(row, 0);
	(void)sqlite3_finalize(row);
	return r;
}
