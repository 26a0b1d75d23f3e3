/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SCENE_ROW_H
#define PEN_SERVER_SCENE_ROW_H

#include "core/base/digest.h"
#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>

struct sqlite3;
struct sqlite3_stmt;

/*
 * The scenes of the store's jobs. Everybody reads them as files (server/scene_file.h). Those of up
 * to PEN_SCENE_ROW_BYTES_MAX stand in a row, too: the commit that makes a job durable makes its
 * scene durable, without a wait for a file of its own, and a file that a power cut took or tore is
 * made again at the next start. Larger ones have a durable file alone.
 */
struct pen_scene_rows {
	struct sqlite3 *db;
	const char *dir; /* of the files */
	struct sqlite3_stmt *put, *forget, *count;
	bool has_new_file; /* whose name is not durable yet */
};

/* Both borrowed. */
int pen_scene_rows_init(
	struct pen_scene_rows *rows, struct sqlite3 *db, const char *dir, struct pen_error *err);
void pen_scene_rows_finish(struct pen_scene_rows *rows);

/*
 * In a transaction: a job's scene, and before its commit, what makes all that were put since the
 * last call durable with it. May block on the disk.
 */
int pen_scene_rows_put(struct pen_scene_rows *rows, const struct pen_sha256 *sha256,
	const void *text, size_t size, struct pen_error *err);
int pen_scene_rows_settle(struct pen_scene_rows *rows, struct pen_error *err);

/*
 * Unless a job has it: in the transaction that removes a job, its row; when that is durable, its
 * file.
 */
int pen_scene_rows_forget(
	struct pen_scene_rows *rows, const struct pen_sha256 *sha256, struct pen_error *err);
void pen_scene_rows_remove_file(struct pen_scene_rows *rows, const struct pen_sha256 *sha256);

/* At the start: makes files as their rows say, and removes those that no job has. */
int pen_scene_rows_restore(struct pen_scene_rows *rows, struct pen_error *err);

/* Whether a row has it, whole. */
bool pen_scene_row_is_whole(struct sqlite3 *db, const struct pen_sha256 *sha256);

#endif
