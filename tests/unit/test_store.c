/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "server/archive.h"
#include "server/data_dir.h"
#include "server/job_texts.h"
#include "server/scene_file.h"
#include "server/store.h"

/* clang-format off */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
/* clang-format on */
#include <ftw.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

/* A store in a directory of its own, and all that a load tells. */
struct fixture {
	uv_loop_t loop;
	struct pen_store *store;
	char dir[64];
	char scenes[PATH_MAX];
	unsigned answers, failures;
	struct pen_job jobs[64];
	size_t job_count;
	struct pen_store_tile tiles[512];
	uint64_t tile_jobs[512];
	size_t tile_count;
	char removed[PEN_JOB_ID_TEXT];
	struct pen_owner removed_owner;
};

static int note_job(void *user, const struct pen_job *job, struct pen_error *err)
{
	struct fixture *fixture = user;
	struct pen_job *copy = &fixture->jobs[fixture->job_count++];

	*copy = *job;
	return pen_job_texts_copy(copy, err);
}

static int note_tile(
	void *user, uint64_t job, const struct pen_store_tile *tile, struct pen_error *err)
{
	struct fixture *fixture = user;

	(void)err;
	fixture->tile_jobs[fixture->tile_count] = job;
	fixture->tiles[fixture->tile_count++] = *tile;
	return 0;
}

static int note_removed(
	void *user, const char *id, const struct pen_owner *owner, struct pen_error *err)
{
	struct fixture *fixture = user;

	(void)err;
	(void)snprintf(fixture->removed, sizeof fixture->removed, "%s", id);
	fixture->removed_owner = *owner;
	return 0;
}

static void forget_loaded(struct fixture *fixture)
{
	for (size_t i = 0; i < fixture->job_count; i++)
		pen_job_texts_free(&fixture->jobs[i]);
	fixture->job_count = fixture->tile_count = 0;
	fixture->removed[0] = '\0';
}

static void open_store(struct fixture *fixture)
{
	struct pen_store_visitor visitor = {note_job, note_tile, note_removed, fixture};

	assert_int_equal(uv_loop_init(&fixture->loop), 0);
	assert_int_equal(pen_store_create(&fixture->loop, fixture->dir, &fixture->store, NULL), 0);
	forget_loaded(fixture);
	assert_int_equal(pen_store_load(fixture->store, &visitor, NULL), 0);
}

static void close_store(struct fixture *fixture)
{
	pen_store_destroy(fixture->store);
	assert_int_equal(uv_run(&fixture->loop, UV_RUN_DEFAULT), 0);
	assert_int_equal(uv_loop_close(&fixture->loop), 0);
}

static int set_up(void **state)
{
	struct fixture *fixture = calloc(1, sizeof *fixture);
	struct pen_data_dir data;

	assert_non_null(fixture);
	(void)snprintf(fixture->dir, sizeof fixture->dir, "/tmp/penumbra-test-store.XXXXXX");
	assert_non_null(mkdtemp(fixture->dir));
	assert_int_equal(pen_data_dir_open(&data, fixture->dir, NULL), 0);
	(void)snprintf(fixture->scenes, sizeof fixture->scenes, "%s", data.scenes);
	pen_data_dir_close(&data);
	open_store(fixture);
	*state = fixture;
	return 0;
}

static int remove_entry(const char *path, const struct stat *status, int type, struct FTW *walk)
{
	(void)status;
	(void)type;
	(void)walk;
	return remove(path);
}

static int tear_down(void **state)
{
	struct fixture *fixture = *state;

	close_store(fixture);
	forget_loaded(fixture);
	(void)nftw(fixture->dir, remove_entry, 8, FTW_DEPTH | FTW_PHYS);
	free(fixture);
	return 0;
}

static void reopen(struct fixture *fixture)
{
	close_store(fixture);
	open_store(fixture);
}

static void note_answer(void *user, const struct pen_error *err)
{
	struct fixture *fixture = user;

	fixture->answers++;
	fixture->failures += err->code != 0;
}

static void wait_answers(struct fixture *fixture, unsigned count)
{
	while (fixture->answers < count)
		(void)uv_run(&fixture->loop, UV_RUN_ONCE);
	assert_int_equal(fixture->failures, 0);
}

static struct pen_job make_job(uint64_t number, const char *text)
{
	struct pen_job job = {
		.number = number,
		.priority = 50,
		.width = 100,
		.height = 60,
		.sampling = {.mode = PEN_SAMPLING_ADAPTIVE,
			.threshold = 0.3,
			.error = 0.02,
			.confidence = 0.9,
			.min_samples = 8,
			.samples = 20},
		.aovs = PEN_AOV_DEPTH | PEN_AOV_SAMPLES,
		.exposure = -0.1,
		.units_total = 24,
		.frame_first = 1,
		.frame_count = 9,
		.created_ms = 1700000000000 + (int64_t)number,
	};

