/* SPDX-License-Identifier: Apache-2.0 */
#include "server/store.h"

#include "core/base/limits.h"
#include "server/database.h"
#include "server/disk.h"
#include "server/durable.h"
#include "server/job_row.h"
#include "server/job_texts.h"
#include "server/scene_row.h"
#include "server/schema.h"

#include <assert.h>
#include <limits.h>
#include <pthread.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BUSY_MS = 5000 };

/* In the order of enum statement_name. */
static const char *const statement_texts[] = {
	"BEGIN IMMEDIATE",
	"COMMIT",
	"ROLLBACK",
	pen_job_row_put,
	"INSERT OR REPLACE INTO tiles (job, frame, tile, rounds, xxh3) VALUES (?1, ?2, ?3, ?4, ?5)",
	"DELETE FROM tiles WHERE job = ?1",
	"DELETE FROM tiles WHERE job = ?1 AND frame < ?2",
	"DELETE FROM jobs WHERE number = ?1",
	"INSERT OR IGNORE INTO removed (id, owner) VALUES (?1, ?2)",
};

enum statement_name {
	BEGIN,
	COMMIT,
	ROLLBACK,
	PUT_JOB,
	PUT_TILE,
	FORGET_TILES,
	FORGET_FRAMES,
	FORGET_JOB,
	PUT_REMOVED,
	STATEMENT_COUNT
};

static_assert(sizeof statement_texts / sizeof *statement_texts == STATEMENT_COUNT,
	"a text for each statement");

static const char settings[] = "PRAGMA journal_mode = WAL;"
			       "PRAGMA synchronous = FULL;"
			       "PRAGMA foreign_keys = ON;"
			       "PRAGMA trusted_schema = OFF;"
			       "PRAGMA cell_size_check = ON;"
			       "PRAGMA mmap_size = 0;"
			       "PRAGMA journal_size_limit = 67108864;";

/*
 * An image revision names the same bytes for ever, but merges after the last update of the row
 * were lost count of: there were fewer than units_total + 1 of them.
 */
static const char raise_revisions[] =
	"UPDATE jobs SET image_revision = image_revision + units_total + 1"
	" WHERE state < 3 AND class IS NOT NULL";

static const char load_tiles[] = "SELECT frame, tile, rounds, xxh3 FROM tiles WHERE job = ?1";
static const char load_removed[] = "SELECT id, owner FROM removed";

enum request_type { ADD_JOB, UPDATE_JOB, PUT_TILES, REMOVE_JOB };

struct request {
	struct request *next;
	enum request_type type;
	struct pen_job job; /* a copy, its texts too; of PUT_TILES the number alone */
	char *text;	    /* of the scene, ADD_JOB */
	size_t size;
	struct pen_store_tile *tiles;
	size_t count;
	pen_store_fn *fn;
	void *user;
	struct pen_error err;
};

struct request_list {
	struct request *first, **end;
};

struct pen_store {
	uv_async_t answered;
	const char *dir;
	char scenes_dir[PATH_MAX];
	pthread_t thread;
	bool running;

	/* The thread's own. */
	sqlite3 *db;
	sqlite3_stmt *statements[STATEMENT_COUNT];
	struct pen_scene_rows scenes;
	struct pen_error broken; /* code 0 as long as the database can be trusted */

	/* Shared, under the lock. */
	pthread_mutex_t lock;
	pthread_cond_t wake;
	struct request_list waiting, done;
	size_t waiting_count;
	bool stopping;
};

static void list_init(struct request_list *list)
{
	list->first = NULL;
	list->end = &list->first;
}

static void list_append(struct request_list *list, struct request *request)
{
	request->next = NULL;
	*list->end = request;
	list->end = &request->next;
}

static struct request *list_take_all(struct request_list *list)
{
	struct request *first = list->first;

	list_init(list);
	return first;
}

static void request_destroy(struct request *request)
{
	pen_job_texts_free(&request->job);
	free(request->text);
	free(request->tiles);
	free(request);
}

/* On the thread */

