/* SPDX-License-Identifier: Apache-2.0 */
#include "server/encoding.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static uint64_t deadline_ms(uint32_t side, uint32_t planes)
{
	const struct pen_encoding_request request = {.crop = {0, 0, side, side}, .planes = planes};

	return pen_encoding_ms(&request);
}

/* Broken by one deadline for all: a hundred million pixels of four layers took longer than that. */
static void test_deadline_grows_with_the_image(void **state)
{
	const uint32_t all = PEN_PLANE_ALBEDO | PEN_PLANE_NORMAL | PEN_PLANE_DEPTH;

	(void)state;
	assert_in_range(deadline_ms(1, 0), 60000, 60001);
	assert_in_range(deadline_ms(1024, 0), 61000, 62000);
	assert_in_range(deadline_ms(10000, all), 300000, 600000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_deadline_grows_with_the_image)};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
