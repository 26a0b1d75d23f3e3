/* SPDX-License-Identifier: Apache-2.0 */
#include "server/archive.h"

#include "server/database.h"
#include "server/job_row.h"
#include "server/scene_row.h"
#include "server/schema.h"

#include <limits.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { BUSY_MS = 5000 };

struct pen_archive {
	sqlite3 *db;
};

static int check_version(const struct pen_archive *archive, struct pen_error *err)
{
	int version = 0;
	int r = pen_database_version(archive->db, &version, err);

	if (r == 0 && version > PEN_SCHEMA_VERSION)
		return pen_error_set(err, PEN_EUNSUPPORTED,
			"the data directory was written by a newer version of Penumbra");
	if (r == 0 && version < PEN_SCHEMA_VERSION)
		return pen_error_set(err, PEN_EUNSUPPORTED,
			"the data directory was written by an older version of Penumbra: start "
			"`penumbra serve` on it once");
	return r;
}

int pen_archive_open(
	const char *dir, bool writes, struct pen_archive **ret_archive, struct pen_error *err)
{
	struct pen_archive *archive;
	char path[PATH_MAX];
	int r;

	if (snprintf(path, sizeof path, "%s/penumbra.db", dir) >= (int)sizeof path)
		return pen_error_set(err, PEN_EINVALID, "%s is too long a path", dir);
	if (access(path, F_OK) < 0)
		return pen_error_set(
			err, PEN_ENOTFOUND, "%s is no data directory: it has no penumbra.db", dir);
	archive = calloc(1, sizeof *archive);
	if (!archive)
		return pen_error_memory(err);
	r = sqlite3_open_v2(path, &archive->db,
		    (writes ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) | SQLITE_OPEN_NOMUTEX,
		    NULL) == SQLITE_OK
		    ? 0
		    : pen_database_error(archive->db, err);
	(void)sqlite3_busy_timeout(archive->db, BUSY_MS);
	if (r == 0)
		r = check_version(archive, err);
	if (r < 0)
		pen_archive_close(archive);
	else
		*ret_archive = archive;
	return r;
}

void pen_archive_close(struct pen_archive *archive)
{
	if (!archive)
		return;
	(void)sqlite3_close(archive->db);
	free(archive);
}

int pen_archive_check(struct pen_archive *archive, void (*told)(void *user, const char *fault),
	void *user, struct pen_error *err)
{
	sqlite3_stmt *rows = NULL;
	int r = pen_database_prepare(archive->db, "PRAGMA integrity_check", &rows, err), step;

	while (r == 0 && (step = sqlite3_step(rows)) != SQLITE_DONE) {
		const char *text = (const char *)sqlite3_column_text(rows, 0);

		if (step != SQLITE_ROW)
			r = pen_database_error(archive->db, err);
		else if (!text || strcmp(text, "ok") != 0)
			told(user, text ? text : "no answer");
	}
	(void)sqlite3_finalize(rows);
	return r;
}

int pen_archive_jobs(struct pen_archive *archive,
	int (*fn)(void *user, const struct pen_job *job, struct pen_error *err), void *user,
	struct pen_error *err)
{
	sqlite3_stmt *rows = NULL;
	int r = pen_database_prepare(archive->db, pen_job_row_load, &rows, err), step;
	struct pen_job job;

	while (r == 0 && (step = sqlite3_step(rows)) != SQLITE_DONE)
		r = step == SQLITE_ROW ? fn(user, pen_job_row_read(rows, &job) ? &job : NULL, err)
				       : pen_database_error(archive->db, err);
	(void)sqlite3_finalize(rows);
	return r;
}

bool pen_archive_has_scene(struct pen_archive *archive, const struct pen_sha256 *sha256)
{
	return pen_scene_row_is_whole(archive->db, sha256);
}

int pen_archive_copy(struct pen_archive *archive, const char *path, struct pen_error *err)
{
	struct pen_archive copy = {0};
	sqlite3_backup *backup = NULL;
	int r = 0;

	if (sqlite3_open_v2(path, &copy.db,
		    SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX,
		    NULL) == SQLITE_OK)
		backup = sqlite3_backup_init(copy.db, "main", archive->db, "main");
	if (!backup)
		r = pen_database_error(copy.db, err);
	/* All pages in one step: one point in time. */
	else if (sqlite3_backup_step(backup, -1) != SQLITE_DONE)
		r = pen_error_set(err, PEN_EIO, "the database cannot be copied");
	if (backup && sqlite3_backup_finish(backup) != SQLITE_OK && r == 0)
		r = pen_database_error(copy.db, err);
	(void)sqlite3_close(copy.db);
	return r;
}

static int change(
	struct pen_archive *archive, const char *text, uint64_t number, struct pen_error *err)
{
	sqlite3_stmt *statement = NULL;
	int r = pen_database_prepare(archive->db, text, &statement, err);

	if (r == 0)
		(void)sqlite3_bind_int64(statement, 1, (sqlite3_int64)number);
	if (r == 0 && sqlite3_step(statement) != SQLITE_DONE)
		r = pen_database_error(archive->db, err);
	(void)sqlite3_finalize(statement);
	return r;
}

int pen_archive_render_again(struct pen_archive *archive, uint64_t number, struct pen_error *err)
{
	int r = change(archive, "DELETE FROM tiles WHERE job = ?1", number, err);

	return r < 0 ? r
		     : change(archive,
			       "UPDATE jobs SET state = 0, finished_ms = 0, frames_done = 0,"
			       " samples_passed = 0, restarts = restarts + 1 WHERE number = ?1",
			       number, err);
}

int pen_archive_forget(struct pen_archive *archive, uint64_t number, struct pen_error *err)
{
	int r = change(archive, "DELETE FROM tiles WHERE job = ?1", number, err);

	return r < 0 ? r : change(archive, "DELETE FROM jobs WHERE number = ?1", number, err);
}