static int run(struct pen_store *store, enum statement_name name, struct pen_error *err)
{
	sqlite3_stmt *statement = store->statements[name];
	int r = sqlite3_step(statement) == SQLITE_DONE ? 0 : pen_database_error(store->db, err);

	(void)sqlite3_reset(statement);
	(void)sqlite3_clear_bindings(statement);
	return r;
}

static void bind_number(sqlite3_stmt *statement, int place, uint64_t number)
{
	(void)sqlite3_bind_int64(statement, place, (sqlite3_int64)number);
}

static int put_job(struct pen_store *store, const struct pen_job *job, struct pen_error *err)
{
	pen_job_row_bind(store->statements[PUT_JOB], job);
	return run(store, PUT_JOB, err);
}

static int put_tile(struct pen_store *store, uint64_t job, const struct pen_store_tile *tile,
	struct pen_error *err)
{
	sqlite3_stmt *statement = store->statements[PUT_TILE];

	bind_number(statement, 1, job);
	bind_number(statement, 2, tile->frame);
	bind_number(statement, 3, tile->tile);
	bind_number(statement, 4, tile->state.rounds);
	bind_number(statement, 5, tile->state.xxh3);
	return run(store, PUT_TILE, err);
}

static int forget(
	struct pen_store *store, enum statement_name name, uint64_t job, struct pen_error *err)
{
	bind_number(store->statements[name], 1, job);
	return run(store, name, err);
}

static bool keeps_tiles(const struct pen_job *job)
{
	return job->state < PEN_JOB_DONE && job->equivalence_class;
}

/* The first frame that is not done. */
static uint32_t first_open(const struct pen_job *job)
{
	return job->frame_first + job->frames_done;
}

static int carry_out(struct pen_store *store, const struct request *request, struct pen_error *err)
{
	const struct pen_job *job = &request->job;
	int r = 0;

	switch (request->type) {
	case ADD_JOB:
		r = pen_scene_rows_put(
			&store->scenes, &job->scene_sha256, request->text, request->size, err);
		return r < 0 ? r : put_job(store, job, err);
	case UPDATE_JOB:
		r = put_job(store, job, err);
		if (r == 0 && !keeps_tiles(job))
			return forget(store, FORGET_TILES, job->number, err);
		bind_number(store->statements[FORGET_FRAMES], 2, first_open(job));
		return r < 0 ? r : forget(store, FORGET_FRAMES, job->number, err);
	case PUT_TILES:
		for (size_t i = 0; r == 0 && i < request->count; i++)
			r = put_tile(store, job->number, &request->tiles[i], err);
		return r;
	case REMOVE_JOB:
		r = forget(store, FORGET_TILES, job->number, err);
		if (r == 0)
			r = forget(store, FORGET_JOB, job->number, err);
		if (r == 0)
			r = pen_scene_rows_forget(&store->scenes, &job->scene_sha256, err);
		(void)sqlite3_bind_text(
			store->statements[PUT_REMOVED], 1, job->id, -1, SQLITE_STATIC);
		pen_row_bind_owner(store->statements[PUT_REMOVED], 2, &job->owner);
		return r < 0 ? r : run(store, PUT_REMOVED, err);
	}
	return 0;
}

/* All of them in one transaction, so that they share its fsync. */
static int commit_batch(struct pen_store *store, struct request *batch, struct pen_error *err)
{
	int r = run(store, BEGIN, err);

	for (struct request *request = batch; r == 0 && request; request = request->next)
		r = carry_out(store, request, err);
	if (r == 0)
		r = pen_scene_rows_settle(&store->scenes, err);
	if (r == 0)
		r = run(store, COMMIT, err);
	if (r < 0 && sqlite3_get_autocommit(store->db) == 0)
		(void)run(store, ROLLBACK, NULL);
	if (r < 0)
		return r;
	for (struct request *request = batch; request; request = request->next)
		if (request->type == REMOVE_JOB)
			pen_scene_rows_remove_file(&store->scenes, &request->job.scene_sha256);
	return 0;
}

