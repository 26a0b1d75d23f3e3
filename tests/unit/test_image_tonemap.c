/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/tonemap.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

/* The encoding direction of IEC 61966-2-1, which the program never evaluates. */
static double encoded(double linear)
{
	if (linear <= 0.0)
		return 0.0;
	if (linear >= 1.0)
		return 255.0;
	return 255.0 *
	       (linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1.0 / 2.4) - 0.055);
}

/* Breaks if any code of the table is off: sweeps all magnitudes, not only the bright end. */
static void test_nearest_code(void **state)
{
	struct pen_tonemap tonemap;

	(void)state;
	pen_tonemap_init(&tonemap, 0.0);
	for (float value = 1e-6f; value < 2.0f; value *= 1.0007f) {
		double error = pen_tonemap_value(&tonemap, value) - encoded((double)value);

		assert_true(fabs(error) <= 0.5 + 1e-4);
	}
}

/* Breaks if the curve dips somewhere, as a wrong start of a cell would make it. */
static void test_monotone(void **state)
{
	struct pen_tonemap tonemap;
	unsigned last = 0;

	(void)state;
	pen_tonemap_init(&tonemap, 0.0);
	for (unsigned i = 0; i <= 1u << 20; i++) {
		unsigned code = pen_tonemap_value(&tonemap, (float)i / (1u << 20));

		assert_true(code == last || code == last + 1);
		last = code;
	}
	assert_int_equal(last, 255);
}

/* Breaks if a value outside 0..1 reaches the table. */
static void test_extremes(void **state)
{
	struct pen_tonemap tonemap;

	(void)state;
	pen_tonemap_init(&tonemap, 0.0);
	assert_int_equal(pen_tonemap_value(&tonemap, NAN), 0);
	assert_int_equal(pen_tonemap_value(&tonemap, -INFINITY), 0);
	assert_int_equal(pen_tonemap_value(&tonemap, -1.0f), 0);
	assert_int_equal(pen_tonemap_value(&tonemap, nextafterf(1.0f, 0.0f)), 255);
	assert_int_equal(pen_tonemap_value(&tonemap, INFINITY), 255);
	pen_tonemap_init(&tonemap, 5000.0);
	assert_int_equal(pen_tonemap_value(&tonemap, 0.0f), 0);
	assert_int_equal(pen_tonemap_value(&tonemap, 1e-30f), 255);
}

/* Breaks if exposure is not a power of two, or is applied after the curve. */
static void test_exposure(void **state)
{
	struct pen_tonemap plain, brighter;

	(void)state;
	pen_tonemap_init(&plain, 0.0);
	pen_tonemap_init(&brighter, 2.0);
	for (float value = 0.0f; value < 0.25f; value += 0.001f)
		assert_int_equal(pen_tonemap_value(&brighter, value),
			pen_tonemap_value(&plain, 4.0f * value));
}

/* Breaks if alpha is tone-mapped, or written into a row that has none. */
static void test_row(void **state)
{
	static const float rgba[8] = {0.0f, 0.5f, 1.0f, 1.0f, 0.0f, 0.0f, 0.0f, 0.0f};
	struct pen_tonemap tonemap;
	uint8_t row[9] = {[6] = 77, [8] = 77};

	(void)state;
	pen_tonemap_init(&tonemap, 0.0);
	pen_tonemap_row(&tonemap, rgba, 2, 3, row);
	assert_memory_equal(row, ((uint8_t[]){0, 188, 255, 0, 0, 0, 77}), 7);
	pen_tonemap_row(&tonemap, rgba, 2, 4, row);
	assert_memory_equal(row, ((uint8_t[]){0, 188, 255, 255, 0, 0, 0, 0, 77}), 9);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_nearest_code),
		cmocka_unit_test(test_monotone),
		cmocka_unit_test(test_extremes),
		cmocka_unit_test(test_exposure),
		cmocka_unit_test(test_row),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
