/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/tile.h"

#include "core/base/limits.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 64 };

static void paint_tiles(const struct pen_tiling *tiling, uint8_t pixels[SIDE][SIDE])
{
	for (uint32_t i = 0; i < tiling->count; i++) {
		struct pen_rect rect = pen_tiling_rect(tiling, i);

		assert_true(pen_rect_valid(rect));
		assert_true(pen_rect_contains(tiling->crop, rect));
		assert_true(rect.x0 == tiling->crop.x0 || rect.x0 % 16 == 0);
		assert_true(rect.y0 == tiling->crop.y0 || rect.y0 % 16 == 0);
		for (uint32_t y = rect.y0; y < rect.y1; y++)
			for (uint32_t x = rect.x0; x < rect.x1; x++)
				pixels[y][x]++;
	}
}

static void check_partition(struct pen_rect crop, uint32_t tile_px)
{
	static uint8_t pixels[SIDE][SIDE];
	struct pen_tiling tiling;

	memset(pixels, 0, sizeof pixels);
	pen_tiling_init(&tiling, crop, tile_px);
	assert_int_equal(tiling.count, tiling.columns * tiling.rows);
	paint_tiles(&tiling, pixels);
	for (uint32_t y = 0; y < SIDE; y++) {
		for (uint32_t x = 0; x < SIDE; x++) {
			struct pen_rect pixel = {x, y, x + 1, y + 1};

			assert_int_equal(pixels[y][x], pen_rect_contains(crop, pixel));
		}
	}
}

/* Every image up to 64 x 64: broken by a pixel that belongs to no tile, or to two. */
static void tiles_partition_every_small_image(void **state)
{
	(void)state;
	for (uint32_t height = 1; height <= SIDE; height++) {
		for (uint32_t width = 1; width <= SIDE; width++) {
			struct pen_rect image = {0, 0, width, height};

			for (uint32_t tile_px = 16; tile_px <= 64; tile_px += 16)
				check_partition(image, tile_px);
		}
	}
}

/* Crops around the grid's lines: broken by a grid that starts at the crop, not at the image. */
static void tiles_partition_every_kind_of_crop(void **state)
{
	static const uint32_t edges[] = {0, 1, 4, 15, 16, 17, 31, 32, 33, 48, 63, 64};
	const size_t count = sizeof edges / sizeof *edges;

	(void)state;
	for (size_t a = 0; a < count; a++)
		for (size_t b = a + 1; b < count; b++)
			for (size_t c = 0; c < count; c++)
				for (size_t d = c + 1; d < count; d++)
					check_partition((struct pen_rect){edges[a], edges[c],
								edges[b], edges[d]},
						16);
}

/* Broken by arithmetic that is too narrow for the largest image. */
static void tiles_reach_the_far_corner(void **state)
{
	struct pen_rect image = {
		0, 0, PEN_IMAGE_SIDE_MAX, PEN_IMAGE_PIXELS_MAX / PEN_IMAGE_SIDE_MAX};
	struct pen_tiling tiling;
	struct pen_rect last;

	(void)state;
	pen_tiling_init(&tiling, image, 16);
	last = pen_tiling_rect(&tiling, tiling.count - 1);
	assert_int_equal(last.x1, image.x1);
	assert_int_equal(last.y1, image.y1);
	pen_tiling_init(&tiling, (struct pen_rect){5, 5, 6, 6}, PEN_TILE_SIDE_MAX);
	assert_int_equal(tiling.count, 1);
}

/* Broken by a round that is empty, too long, overlaps the next or leaves a sample out. */
static void rounds_cover_each_sample_once(void **state)
{
	(void)state;
	for (uint32_t samples = 1; samples <= 3000; samples++) {
		uint32_t next = 0;

		for (uint32_t i = 0; i < pen_round_count(samples); i++) {
			struct pen_round round = pen_round_get(samples, i);

			assert_int_equal(round.first, next);
			assert_true(round.end > round.first);
			assert_true(round.end - round.first <= PEN_ROUND_SAMPLES_MAX);
			assert_true(round.first <= 1 || round.first % 16 == 0);
			next = round.end;
		}
		assert_int_equal(next, samples);
	}
}

/* Broken when another sample count moves the early rounds: only the last one may be cut. */
static void rounds_are_the_stated_ones(void **state)
{
	static const uint32_t ends[] = {1, 16, 32, 64, 128, 256, 512, 768, 1024};
	const uint32_t count = sizeof ends / sizeof *ends;

	(void)state;
	for (uint32_t samples = 1; samples <= 1024; samples++)
		for (uint32_t i = 0; i + 1 < pen_round_count(samples); i++)
			assert_int_equal(pen_round_get(samples, i).end, ends[i]);
	for (uint32_t i = 0; i < count; i++)
		assert_int_equal(pen_round_count(ends[i]), i + 1);
	assert_int_equal(pen_round_count(0), 0);
	assert_int_equal(pen_round_get(PEN_SAMPLES_MAX, pen_round_count(PEN_SAMPLES_MAX) - 1).end,
		PEN_SAMPLES_MAX);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(tiles_partition_every_small_image),
		cmocka_unit_test(tiles_partition_every_kind_of_crop),
		cmocka_unit_test(tiles_reach_the_far_corner),
		cmocka_unit_test(rounds_cover_each_sample_once),
		cmocka_unit_test(rounds_are_the_stated_ones),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
