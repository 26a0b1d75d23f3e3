/* SPDX-License-Identifier: Apache-2.0 */
#include "server/scene_row.h"

#include "core/base/limits.h"
#include "server/database.h"
#include "server/durable.h"
#include "server/scene_file.h"

#include <dirent.h>
#include <sqlite3.h>
#include <stdint.h>
#include <string.h>

static const char put_text[] = "INSERT OR IGNORE INTO scenes (sha256, text) VALUES (?1, ?2)";
static const char forget_text[] =
	"DELETE FROM scenes WHERE sha256 = ?1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE scene = ?1)";
static const char count_text[] = "SELECT count(*) FROM jobs WHERE scene = ?1";
static const char load_text[] = "SELECT text, sha256 FROM scenes";
static const char find_text[] = "SELECT text FROM scenes WHERE sha256 = ?1";

int pen_scene_rows_init(
	struct pen_scene_rows *rows, struct sqlite3 *db, const char *dir, struct pen_error *err)
{
	int r;

	*rows = (struct pen_scene_rows){.db = db, .dir = dir};
	r = pen_database_prepare(db, put_text, &rows->put, err);
	if (r == 0)
		r = pen_database_prepare(db, forget_text, &rows->forget, err);
	if (r == 0)
		r = pen_database_prepare(db, count_text, &rows->count, err);
	return r;
}

void pen_scene_rows_finish(struct pen_scene_rows *rows)
{
	(void)sqlite3_finalize(rows->put);
	(void)sqlite3_finalize(rows->forget);
	(void)sqlite3_finalize(rows->count);
}

static void bind_name(sqlite3_stmt *statement, const struct pen_sha256 *sha256)
{
	(void)sqlite3_bind_blob(statement, 1, sha256->bytes, sizeof sha256->bytes, SQLITE_STATIC);
}

static int run(struct pen_scene_rows *rows, sqlite3_stmt *statement, struct pen_error *err)
{
	int r = sqlite3_step(statement) == SQLITE_DONE ? 0 : pen_database_error(rows->db, err);

	(void)sqlite3_reset(statement);
	(void)sqlite3_clear_bindings(statement);
	return r;
}

int pen_scene_rows_put(struct pen_scene_rows *rows, const struct pen_sha256 *sha256,
	const void *text, size_t size, struct pen_error *err)
{
	const bool has_row = size <= PEN_SCENE_ROW_BYTES_MAX;
	int r = pen_scene_file_write(rows->dir, sha256, text, size, !has_row, err);

	if (r < 0)
		return r;
	if (!has_row) {
		rows->has_new_file = true;
		return 0;
	}
	bind_name(rows->put, sha256);
	(void)sqlite3_bind_blob(rows->put, 2, text, (int)size, SQLITE_STATIC);
	return run(rows, rows->put, err);
}

int pen_scene_rows_settle(struct pen_scene_rows *rows, struct pen_error *err)
{
	int r = rows->has_new_file ? pen_durable_settle(rows->dir, err) : 0;

	rows->has_new_file = false;
	return r;
}

int pen_scene_rows_forget(
	struct pen_scene_rows *rows, const struct pen_sha256 *sha256, struct pen_error *err)
{
	bind_name(rows->forget, sha256);
	return run(rows, rows->forget, err);
}

void pen_scene_rows_remove_file(struct pen_scene_rows *rows, const struct pen_sha256 *sha256)
{
	bool is_free;

	bind_name(rows->count, sha256);
	is_free = sqlite3_step(rows->count) == SQLITE_ROW &&
		  sqlite3_column_int64(rows->count, 0) == 0;
	(void)sqlite3_reset(rows->count);
	(void)sqlite3_clear_bindings(rows->count);
	if (is_free)
		pen_scene_file_remove(rows->dir, sha256);
}

/* Whether the first column of a row is the text that sha256 names. */
static bool is_whole(sqlite3_stmt *row, const struct pen_sha256 *sha256)
{
	const void *text = sqlite3_column_blob(row, 0);
	struct pen_sha256 found;

	return text &&
	       pen_sha256_of(text, (size_t)sqlite3_column_bytes(row, 0), &found, NULL) == 0 &&
	       pen_sha256_equal(&found, sha256);
}

/* A row that is damaged is left to fsck, as is its file. */
static int restore_row(struct pen_scene_rows *rows, sqlite3_stmt *row, struct pen_error *err)
{
	const void *name = sqlite3_column_blob(row, 1);
	struct pen_sha256 sha256;

	if (!name || sqlite3_column_bytes(row, 1) != sizeof sha256.bytes)
		return 0;
	memcpy(sha256.bytes, name, sizeof sha256.bytes);
	if (!is_whole(row, &sha256) || pen_scene_file_is_whole(rows->dir, &sha256))
		return 0;
	pen_scene_file_remove(rows->dir, &sha256);
	return pen_scene_file_write(rows->dir, &sha256, sqlite3_column_blob(row, 0),
		(size_t)sqlite3_column_bytes(row, 0), false, err);
}

static int restore_rows(struct pen_scene_rows *rows, struct pen_error *err)
{
	sqlite3_stmt *row = NULL;
	int r = pen_database_prepare(rows->db, load_text, &row, err), step;

	while (r == 0 && (step = sqlite3_step(row)) != SQLITE_DONE)
		r = step == SQLITE_ROW ? restore_row(rows, row, err)
				       : pen_database_error(rows->db, err);
	(void)sqlite3_finalize(row);
	return r;
}

/* Files whose job is not there: a crash came between the two. */
static void sweep_files(struct pen_scene_rows *rows)
{
	DIR *files = opendir(rows->dir);
	const struct dirent *entry;
	struct pen_sha256 sha256;

	while (files && (entry = readdir(files)) != NULL)
		if (pen_sha256_parse(entry->d_name, &sha256))
			pen_scene_rows_remove_file(rows, &sha256);
	if (files)
		(void)closedir(files);
}

int pen_scene_rows_restore(struct pen_scene_rows *rows, struct pen_error *err)
{
	int r = restore_rows(rows, err);

	if (r == 0)
		sweep_files(rows);
	return r;
}

bool pen_scene_row_is_whole(struct sqlite3 *db, const struct pen_sha256 *sha256)
{
	sqlite3_stmt *row = NULL;
	bool whole = false;

	if (pen_database_prepare(db, find_text, &row, NULL) == 0) {
		bind_name(row, sha256);
		whole = sqlite3_step(row) == SQLITE_ROW && is_whole(row, sha256);
	}
	(void)sqlite3_finalize(row);
	return whole;
}