	(void)snprintf(job.id, sizeof job.id, "aaaaaaaaaaaaaaaaaaaaaaaa%02u", (unsigned)number);
	assert_int_equal(pen_sha256_of(text, strlen(text), &job.scene_sha256, NULL), 0);
	pen_tiling_init(&job.tiling, (struct pen_rect){3, 1, 100, 60}, 32);
	return job;
}

static void add_job(struct fixture *fixture, const struct pen_job *job, const char *text)
{
	assert_int_equal(pen_store_add_job(fixture->store, job, strdup(text), strlen(text),
				 note_answer, fixture, NULL),
		0);
}

static bool has_scene(const struct fixture *fixture, const struct pen_sha256 *sha256)
{
	uint64_t size;
	int fd;

	if (pen_scene_file_open(fixture->scenes, sha256, &fd, &size, NULL) < 0)
		return false;
	(void)close(fd);
	return true;
}

/* Broken by: a member of a job that does not come back as it went in. */
static void test_round_trip(void **state)
{
	struct fixture *fixture = *state;
	struct pen_job job = make_job(1, "{}");
	const struct pen_job *loaded = &fixture->jobs[0];

	job.name = strdup("a \"name\"");
	job.equivalence_class = strdup("1/x86-64-v3/embree-3.13.5/AMD");
	job.warnings = strdup("[\"first\",\"second\"]");
	job.state = PEN_JOB_RUNNING;
	job.samples_done = UINT64_C(1) << 40;
	job.restarts = 2;
	job.image_revision = 17;
	add_job(fixture, &job, "{}");
	wait_answers(fixture, 1);
	reopen(fixture);
	assert_int_equal(fixture->job_count, 1);
	assert_string_equal(loaded->id, job.id);
	assert_string_equal(loaded->name, job.name);
	assert_string_equal(loaded->equivalence_class, job.equivalence_class);
	assert_string_equal(loaded->warnings, job.warnings);
	assert_null(loaded->errors);
	assert_int_equal(loaded->state, PEN_JOB_RUNNING);
	assert_memory_equal(&loaded->tiling, &job.tiling, sizeof job.tiling);
	assert_memory_equal(&loaded->scene_sha256, &job.scene_sha256, sizeof job.scene_sha256);
	assert_true(loaded->exposure == job.exposure);
	assert_memory_equal(&loaded->sampling, &job.sampling, sizeof job.sampling);
	assert_int_equal(loaded->aovs, job.aovs);
	assert_int_equal(loaded->samples_done, job.samples_done);
	assert_int_equal(loaded->restarts, 2);
	assert_int_equal(loaded->created_ms, job.created_ms);
	/* Merges that were not stored may have been shown: their revisions are not used again. */
	assert_true(loaded->image_revision > job.image_revision + job.units_total);
	assert_true(has_scene(fixture, &job.scene_sha256));
	pen_job_texts_free(&job);
}

/* Broken by: losing what was wrong with the scene of a failed job, or what was left out of it. */
static void test_reports(void **state)
{
	struct fixture *fixture = *state;
	struct pen_job job = make_job(1, "{}");
	char errors[] = "[{\"pointer\":\"/objects/0\",\"detail\":\"broken\"}]";
	char warnings[] = "[\"left out\"]";

	add_job(fixture, &job, "{}");
	job.state = PEN_JOB_FAILED;
	job.errors = errors;
	job.warnings = warnings;
	assert_int_equal(pen_store_update_job(fixture->store, &job, note_answer, fixture, NULL), 0);
	wait_answers(fixture, 2);
	reopen(fixture);
	assert_string_equal(fixture->jobs[0].errors, errors);
	assert_string_equal(fixture->jobs[0].warnings, warnings);
}

/*
 * Broken by: keeping the tiles of a job that is over or starts again, or of a frame that is done,
 * or losing the others.
 */
