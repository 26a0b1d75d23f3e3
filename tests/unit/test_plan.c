/* SPDX-License-Identifier: Apache-2.0 */
#include "server/plan.h"

/* clang-format off */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
/* clang-format on */

static uint32_t plan(uint32_t width, uint32_t height, uint32_t samples, uint32_t processes)
{
	return pen_plan_tile_px((struct pen_rect){0, 0, width, height}, samples, 1, processes);
}

/* Broken by: tiles so large that processes idle, or smaller than they need be. */
static void test_tile_px(void **state)
{
	(void)state;
	assert_int_equal(plan(1920, 1080, 64, 0), 64);
	assert_int_equal(plan(1920, 1080, 64, 2), 64);
	assert_int_equal(plan(256, 128, 64, 2), 64); /* 8 tiles */
	assert_int_equal(plan(256, 128, 64, 3), 32);
	assert_int_equal(plan(256, 128, 64, 9), 16);
	assert_int_equal(plan(1, 1, 64, 64), 16); /* there is nothing below */
}

/* Broken by: previews that spend their time on handing tiles out, or on one process. */
static void test_few_samples(void **state)
{
	(void)state;
	assert_int_equal(plan(640, 360, 1, 2), 128);
	assert_int_equal(plan(640, 360, 4, 2), 128);
	assert_int_equal(plan(640, 360, 5, 2), 64);
	assert_int_equal(plan(64, 64, 4, 2), 64);
	assert_int_equal(plan(64, 64, 32, 2), 16);
	assert_int_equal(plan(640, 360, 4, 32), 64);
}

static uint32_t plan_frames(uint32_t samples, uint32_t frames, uint32_t processes)
{
	return pen_plan_tile_px((struct pen_rect){0, 0, 320, 180}, samples, frames, processes);
}

/* Broken by: frames cut as if each had to keep all processes busy by itself. */
static void test_frames(void **state)
{
	(void)state;
	assert_int_equal(plan_frames(16, 1, 2), 64);
	assert_int_equal(plan_frames(16, 2, 2), 128); /* 6 tiles each */
	assert_int_equal(plan_frames(64, 240, 6), 128);
	assert_int_equal(plan_frames(64, 240, 7), 64); /* four frames abreast are not enough */
	assert_int_equal(plan_frames(65, 240, 2), 64);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_tile_px),
		cmocka_unit_test(test_few_samples),
		cmocka_unit_test(test_frames),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
