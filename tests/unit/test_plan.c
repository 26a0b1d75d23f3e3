/* SPDX-License-Identifier: Apache-2.0 */
#include "server/plan.h"

/* clang-format off */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
/* clang-format on */

static uint32_t plan(uint32_t width, uint32_t height, uint32_t processes)
{
	return pen_plan_tile_px((struct pen_rect){0, 0, width, height}, processes);
}

/* Broken by: tiles so large that processes idle, or smaller than they need be. */
static void test_tile_px(void **state)
{
	(void)state;
	assert_int_equal(plan(1920, 1080, 0), 64);
	assert_int_equal(plan(1920, 1080, 2), 64);
	assert_int_equal(plan(256, 128, 2), 64); /* 8 tiles */
	assert_int_equal(plan(256, 128, 3), 32);
	assert_int_equal(plan(256, 128, 9), 16);
	assert_int_equal(plan(1, 1, 64), 16); /* there is nothing below */
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_tile_px)};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