static void test_tiles(void **state)
{
	struct fixture *fixture = *state;
	struct pen_store_tile tiles[] = {
		{1, 7, {1, 3, 0}}, {2, 0, {1, 11, 0}}, {2, 5, {2, UINT64_MAX, 0}}};
	char class_text[] = "c";

	for (uint64_t number = 1; number <= 3; number++) {
		struct pen_job job = make_job(number, "{}");

		job.equivalence_class = class_text;
		add_job(fixture, &job, "{}");
		assert_int_equal(pen_store_put_tiles(fixture->store, number, tiles, 3, NULL), 0);
		job.state = number == 1 ? PEN_JOB_DONE : PEN_JOB_RUNNING;
		job.equivalence_class = number == 2 ? NULL : class_text;
		job.frames_done = 1;
		assert_int_equal(
			pen_store_update_job(fixture->store, &job, note_answer, fixture, NULL), 0);
	}
	wait_answers(fixture, 6);
	reopen(fixture);
	assert_int_equal(fixture->job_count, 3);
	assert_int_equal(fixture->tile_count, 2);
	assert_int_equal(fixture->tile_jobs[0], 3);
	assert_int_equal(fixture->jobs[2].frames_done, 1);
	assert_int_equal(fixture->jobs[2].frame_count, 9);
	assert_int_equal(fixture->tiles[1].frame, 2);
	assert_int_equal(fixture->tiles[1].tile, 5);
	assert_int_equal(fixture->tiles[1].state.rounds, 2);
	assert_true(fixture->tiles[1].state.xxh3 == UINT64_MAX);
}

/* Broken by: forgetting that a job was there, or removing a scene that another job has. */
static void test_remove(void **state)
{
	struct fixture *fixture = *state;
	struct pen_job a = make_job(1, "{}"), b = make_job(2, "{}");

	add_job(fixture, &a, "{}");
	add_job(fixture, &b, "{}");
	assert_int_equal(pen_store_remove_job(fixture->store, &a, note_answer, fixture, NULL), 0);
	wait_answers(fixture, 3);
	assert_true(has_scene(fixture, &a.scene_sha256));
	assert_int_equal(pen_store_remove_job(fixture->store, &b, note_answer, fixture, NULL), 0);
	wait_answers(fixture, 4);
	assert_false(has_scene(fixture, &a.scene_sha256));
	reopen(fixture);
	assert_int_equal(fixture->job_count, 0);
	assert_int_equal(strlen(fixture->removed), PEN_JOB_ID_TEXT - 1);
}

/* Broken by: a render that changes hands, or becomes everybody's, when it is stored or removed. */
static void test_owner(void **state)
{
	struct fixture *fixture = *state;
	struct pen_job owned = make_job(1, "{}"), open = make_job(2, "{}");

	owned.owner.is_known = true;
	memset(owned.owner.token.bytes, 0xa5, sizeof owned.owner.token.bytes);
	add_job(fixture, &owned, "{}");
	add_job(fixture, &open, "{}");
	wait_answers(fixture, 2);
	reopen(fixture);
	assert_int_equal(fixture->job_count, 2);
	assert_true(pen_owner_equal(&fixture->jobs[0].owner, &owned.owner));
	assert_false(fixture->jobs[1].owner.is_known);
	assert_int_equal(
		pen_store_remove_job(fixture->store, &owned, note_answer, fixture, NULL), 0);
	wait_answers(fixture, 3);
	reopen(fixture);
	assert_string_equal(fixture->removed, owned.id);
	assert_true(pen_owner_equal(&fixture->removed_owner, &owned.owner));
}

/* Adds jobs until it is killed, and tells of each that it has been promised. */
static void promise_jobs(struct fixture *fixture, int out)
{
	char text[32];

	for (uint64_t number = 1; number <= 60; number++) {
		struct pen_job job;

		(void)snprintf(text, sizeof text, "{\"n\":%u}", (unsigned)number);
		job = make_job(number, text);
		add_job(fixture, &job, text);
		wait_answers(fixture, (unsigned)number);
		(void)!write(out, "", 1);
	}
	(void)pause();
}

/* Broken by: answering before the job and its scene are in files that a kill cannot take back. */
static void test_kill(void **state)
{
	struct fixture *fixture = *state;
	char told[64];
	int fds[2], status;

	for (unsigned promised = 1; promised <= 40; promised += 13) {
		ssize_t total = 0, n;
		pid_t child;

		close_store(fixture);
		assert_int_equal(pipe(fds), 0);
		child = fork();
		assert_true(child >= 0);
		if (child == 0) {
			fixture->answers = 0;
			(void)close(fds[0]);
			open_store(fixture);
			promise_jobs(fixture, fds[1]);
			_exit(0);
		}
		(void)close(fds[1]);
		while (total < promised && (n = read(fds[0], told, sizeof told)) > 0)
			total += n;
		(void)kill(child, SIGKILL);
		assert_int_equal(waitpid(child, &status, 0), child);
		while ((n = read(fds[0], told, sizeof told)) > 0)
			total += n;
		(void)close(fds[0]);
		open_store(fixture);
		assert_true(fixture->job_count >= (size_t)total);
		for (size_t i = 0; i < fixture->job_count; i++)
			assert_true(has_scene(fixture, &fixture->jobs[i].scene_sha256));
	}
}

