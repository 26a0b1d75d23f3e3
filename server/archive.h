/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ARCHIVE_H
#define PEN_SERVER_ARCHIVE_H

#include "core/base/error.h"
#include "server/job.h"

#include <stdbool.h>

/*
 * The database of a data directory, for whoever looks after it from outside of the coordinator.
 * Read only it may be open beside one: it then neither writes nor moves the log into the database
 * (with two connections that do so SQLite 3.40 may damage it).
 */
struct pen_archive;

/* PEN_ENOTFOUND, PEN_EUNSUPPORTED: of another version. */
int pen_archive_open(
	const char *dir, bool writes, struct pen_archive **ret_archive, struct pen_error *err);
void pen_archive_close(struct pen_archive *archive);

/* SQLite's own integrity check; told is called with each fault. */
int pen_archive_check(struct pen_archive *archive, void (*told)(void *user, const char *fault),
	void *user, struct pen_error *err);

/* In order; job NULL: a row that is none. Its texts are valid during the call. */
int pen_archive_jobs(struct pen_archive *archive,
	int (*fn)(void *user, const struct pen_job *job, struct pen_error *err), void *user,
	struct pen_error *err);

/* Whether it holds a scene itself (server/scene_row.h), whole. */
bool pen_archive_has_scene(struct pen_archive *archive, const struct pen_sha256 *sha256);

/* A consistent copy as of now, in a file that is not there yet. */
int pen_archive_copy(struct pen_archive *archive, const char *path, struct pen_error *err);

/* As if it had just been accepted: its image is what it was. */
int pen_archive_render_again(struct pen_archive *archive, uint64_t number, struct pen_error *err);

int pen_archive_forget(struct pen_archive *archive, uint64_t number, struct pen_error *err);

#endif
