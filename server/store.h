/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_STORE_H
#define PEN_SERVER_STORE_H

#include "core/base/error.h"
#include "server/canvas.h"
#include "server/job.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <uv.h>

/*
 * What outlives the coordinator: DIR/penumbra.db (SQLite) and the scenes in DIR/scenes. One thread
 * owns the only connection and carries requests out in the order they were made; all that wait
 * are committed together. Its answers come from the loop, in the same order, after the commit.
 *
 * Nothing of a preview is stored: what is requested of one is answered from the loop all the same.
 *
 * When the disk is full (PEN_ENOSPACE) or memory lacks (PEN_ENOMEM) later requests may succeed;
 * after any other failure of the database all do fail.
 */
struct pen_store;

/* err->code is 0 when the request is durable. */
typedef void pen_store_fn(void *user, const struct pen_error *err);

/* A row of the tiles of an unfinished job. */
struct pen_store_tile {
	uint32_t frame, tile;
	struct pen_canvas_tile state;
};

/* DIR (borrowed) and DIR/scenes exist; nobody else has the database open. */
int pen_store_create(
	uv_loop_t *loop, const char *dir, struct pen_store **ret_store, struct pen_error *err);

/* Carries out what was requested, tells every answer, and closes; memory goes when the loop ran. */
void pen_store_destroy(struct pen_store *store);

/*
 * What an earlier coordinator left; to be called once, before any request. job and its texts are
 * valid during the call; the tiles of an unfinished job come right after it. A visitor's failure
 * ends the load with its code.
 */
struct pen_store_visitor {
	int (*job)(void *user, const struct pen_job *job, struct pen_error *err);
	int (*tile)(
		void *user, uint64_t job, const struct pen_store_tile *tile, struct pen_error *err);
	int (*removed)(
		void *user, const char *id, const struct pen_owner *owner, struct pen_error *err);
	void *user;
};
int pen_store_load(
	struct pen_store *store, const struct pen_store_visitor *visitor, struct pen_error *err);

/*
 * Requests. Everything given is copied, unless said otherwise; fn may be NULL. PEN_EAGAIN when
 * PEN_STORE_QUEUE_MAX wait, PEN_ENOMEM: fn does not run then.
 */

/* A new job with its scene; text (heap) becomes the store's, also on failure. */
int pen_store_add_job(struct pen_store *store, const struct pen_job *job, char *text, size_t size,
	pen_store_fn *fn, void *user, struct pen_error *err);

/*
 * A job's row as it is now; the tiles of one that is over, or has lost its class, are forgotten,
 * and those of frames that are done.
 */
int pen_store_update_job(struct pen_store *store, const struct pen_job *job, pen_store_fn *fn,
	void *user, struct pen_error *err);

/* count <= PEN_TILES_COMMIT_MAX. */
int pen_store_put_tiles(struct pen_store *store, uint64_t job, const struct pen_store_tile *tiles,
	size_t count, struct pen_error *err);

/* Forgets the job but for its id and owner, and its scene when no other job has it. */
int pen_store_remove_job(struct pen_store *store, const struct pen_job *job, pen_store_fn *fn,
	void *user, struct pen_error *err);

#endif