/* Broken by: a scene file that a crash left behind without its job staying for ever. */
static void test_sweep(void **state)
{
	struct fixture *fixture = *state;
	struct pen_job kept = make_job(1, "kept"), orphan = make_job(2, "orphan");

	add_job(fixture, &kept, "kept");
	wait_answers(fixture, 1);
	assert_int_equal(pen_scene_file_write(
				 fixture->scenes, &orphan.scene_sha256, "orphan", 6, true, NULL),
		0);
	reopen(fixture);
	assert_true(has_scene(fixture, &kept.scene_sha256));
	assert_false(has_scene(fixture, &orphan.scene_sha256));
}

/* A scene of so many bytes, as the store would get it. */
static char *make_scene(size_t size)
{
	char *text = malloc(size + 1);

	assert_non_null(text);
	memset(text, ' ', size);
	text[size] = '\0';
	return text;
}

/* What a power cut may leave of a file that nobody waited for. */
enum loss { GONE, EMPTY, TORN, LOSSES };

static void lose_scene(const struct fixture *fixture, const struct pen_job *job, enum loss loss)
{
	char name[PEN_SHA256_TEXT], path[PATH_MAX + PEN_SHA256_TEXT + 8];

	pen_sha256_format(&job->scene_sha256, name);
	(void)snprintf(path, sizeof path, "%s/%s.json", fixture->scenes, name);
	if (loss == GONE)
		assert_int_equal(unlink(path), 0);
	else
		assert_int_equal(truncate(path, loss == EMPTY ? 0 : 10), 0);
}

/* Broken by: trusting a file that was not waited for, or a limit that is off by one. */
static void test_scene_rows(void **state)
{
	struct fixture *fixture = *state;
	struct pen_job jobs[3];

	for (size_t i = 0; i < 3; i++) {
		char *text = make_scene(PEN_SCENE_ROW_BYTES_MAX - 1 + i);

		jobs[i] = make_job(i + 1, text);
		add_job(fixture, &jobs[i], text);
		free(text);
	}
	wait_answers(fixture, 3);
	for (enum loss loss = GONE; loss < LOSSES; loss++) {
		lose_scene(fixture, &jobs[0], loss);
		lose_scene(fixture, &jobs[1], loss);
		reopen(fixture);
		assert_true(pen_scene_file_is_whole(fixture->scenes, &jobs[0].scene_sha256));
		assert_true(pen_scene_file_is_whole(fixture->scenes, &jobs[1].scene_sha256));
	}
	lose_scene(fixture, &jobs[2], GONE); /* it was waited for: this is no power cut's doing */
	reopen(fixture);
	assert_false(has_scene(fixture, &jobs[2].scene_sha256));
}

static bool has_row(const struct fixture *fixture, const struct pen_job *job)
{
	struct pen_archive *archive;
	bool has;

	assert_int_equal(pen_archive_open(fixture->dir, false, &archive, NULL), 0);
	has = pen_archive_has_scene(archive, &job->scene_sha256);
	pen_archive_close(archive);
	return has;
}

/* Broken by: a row that outlives its last job, or goes with the first of two. */
static void test_scene_row_goes(void **state)
{
	struct fixture *fixture = *state;
	struct pen_job first = make_job(1, "same"), second = make_job(2, "same");

	add_job(fixture, &first, "same");
	add_job(fixture, &second, "same");
	assert_int_equal(
		pen_store_remove_job(fixture->store, &first, note_answer, fixture, NULL), 0);
	wait_answers(fixture, 3);
	assert_true(has_row(fixture, &second));
	assert_int_equal(
		pen_store_remove_job(fixture->store, &second, note_answer, fixture, NULL), 0);
	wait_answers(fixture, 4);
	assert_false(has_row(fixture, &second));
}

/* Broken by: letting in a second coordinator. */
static void test_lock(void **state)
{
	struct fixture *fixture = *state;
	struct pen_data_dir first, second;
	struct pen_error err = PEN_ERROR_INIT;

	assert_int_equal(pen_data_dir_open(&first, fixture->dir, NULL), 0);
	assert_int_equal(pen_data_dir_open(&second, fixture->dir, &err), PEN_ECONFLICT);
	assert_non_null(strstr(err.text, fixture->dir));
	pen_data_dir_close(&first);
	assert_int_equal(pen_data_dir_open(&second, fixture->dir, NULL), 0);
	pen_data_dir_close(&second);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(test_round_trip, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_reports, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_tiles, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_remove, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_owner, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_kill, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_sweep, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_scene_rows, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_scene_row_goes, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_lock, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
