/* SPDX-License-Identifier: Apache-2.0 */
#include "server/job_row.h"

#include "core/base/limits.h"

#include <sqlite3.h>
#include <stdio.h>
#include <string.h>

#define COLUMNS                                                                                    \
	"number, id, state, name, scene, class, content, priority, width, height, "                \
	"crop_x0, crop_y0, crop_x1, crop_y1, tile_px, samples, exposure, units_done, "             \
	"units_total, tiles_done, samples_done, created_ms, started_ms, finished_ms, "             \
	"restarts, error_code, error_text, image_revision, aovs, mode, threshold, error, "         \
	"confidence, min_samples, frame_first, frame_count, frames_done, errors, "                 \
	"warnings, samples_passed, deadline_ms, key, key_body, verify, owner, trace"

const char pen_job_row_put[] =
	"INSERT OR REPLACE INTO jobs (" COLUMNS ")"
	" VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, "
	"?19, ?20, ?21, ?22, ?23, ?24, ?25, ?26, ?27, ?28, ?29, ?30, ?31, ?32, ?33, ?34, "
	"?35, ?36, ?37, ?38, ?39, ?40, ?41, ?42, ?43, ?44, ?45, ?46)";

const char pen_job_row_load[] = "SELECT " COLUMNS " FROM jobs ORDER BY number";

static void bind_number(sqlite3_stmt *statement, int place, uint64_t number)
{
	(void)sqlite3_bind_int64(statement, place, (sqlite3_int64)number);
}

static void bind_text(sqlite3_stmt *statement, int place, const char *text)
{
	(void)sqlite3_bind_text(statement, place, text, -1, SQLITE_STATIC);
}

/* NULL without one. */
static void bind_hash(
	sqlite3_stmt *statement, int place, bool is_there, const struct pen_sha256 *sha256)
{
	if (is_there)
		(void)sqlite3_bind_blob(
			statement, place, sha256->bytes, sizeof sha256->bytes, SQLITE_STATIC);
}

void pen_row_bind_owner(sqlite3_stmt *put, int place, const struct pen_owner *owner)
{
	bind_hash(put, place, owner->is_known, &owner->token);
}

void pen_job_row_bind(struct sqlite3_stmt *put, const struct pen_job *job)
{
	sqlite3_stmt *statement = put;

	bind_number(statement, 1, job->number);
	bind_text(statement, 2, job->id);
	bind_number(statement, 3, job->state);
	bind_text(statement, 4, job->name);
	bind_hash(statement, 5, true, &job->scene_sha256);
	bind_text(statement, 6, job->equivalence_class);
	bind_text(statement, 7, job->content);
	bind_number(statement, 8, job->priority);
	bind_number(statement, 9, job->width);
	bind_number(statement, 10, job->height);
	bind_number(statement, 11, job->tiling.crop.x0);
	bind_number(statement, 12, job->tiling.crop.y0);
	bind_number(statement, 13, job->tiling.crop.x1);
	bind_number(statement, 14, job->tiling.crop.y1);
	bind_number(statement, 15, job->tiling.tile_px);
	bind_number(statement, 16, job->sampling.samples);
	(void)sqlite3_bind_double(statement, 17, job->exposure);
	bind_number(statement, 18, job->units_done);
	bind_number(statement, 19, job->units_total);
	bind_number(statement, 20, job->tiles_done);
	bind_number(statement, 21, job->samples_done);
	bind_number(statement, 22, (uint64_t)job->created_ms);
	bind_number(statement, 23, (uint64_t)job->started_ms);
	bind_number(statement, 24, (uint64_t)job->finished_ms);
	bind_number(statement, 25, job->restarts);
	(void)sqlite3_bind_int(statement, 26, job->error.code);
	bind_text(statement, 27, job->error.text);
	bind_number(statement, 28, job->image_revision);
	bind_number(statement, 29, job->aovs);
	bind_number(statement, 30, job->sampling.mode);
	(void)sqlite3_bind_double(statement, 31, job->sampling.threshold);
	(void)sqlite3_bind_double(statement, 32, job->sampling.error);
	(void)sqlite3_bind_double(statement, 33, job->sampling.confidence);
	bind_number(statement, 34, job->sampling.min_samples);
	bind_number(statement, 35, job->frame_first);
	bind_number(statement, 36, job->frame_count);
	bind_number(statement, 37, job->frames_done);
	bind_text(statement, 38, job->errors);
	bind_text(statement, 39, job->warnings);
	bind_number(statement, 40, job->samples_passed);
	(void)sqlite3_bind_int64(statement, 41, job->deadline_ms);
	bind_hash(statement, 42, job->has_key, &job->key);
	bind_hash(statement, 43, job->has_key, &job->key_body);
	bind_number(statement, 44, job->verify);
	pen_row_bind_owner(statement, 45, &job->owner);
	if (job->trace[0] != '\0')
		bind_text(statement, 46, job->trace);
}

void pen_row_text(char *ret_text, size_t size, sqlite3_stmt *row, int column)
{
	const unsigned char *text = sqlite3_column_text(row, column);

	(void)snprintf(ret_text, size, "%s", text ? (const char *)text : "");
}