static void handle_batch(struct pen_store *store, struct request *batch)
{
	struct pen_error err = store->broken;

	if (err.code == 0)
		(void)commit_batch(store, batch, &err);
	/* A removal makes room, but takes some first. */
	if (err.code == PEN_ENOSPACE && pen_ballast_drop(store->dir) == 0) {
		err.code = 0;
		(void)commit_batch(store, batch, &err);
	}
	if (err.code != 0 && err.code != PEN_ENOSPACE && err.code != PEN_ENOMEM)
		store->broken = err;
	for (struct request *request = batch; request; request = request->next)
		request->err = err;
}

static void *run_thread(void *argument)
{
	struct pen_store *store = argument;
	struct request *batch;

	(void)pthread_mutex_lock(&store->lock);
	for (;;) {
		while (!store->waiting.first && !store->stopping)
			(void)pthread_cond_wait(&store->wake, &store->lock);
		batch = list_take_all(&store->waiting);
		store->waiting_count = 0;
		if (!batch)
			break;
		(void)pthread_mutex_unlock(&store->lock);
		handle_batch(store, batch);
		(void)pthread_mutex_lock(&store->lock);
		while (batch) {
			struct request *next = batch->next;

			list_append(&store->done, batch);
			batch = next;
		}
		(void)uv_async_send(&store->answered);
	}
	(void)pthread_mutex_unlock(&store->lock);
	return NULL;
}

/* On the loop */

static void tell_answers(struct pen_store *store)
{
	struct request *request, *next;

	(void)pthread_mutex_lock(&store->lock);
	request = list_take_all(&store->done);
	(void)pthread_mutex_unlock(&store->lock);
	for (; request; request = next) {
		next = request->next;
		if (request->fn)
			request->fn(request->user, &request->err);
		request_destroy(request);
	}
}

static void handle_answered(uv_async_t *async)
{
	tell_answers(async->data);
}

static int submit(struct pen_store *store, struct request *request, struct pen_error *err)
{
	bool full;

	(void)pthread_mutex_lock(&store->lock);
	full = store->waiting_count == PEN_STORE_QUEUE_MAX && !request->job.is_preview;
	if (request->job.is_preview) {
		list_append(&store->done, request);
		(void)uv_async_send(&store->answered);
	} else if (!full) {
		list_append(&store->waiting, request);
		store->waiting_count++;
		(void)pthread_cond_signal(&store->wake);
	}
	(void)pthread_mutex_unlock(&store->lock);
	if (!full)
		return 0;
	request_destroy(request);
	return pen_error_set(err, PEN_EAGAIN, "too many changes wait for the disk; try again");
}

static struct request *request_create(
	enum request_type type, const struct pen_job *job, pen_store_fn *fn, void *user)
{
	struct request *request = calloc(1, sizeof *request);

	if (!request)
		return NULL;
	*request = (struct request){.type = type, .job = *job, .fn = fn, .user = user};
	if (pen_job_texts_copy(&request->job, NULL) < 0) {
		request_destroy(request);
		return NULL;
	}
	return request;
}

int pen_store_add_job(struct pen_store *store, const struct pen_job *job, char *text, size_t size,
	pen_store_fn *fn, void *user, struct pen_error *err)
{
	struct request *request = request_create(ADD_JOB, job, fn, user);

	if (!request) {
		free(text);
		return pen_error_memory(err);
	}
	request->text = text;
	request->size = size;
	return submit(store, request, err);
}

int pen_store_update_job(struct pen_store *store, const struct pen_job *job, pen_store_fn *fn,
	void *user, struct pen_error *err)
{
	struct request *request = request_create(UPDATE_JOB, job, fn, user);

	return request ? submit(store, request, err) : pen_error_memory(err);
}

int pen_store_put_tiles(struct pen_store *store, uint64_t job, const struct pen_store_tile *tiles,
	size_t count, struct pen_error *err)
{
	struct pen_job numbered = {.number = job};
	struct request *request = request_create(PUT_TILES, &numbered, NULL, NULL);

	assert(count <= PEN_TILES_COMMIT_MAX);
	if (!request)
		return pen_error_memory(err);
	request->tiles = calloc(count, sizeof *tiles);
	if (!request->tiles) {
		request_destroy(request);
		return pen_error_memory(err);
	}
	memcpy(request->tiles, tiles, count * sizeof *tiles);
	request->count = count;
	return submit(store, request, err);
}

