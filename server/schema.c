/* SPDX-License-Identifier: Apache-2.0 */
#include "server/schema.h"

/* STATE 3 and above is over: see enum pen_job_state. */
static const char schema[] =
	"BEGIN IMMEDIATE;"
	"CREATE TABLE jobs (number INTEGER PRIMARY KEY, id TEXT NOT NULL UNIQUE,"
	" state INTEGER NOT NULL, name TEXT, scene BLOB NOT NULL, class TEXT,"
	" content TEXT NOT NULL, priority INTEGER NOT NULL, width INTEGER NOT NULL,"
	" height INTEGER NOT NULL, crop_x0 INTEGER NOT NULL, crop_y0 INTEGER NOT NULL,"
	" crop_x1 INTEGER NOT NULL, crop_y1 INTEGER NOT NULL, tile_px INTEGER NOT NULL,"
	" samples INTEGER NOT NULL, exposure REAL NOT NULL, units_done INTEGER NOT NULL,"
	" units_total INTEGER NOT NULL, tiles_done INTEGER NOT NULL,"
	" samples_done INTEGER NOT NULL, created_ms INTEGER NOT NULL,"
	" started_ms INTEGER NOT NULL, finished_ms INTEGER NOT NULL, restarts INTEGER NOT NULL,"
	" error_code INTEGER NOT NULL, error_text TEXT NOT NULL,"
	" image_revision INTEGER NOT NULL) STRICT;"
	"CREATE INDEX jobs_scene ON jobs (scene);"
	"CREATE TABLE tiles (job INTEGER NOT NULL, tile INTEGER NOT NULL, rounds INTEGER NOT NULL,"
	" xxh3 INTEGER NOT NULL, PRIMARY KEY (job, tile)) STRICT, WITHOUT ROWID;"
	"CREATE TABLE removed (id TEXT PRIMARY KEY) STRICT, WITHOUT ROWID;"
	"PRAGMA user_version = 1;"
	"COMMIT;";

const char *const pen_schema_migrations[PEN_SCHEMA_VERSION] = {
	schema,
	"BEGIN IMMEDIATE;"
	"ALTER TABLE jobs ADD COLUMN aovs INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE jobs ADD COLUMN mode INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE jobs ADD COLUMN threshold REAL NOT NULL DEFAULT 0;"
	"ALTER TABLE jobs ADD COLUMN error REAL NOT NULL DEFAULT 0;"
	"ALTER TABLE jobs ADD COLUMN confidence REAL NOT NULL DEFAULT 0;"
	"ALTER TABLE jobs ADD COLUMN min_samples INTEGER NOT NULL DEFAULT 0;"
	"PRAGMA user_version = 2;"
	"COMMIT;",
	"BEGIN IMMEDIATE;"
	"ALTER TABLE jobs ADD COLUMN frame_first INTEGER NOT NULL DEFAULT 1;"
	"ALTER TABLE jobs ADD COLUMN frame_count INTEGER NOT NULL DEFAULT 1;"
	"ALTER TABLE jobs ADD COLUMN frames_done INTEGER NOT NULL DEFAULT 0;"
	"UPDATE jobs SET frames_done = 1 WHERE state = 3;"
	"CREATE TABLE frame_tiles (job INTEGER NOT NULL, frame INTEGER NOT NULL,"
	" tile INTEGER NOT NULL, rounds INTEGER NOT NULL, xxh3 INTEGER NOT NULL,"
	" PRIMARY KEY (job, frame, tile)) STRICT, WITHOUT ROWID;"
	"INSERT INTO frame_tiles SELECT job, 1, tile, rounds, xxh3 FROM tiles;"
	"DROP TABLE tiles;"
	"ALTER TABLE frame_tiles RENAME TO tiles;"
	"PRAGMA user_version = 3;"
	"COMMIT;",
	"BEGIN IMMEDIATE;"
	"ALTER TABLE jobs ADD COLUMN errors TEXT;"
	"ALTER TABLE jobs ADD COLUMN warnings TEXT;"
	"PRAGMA user_version = 4;"
	"COMMIT;",
	"BEGIN IMMEDIATE;"
	"ALTER TABLE jobs ADD COLUMN samples_passed INTEGER NOT NULL DEFAULT 0;"
	"UPDATE jobs SET samples_passed ="
	" frames_done * samples * (crop_x1 - crop_x0) * (crop_y1 - crop_y0);"
	"PRAGMA user_version = 5;"
	"COMMIT;",
	"BEGIN IMMEDIATE;"
	"ALTER TABLE jobs ADD COLUMN deadline_ms INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE jobs ADD COLUMN key BLOB;"
	"ALTER TABLE jobs ADD COLUMN key_body BLOB;"
	"PRAGMA user_version = 6;"
	"COMMIT;",
	"BEGIN IMMEDIATE;"
	"ALTER TABLE jobs ADD COLUMN verify INTEGER NOT NULL DEFAULT 0;"
	"PRAGMA user_version = 7;"
	"COMMIT;",
	"BEGIN IMMEDIATE;"
	"ALTER TABLE jobs ADD COLUMN owner BLOB;"
	"ALTER TABLE removed ADD COLUMN owner BLOB;"
	"PRAGMA user_version = 8;"
	"COMMIT;",
	"BEGIN IMMEDIATE;"
	"ALTER TABLE jobs ADD COLUMN trace TEXT;"
	"PRAGMA user_version = 9;"
	"COMMIT;",
	"BEGIN IMMEDIATE;"
	"CREATE TABLE scenes (sha256 BLOB PRIMARY KEY, text BLOB NOT NULL) STRICT;"
	"PRAGMA user_version = 10;"
	"COMMIT;",
};