uint32_t pen_row_count(sqlite3_stmt *row, int column)
{
	sqlite3_int64 value = sqlite3_column_int64(row, column);

	return value < 0 || value > UINT32_MAX ? 0 : (uint32_t)value;
}

uint64_t pen_row_number(sqlite3_stmt *row, int column)
{
	return (uint64_t)sqlite3_column_int64(row, column);
}

static bool read_hash(sqlite3_stmt *row, int column, struct pen_sha256 *ret_sha256)
{
	if (sqlite3_column_bytes(row, column) != sizeof ret_sha256->bytes)
		return false;
	memcpy(ret_sha256->bytes, sqlite3_column_blob(row, column), sizeof ret_sha256->bytes);
	return true;
}

bool pen_row_owner(sqlite3_stmt *row, int column, struct pen_owner *ret_owner)
{
	*ret_owner = (struct pen_owner){.is_known = false};
	if (sqlite3_column_type(row, column) == SQLITE_NULL)
		return true;
	ret_owner->is_known = read_hash(row, column, &ret_owner->token);
	return ret_owner->is_known;
}

static bool frames_valid(const struct pen_job *job)
{
	return job->frame_first > 0 && job->frame_count > 0 && job->frame_count <= PEN_FRAMES_MAX &&
	       job->frame_first <= UINT32_MAX - job->frame_count &&
	       job->frames_done <= job->frame_count;
}

static char *column_text(sqlite3_stmt *row, int column)
{
	return (char *)(uintptr_t)sqlite3_column_text(row, column);
}

bool pen_job_row_read(struct sqlite3_stmt *row, struct pen_job *ret_job)
{
	struct pen_rect crop = {pen_row_count(row, 10), pen_row_count(row, 11),
		pen_row_count(row, 12), pen_row_count(row, 13)};
	uint32_t tile_px = pen_row_count(row, 14);
	struct pen_job job = {.number = pen_row_number(row, 0)};

	pen_row_text(job.id, sizeof job.id, row, 1);
	job.state = (enum pen_job_state)pen_row_count(row, 2);
	pen_row_text(job.content, sizeof job.content, row, 6);
	job.priority = pen_row_count(row, 7);
	job.width = pen_row_count(row, 8);
	job.height = pen_row_count(row, 9);
	job.sampling.samples = pen_row_count(row, 15);
	job.exposure = sqlite3_column_double(row, 16);
	job.units_done = pen_row_number(row, 17);
	job.units_total = pen_row_number(row, 18);
	job.tiles_done = pen_row_number(row, 19);
	job.samples_done = pen_row_number(row, 20);
	job.created_ms = sqlite3_column_int64(row, 21);
	job.started_ms = sqlite3_column_int64(row, 22);
	job.finished_ms = sqlite3_column_int64(row, 23);
	job.restarts = pen_row_count(row, 24);
	job.error.code = sqlite3_column_int(row, 25);
	pen_row_text(job.error.text, sizeof job.error.text, row, 26);
	job.image_revision = pen_row_number(row, 27);
	job.aovs = pen_row_count(row, 28);
	job.sampling.mode = (enum pen_sampling_mode)pen_row_count(row, 29);
	job.sampling.threshold = sqlite3_column_double(row, 30);
	job.sampling.error = sqlite3_column_double(row, 31);
	job.sampling.confidence = sqlite3_column_double(row, 32);
	job.sampling.min_samples = pen_row_count(row, 33);
	job.frame_first = pen_row_count(row, 34);
	job.frame_count = pen_row_count(row, 35);
	job.frames_done = pen_row_count(row, 36);
	job.samples_passed = pen_row_number(row, 39);
	job.deadline_ms = sqlite3_column_int64(row, 40);
	job.has_key = read_hash(row, 41, &job.key) && read_hash(row, 42, &job.key_body);
	job.verify = (enum pen_verify)pen_row_count(row, 43);
	pen_row_text(job.trace, sizeof job.trace, row, 45);
	if (strlen(job.id) != PEN_JOB_ID_TEXT - 1 || job.state > PEN_JOB_CANCELLED ||
		!read_hash(row, 4, &job.scene_sha256) || !pen_rect_valid(crop) ||
		crop.x1 > PEN_IMAGE_SIDE_MAX || crop.y1 > PEN_IMAGE_SIDE_MAX || tile_px < 16 ||
		tile_px % 16 != 0 || tile_px > PEN_TILE_SIDE_MAX || job.sampling.samples == 0 ||
		job.sampling.samples > PEN_SAMPLES_MAX ||
		job.sampling.mode > PEN_SAMPLING_INTERLEAVED || job.verify > PEN_VERIFY_FULL ||
		!frames_valid(&job) || !pen_row_owner(row, 44, &job.owner))
		return false;
	pen_tiling_init(&job.tiling, crop, tile_px);
	job.name = column_text(row, 3);
	job.equivalence_class = column_text(row, 5);
	job.errors = column_text(row, 37);
	job.warnings = column_text(row, 38);
	*ret_job = job;
	return true;
}