int pen_store_remove_job(struct pen_store *store, const struct pen_job *job, pen_store_fn *fn,
	void *user, struct pen_error *err)
{
	struct request *request = request_create(REMOVE_JOB, job, fn, user);

	return request ? submit(store, request, err) : pen_error_memory(err);
}

/* Loading, before the thread has anything to do */

static int visit_tiles(struct pen_store *store, const struct pen_store_visitor *visitor,
	sqlite3_stmt *rows, const struct pen_job *job, struct pen_error *err)
{
	const struct pen_rounds rounds = pen_sampling_rounds(&job->sampling);
	int r = 0, step;

	bind_number(rows, 1, job->number);
	while (r == 0 && (step = sqlite3_step(rows)) != SQLITE_DONE) {
		struct pen_store_tile tile = {pen_row_count(rows, 0), pen_row_count(rows, 1),
			{(uint16_t)pen_row_count(rows, 2), pen_row_number(rows, 3), 0}};

		if (step != SQLITE_ROW)
			r = pen_database_error(store->db, err);
		else if (tile.frame >= first_open(job) &&
			 tile.frame - job->frame_first < job->frame_count &&
			 tile.tile < job->tiling.count &&
			 tile.state.rounds <= pen_round_count(&rounds))
			r = visitor->tile(visitor->user, job->number, &tile, err);
	}
	(void)sqlite3_reset(rows);
	return r;
}

static int visit_job(struct pen_store *store, const struct pen_store_visitor *visitor,
	sqlite3_stmt *row, sqlite3_stmt *tiles, struct pen_error *err)
{
	struct pen_job job;
	int r;

	if (!pen_job_row_read(row, &job))
		return pen_error_set(err, PEN_EIO, "database: render %llu is damaged",
			(unsigned long long)pen_row_number(row, 0));
	r = visitor->job(visitor->user, &job, err);
	return r == 0 && keeps_tiles(&job) ? visit_tiles(store, visitor, tiles, &job, err) : r;
}

static int visit_jobs(
	struct pen_store *store, const struct pen_store_visitor *visitor, struct pen_error *err)
{
	sqlite3_stmt *jobs = NULL, *tiles = NULL;
	int r = pen_database_prepare(store->db, pen_job_row_load, &jobs, err), step;

	if (r == 0)
		r = pen_database_prepare(store->db, load_tiles, &tiles, err);
	while (r == 0 && (step = sqlite3_step(jobs)) != SQLITE_DONE)
		r = step == SQLITE_ROW ? visit_job(store, visitor, jobs, tiles, err)
				       : pen_database_error(store->db, err);
	(void)sqlite3_finalize(jobs);
	(void)sqlite3_finalize(tiles);
	return r;
}

static int visit_removed(
	struct pen_store *store, const struct pen_store_visitor *visitor, struct pen_error *err)
{
	char id[PEN_JOB_ID_TEXT];
	struct pen_owner owner;
	sqlite3_stmt *rows = NULL;
	int r = pen_database_prepare(store->db, load_removed, &rows, err), step;

	while (r == 0 && (step = sqlite3_step(rows)) != SQLITE_DONE) {
		if (step != SQLITE_ROW)
			r = pen_database_error(store->db, err);
		else if (!pen_row_owner(rows, 1, &owner))
			r = pen_error_set(err, PEN_EIO, "database: a removed render is damaged");
		else {
			pen_row_text(id, sizeof id, rows, 0);
			r = visitor->removed(visitor->user, id, &owner, err);
		}
	}
	(void)sqlite3_finalize(rows);
	return r;
}

int pen_store_load(
	struct pen_store *store, const struct pen_store_visitor *visitor, struct pen_error *err)
{
	int r = pen_database_execute(store->db, raise_revisions, err);

