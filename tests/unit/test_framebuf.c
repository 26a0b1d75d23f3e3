/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/digest.h"
#include "server/framebuf.h"

/* clang-format off */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
/* clang-format on */
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char path[] = "/tmp/penumbra-test-framebuf.XXXXXX";

struct fixture {
	char path[sizeof path];
	struct pen_framebuf framebuf;
	int fd;
};

static int set_up(void **state)
{
	struct fixture *fixture = calloc(1, sizeof *fixture);
	int fd;

	assert_non_null(fixture);
	memcpy(fixture->path, path, sizeof path);
	fd = mkstemp(fixture->path);
	assert_true(fd >= 0);
	(void)close(fd);
	/* Odd sizes, so that the last column and row of tiles are cut. */
	fixture->framebuf.film = pen_film_of(PEN_PLANE_DEPTH);
	pen_tiling_init(&fixture->framebuf.tiling, (struct pen_rect){5, 3, 53, 40}, 32);
	assert_int_equal(
		pen_framebuf_create(fixture->path, pen_framebuf_bytes(&fixture->framebuf), NULL),
		0);
	fixture->fd = open(fixture->path, O_RDWR);
	assert_true(fixture->fd >= 0);
	*state = fixture;
	return 0;
}

static int tear_down(void **state)
{
	struct fixture *fixture = *state;

	(void)close(fixture->fd);
	(void)unlink(fixture->path);
	free(fixture);
	return 0;
}

/* Pixels of tile index that are all different, times factor. */
static float *make_pixels(const struct pen_framebuf *framebuf, uint32_t index, float factor)
{
	size_t count = pen_framebuf_tile_bytes(framebuf, index) / sizeof(float);
	float *pixels = calloc(count, sizeof *pixels);

	assert_non_null(pixels);
	for (size_t i = 0; i < count; i++)
		pixels[i] = factor * (float)(i + 1000 * index);
	return pixels;
}

static void merge(const struct fixture *fixture, uint32_t index, uint32_t round, float factor)
{
	float *pixels = make_pixels(&fixture->framebuf, index, factor);
	size_t size = pen_framebuf_tile_bytes(&fixture->framebuf, index);
	struct pen_framebuf_tile told, found;
	float *stored = malloc(size);

	assert_int_equal(pen_framebuf_merge(fixture->fd, &fixture->framebuf, index, round, pixels,
				 &told, NULL),
		0);
	assert_int_equal(
		pen_framebuf_look(fixture->fd, &fixture->framebuf, index, &found, NULL), 0);
	assert_true(told.xxh3 == found.xxh3);
	assert_true(told.samples == found.samples);
	assert_int_equal(pread(fixture->fd, stored, size,
				 (off_t)(index * pen_framebuf_slot_bytes(&fixture->framebuf))),
		(ssize_t)size);
	assert_true(pen_xxh3(stored, size) == told.xxh3);
	free(stored);
	free(pixels);
}

/* Broken by: a file without its space, or with bytes from before. */
static void test_create(void **state)
{
	struct fixture *fixture = *state;
	struct stat status;
	char byte = 1;

	assert_int_equal(fstat(fixture->fd, &status), 0);
	assert_int_equal(status.st_size,
		fixture->framebuf.tiling.count * pen_framebuf_slot_bytes(&fixture->framebuf));
	assert_true(status.st_blocks * 512 >= status.st_size);
	assert_int_equal(pread(fixture->fd, &byte, 1, status.st_size - 1), 1);
	assert_int_equal(byte, 0);
}

/* Broken by: a new file that shares its bytes with the one somebody still reads. */
static void test_create_again(void **state)
{
	struct fixture *fixture = *state;
	struct pen_framebuf_tile before, after;

	merge(fixture, 0, 0, 1);
	assert_int_equal(pen_framebuf_look(fixture->fd, &fixture->framebuf, 0, &before, NULL), 0);
	assert_int_equal(
		pen_framebuf_create(fixture->path, pen_framebuf_bytes(&fixture->framebuf), NULL),
		0);
	assert_int_equal(pen_framebuf_look(fixture->fd, &fixture->framebuf, 0, &after, NULL), 0);
	assert_true(before.xxh3 == after.xxh3);
}

/* Broken by: adding where it should replace, replacing where it should add, a wrong slot. */
static void test_merge(void **state)
{
	struct fixture *fixture = *state;
	const struct pen_framebuf *framebuf = &fixture->framebuf;

	for (uint32_t i = 0; i < framebuf->tiling.count; i++) {
		merge(fixture, i, 0, 1);
		merge(fixture, i, 0, 1);
		merge(fixture, i, 1, 2);
	}
	for (uint32_t i = 0; i < framebuf->tiling.count; i++) {
		size_t size = pen_framebuf_tile_bytes(framebuf, i);
		float *expected = make_pixels(framebuf, i, 3);
		struct pen_framebuf_tile tile;

		assert_int_equal(pen_framebuf_look(fixture->fd, framebuf, i, &tile, NULL), 0);
		assert_true(tile.xxh3 == pen_xxh3(expected, size));
		free(expected);
	}
}

/* Broken by: taking a file that was cut short for one full of zeros. */
static void test_truncated(void **state)
{
	struct fixture *fixture = *state;
	uint32_t last = fixture->framebuf.tiling.count - 1;
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_framebuf_tile tile;

	assert_int_equal(
		ftruncate(fixture->fd, (off_t)(last * pen_framebuf_slot_bytes(&fixture->framebuf))),
		0);
	assert_int_equal(
		pen_framebuf_look(fixture->fd, &fixture->framebuf, last, &tile, &err), PEN_EIO);
	assert_true(strlen(err.text) > 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(test_create, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_create_again, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_merge, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_truncated, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
