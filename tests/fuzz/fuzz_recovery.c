/* SPDX-License-Identifier: Apache-2.0 */

/*
 * Any bytes as the database that an earlier coordinator left: it is refused, or what it tells is
 * within bounds, and telling it again tells no other. A seed is laid over a good database, so that
 * few bytes reach far.
 */
#include "core/base/limits.h"
#include "server/data_dir.h"
#include "server/store.h"

#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

struct told {
	unsigned jobs, tiles, removed;
	int code;
};

static char dir[] = "/dev/shm/penumbra-fuzz.XXXXXX";
static char database[64];
static uint8_t *good;
static size_t good_size;

static void check(bool holds)
{
	if (!holds)
		abort();
}

static int take_job(void *user, const struct pen_job *job, struct pen_error *err)
{
	struct told *told = user;

	(void)err;
	check(memchr(job->id, '\0', sizeof job->id) != NULL);
	check(job->tiling.count > 0 && job->tiling.crop.x1 <= PEN_IMAGE_SIDE_MAX &&
		job->tiling.crop.y1 <= PEN_IMAGE_SIDE_MAX);
	check(job->sampling.samples > 0 && job->sampling.samples <= PEN_SAMPLES_MAX);
	check(job->frame_count > 0 && job->frame_count <= PEN_FRAMES_MAX);
	check(job->state <= PEN_JOB_CANCELLED);
	told->jobs++;
	return 0;
}

static int take_tile(
	void *user, uint64_t job, const struct pen_store_tile *tile, struct pen_error *err)
{
	struct told *told = user;

	(void)job, (void)tile, (void)err;
	told->tiles++;
	return 0;
}

static int take_removed(
	void *user, const char *id, const struct pen_owner *owner, struct pen_error *err)
{
	struct told *told = user;

	(void)owner, (void)err;
	check(strlen(id) < PEN_JOB_ID_TEXT);
	told->removed++;
	return 0;
}

static struct told load(void)
{
	struct told told = {0};
	const struct pen_store_visitor visitor = {take_job, take_tile, take_removed, &told};
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_store *store = NULL;
	uv_loop_t loop;

	check(uv_loop_init(&loop) == 0);
	told.code = pen_store_create(&loop, dir, &store, &err);
	if (told.code == 0) {
		told.code = pen_store_load(store, &visitor, &err);
		pen_store_destroy(store);
	}
	(void)uv_run(&loop, UV_RUN_DEFAULT);
	check(uv_loop_close(&loop) == 0);
	return told;
}

static void write_database(const uint8_t *bytes, size_t size)
{
	const char *const beside[] = {"-wal", "-shm", "-journal"};
	char path[80];
	int fd;

	for (unsigned i = 0; i < 3; i++) {
		(void)snprintf(path, sizeof path, "%s%s", database, beside[i]);
		(void)unlink(path);
	}
	fd = open(database, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	check(fd >= 0 && write(fd, bytes, size) == (ssize_t)size);
	(void)close(fd);
}

static void read_good(void)
{
	int fd = open(database, O_RDONLY | O_CLOEXEC);
	off_t size = lseek(fd, 0, SEEK_END);

	check(size > 0);
	good_size = (size_t)size;
	good = malloc(good_size);
	check(good && pread(fd, good, good_size, 0) == size);
	(void)close(fd);
}

static void remove_directory(void)
{
	char command[96];

	(void)snprintf(command, sizeof command, "rm -rf %s", dir);
	if (system(command) != 0)
		(void)fprintf(stderr, "%s stays\n", dir);
	free(good);
}

static void note_stored(void *user, const struct pen_error *err)
{
	unsigned *stored = user;

	check(err->code == 0);
	(*stored)++;
}

/* One of each state, with tiles. */
static void make_good(void)
{
	static const char text[] = "{}";
	static char class_text[] = "a";
	const struct pen_store_tile tile = {1, 0, {1, 2, 3}};
	struct pen_store *store;
	unsigned stored = 0;
	uv_loop_t loop;

	check(uv_loop_init(&loop) == 0 && pen_store_create(&loop, dir, &store, NULL) == 0);
	for (uint64_t number = 1; number <= 6; number++) {
		struct pen_job job = {.number = number,
			.state = (enum pen_job_state)(number - 1),
			.priority = 50,
			.equivalence_class = class_text,
			.width = 64,
			.height = 32,
			.sampling = {.mode = PEN_SAMPLING_UNIFORM, .samples = 20},
			.frame_first = 1,
			.frame_count = 3,
			.created_ms = 1};

		(void)snprintf(
			job.id, sizeof job.id, "aaaaaaaaaaaaaaaaaaaaaaaa%02u", (unsigned)number);
		check(pen_sha256_of(text, strlen(text), &job.scene_sha256, NULL) == 0);
		pen_tiling_init(&job.tiling, (struct pen_rect){0, 0, 64, 32}, 16);
		check(pen_store_add_job(store, &job, strdup(text), strlen(text), note_stored,
			      &stored, NULL) == 0);
		check(pen_store_put_tiles(store, number, &tile, 1, NULL) == 0);
	}
	while (stored < 6)
		(void)uv_run(&loop, UV_RUN_ONCE);
	pen_store_destroy(store);
	(void)uv_run(&loop, UV_RUN_DEFAULT);
	check(uv_loop_close(&loop) == 0);
	read_good();
}

static void begin(void)
{
	struct pen_data_dir data;

	check(mkdtemp(dir) != NULL && pen_data_dir_open(&data, dir, NULL) == 0);
	pen_data_dir_close(&data);
	(void)snprintf(database, sizeof database, "%s/penumbra.db", dir);
	make_good();
	(void)atexit(remove_directory);
}

/* Pieces of {place, length, bytes} over the good one; the first byte 0: the bytes are all. */
static void overlay(uint8_t *bytes, const uint8_t *data, size_t size)
{
	while (size > 4) {
		size_t place = ((size_t)data[0] << 16 | (size_t)data[1] << 8 | data[2]) % good_size;
		size_t length = 1u + data[3] % 32u;

		data += 4, size -= 4;
		length = length < size ? length : size;
		length = length < good_size - place ? length : good_size - place;
		memcpy(bytes + place, data, length);
		data += length, size -= length;
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct told first, second;
	uint8_t *bytes;

	if (!good)
		begin();
	if (size > 0 && data[0] == 0) {
		write_database(data + 1, size - 1);
	} else {
		bytes = malloc(good_size);
		check(bytes != NULL);
		memcpy(bytes, good, good_size);
		if (size > 0)
			overlay(bytes, data + 1, size - 1);
		write_database(bytes, good_size);
		free(bytes);
	}
	first = load();
	second = load();
	/* SQLite may notice a broken page at the second look, but never tells something else. */
	check(first.code != 0 || second.code != 0 ||
		(first.jobs == second.jobs && first.tiles == second.tiles &&
			first.removed == second.removed));
	return 0;
}