	if (r == 0)
		r = visit_jobs(store, visitor, err);
	if (r == 0)
		r = visit_removed(store, visitor, err);
	if (r == 0)
		r = pen_scene_rows_restore(&store->scenes, err);
	if (r == PEN_ENOSPACE && pen_ballast_drop(store->dir) == 0)
		r = pen_scene_rows_restore(&store->scenes, err);
	return r;
}

/* Opening and closing */

static int migrate(struct pen_store *store, struct pen_error *err)
{
	int version = 0;
	int r = pen_database_version(store->db, &version, err);

	if (r == 0 && (version < 0 || version > PEN_SCHEMA_VERSION))
		return pen_error_set(err, PEN_EUNSUPPORTED,
			"the data directory was written by a newer version of Penumbra");
	for (; r == 0 && version < PEN_SCHEMA_VERSION; version++)
		r = pen_database_execute(store->db, pen_schema_migrations[version], err);
	return r;
}

static int open_database(struct pen_store *store, const char *dir, struct pen_error *err)
{
	char path[PATH_MAX];
	int r;

	if (snprintf(path, sizeof path, "%s/penumbra.db", dir) >= (int)sizeof path ||
		snprintf(store->scenes_dir, sizeof store->scenes_dir, "%s/scenes", dir) >=
			(int)sizeof store->scenes_dir)
		return pen_error_set(err, PEN_EINVALID, "the data directory's path is too long");
	if (sqlite3_open_v2(path, &store->db,
		    SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX,
		    NULL) != SQLITE_OK)
		return pen_database_error(store->db, err);
	(void)sqlite3_busy_timeout(store->db, BUSY_MS);
	(void)sqlite3_db_config(store->db, SQLITE_DBCONFIG_DEFENSIVE, 1, NULL);
	r = pen_database_execute(store->db, settings, err);
	if (r == 0)
		r = migrate(store, err);
	for (int i = 0; r == 0 && i < STATEMENT_COUNT; i++)
		r = pen_database_prepare(store->db, statement_texts[i], &store->statements[i], err);
	if (r == 0)
		r = pen_scene_rows_init(&store->scenes, store->db, store->scenes_dir, err);
	return r;
}

static void handle_closed(uv_handle_t *handle)
{
	free(handle->data);
}

static void close_database(struct pen_store *store)
{
	for (int i = 0; i < STATEMENT_COUNT; i++)
		(void)sqlite3_finalize(store->statements[i]);
	pen_scene_rows_finish(&store->scenes);
	(void)sqlite3_close(store->db);
}

int pen_store_create(
	uv_loop_t *loop, const char *dir, struct pen_store **ret_store, struct pen_error *err)
{
	struct pen_store *store = calloc(1, sizeof *store);
	int r;

	if (!store)
		return pen_error_memory(err);
	store->dir = dir;
	list_init(&store->waiting);
	list_init(&store->done);
	r = open_database(store, dir, err);
	if (r < 0) {
		close_database(store);
		free(store);
		return r;
	}
	pen_durable_sweep(store->scenes_dir);
	(void)pthread_mutex_init(&store->lock, NULL);
	(void)pthread_cond_init(&store->wake, NULL);
	(void)uv_async_init(loop, &store->answered, handle_answered);
	store->answered.data = store;
	r = pthread_create(&store->thread, NULL, run_thread, store);
	store->running = r == 0;
	if (r != 0) {
		pen_store_destroy(store);
		return pen_error_system(err, r, "cannot start the store's thread");
	}
	*ret_store = store;
	return 0;
}

void pen_store_destroy(struct pen_store *store)
{
	if (!store)
		return;
	(void)pthread_mutex_lock(&store->lock);
	store->stopping = true;
	(void)pthread_cond_signal(&store->wake);
	(void)pthread_mutex_unlock(&store->lock);
	if (store->running)
		(void)pthread_join(store->thread, NULL);
	tell_answers(store);
	close_database(store);
	(void)pthread_mutex_destroy(&store->lock);
	(void)pthread_cond_destroy(&store->wake);
	uv_close((uv_handle_t *)&store->answered, handle_closed);
}
