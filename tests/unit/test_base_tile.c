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
	for (uint32_t i = 0; i < 3 * 3000; i++) {
		const struct pen_rounds rounds =
			pen_rounds_of((enum pen_rounds_kind)(i % 3), 1 + i / 3, 0);
		const uint32_t first = rounds.kind == PEN_ROUNDS_EDGE;
		uint32_t next = 0;

		for (uint32_t k = first; k < pen_round_count(&rounds); k++) {
			struct pen_round round = pen_round_get(&rounds, k);

			assert_int_equal(round.first, next);
			assert_true(round.end > round.first && !round.at_centre);
			assert_true(round.end - round.first <= PEN_ROUND_SAMPLES_MAX);
			assert_true(round.first <= 1 || round.first % 16 == 0);
			next = round.end;
			assert_int_equal(pen_round_samples(&rounds, k + 1), next);
		}
		assert_int_equal(next, rounds.samples);
	}
}

/* Broken when another sample count moves the early rounds: only the last one may be cut. */
static void rounds_are_the_stated_ones(void **state)
{
	static const uint32_t ends[3][12] = {
		{1, 16, 32, 64, 128, 256, 512, 768, 1024},
		{16, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024},
		{1, 16, 32, 64, 128, 256, 512, 768, 1024},
	};
	struct pen_rounds rounds;

	(void)state;
	for (uint32_t i = 0; i < 3 * 1024; i++) {
		rounds = pen_rounds_of((enum pen_rounds_kind)(i % 3), 1 + i / 3, 0);
		for (uint32_t k = 0; k + 1 < pen_round_count(&rounds); k++)
			assert_int_equal(pen_round_get(&rounds, k).end, ends[i % 3][k]);
	}
	assert_int_equal(pen_round_count(&rounds), 9);
	assert_true(pen_round_get(&rounds, 0).at_centre);
	rounds = pen_rounds_of(PEN_ROUNDS_UNIFORM, PEN_SAMPLES_MAX, 0);
	assert_int_equal(rounds.sure, pen_round_count(&rounds));
	assert_int_equal(pen_round_get(&rounds, rounds.sure - 1).end, PEN_SAMPLES_MAX);
}

/* Broken when a decision comes before a pixel has its least samples, or later than it could. */
static void rounds_that_are_sure(void **state)
{
	(void)state;
	assert_int_equal(pen_rounds_of(PEN_ROUNDS_ADAPTIVE, 1024, 1).sure, 1);
	assert_int_equal(pen_rounds_of(PEN_ROUNDS_ADAPTIVE, 1024, 16).sure, 1);
	assert_int_equal(pen_rounds_of(PEN_ROUNDS_ADAPTIVE, 1024, 17).sure, 2);
	assert_int_equal(pen_rounds_of(PEN_ROUNDS_ADAPTIVE, 1024, 1024).sure, 12);
	assert_int_equal(pen_rounds_of(PEN_ROUNDS_EDGE, 1024, 0).sure, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(tiles_partition_every_small_image),
		cmocka_unit_test(tiles_partition_every_kind_of_crop),
		cmocka_unit_test(tiles_reach_the_far_corner),
		cmocka_unit_test(rounds_cover_each_sample_once),
		cmocka_unit_test(rounds_are_the_stated_ones),
		cmocka_unit_test(rounds_that_are_sure),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
