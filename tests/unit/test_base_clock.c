/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/clock.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>

#include <cmocka.h>

/* Broken by local time, a wrong field order, or milliseconds without their leading zeros. */
static void format_is_rfc_3339(void **state)
{
	char text[25];

	(void)state;
	pen_clock_format(0, text, sizeof text);
	assert_string_equal(text, "1970-01-01T00:00:00.000Z");
	pen_clock_format(951827696007, text, sizeof text);
	assert_string_equal(text, "2000-02-29T12:34:56.007Z");
}

/* Broken by a clock that runs backwards, or whose units are not what the name says. */
static void clocks_advance_in_their_units(void **state)
{
	const struct timespec pause = {.tv_nsec = 20000000};
	int64_t ms = pen_clock_ms(), us = pen_clock_us();

	(void)state;
	assert_int_equal(nanosleep(&pause, NULL), 0);
	ms = pen_clock_ms() - ms;
	us = pen_clock_us() - us;
	assert_in_range(ms, 19, 20000);
	assert_in_range(us, 20000, 20000000);
}

/* Broken by a wall clock in seconds or microseconds. */
static void wall_clock_counts_ms_since_1970(void **state)
{
	int64_t seconds = time(NULL);

	(void)state;
	assert_in_range(pen_clock_wall_ms() / 1000, seconds - 1, seconds + 60);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(format_is_rfc_3339),
		cmocka_unit_test(clocks_advance_in_their_units),
		cmocka_unit_test(wall_clock_counts_ms_since_1970),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
