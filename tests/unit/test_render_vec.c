/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/vec.h"

#include "core/render/sobol.h"
#include "core/render/warp.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { STEPS = 2000000 };

static void assert_at_most(double value, double bound)
{
	if (!(value <= bound))
		fail_msg("%g is above %g", value, bound);
}

/* A wrong coefficient, or a quarter turn that takes the wrong sign. */
static void sincos_errors(void **state)
{
	double worst = 0.0;

	(void)state;
	for (int i = -STEPS; i < 2 * STEPS; i++) {
		const float u = (float)i / STEPS;
		const struct pen_sincos sc = pen_sincos_turns(u);
		const double angle = 2.0 * M_PI * (double)u;

		worst = fmax(worst, fabs((double)sc.sin - sin(angle)));
		worst = fmax(worst, fabs((double)sc.cos - cos(angle)));
	}
	assert_at_most(worst, 1.2e-7);
}

/* A wrong coefficient, or a jump where the two halves of the range meet. */
static void asin_errors(void **state)
{
	double worst = 0.0;

	(void)state;
	for (int i = -STEPS; i <= STEPS; i++) {
		const float x = (float)i / STEPS;

		worst = fmax(worst, fabs((double)pen_asin(x) - asin((double)x)));
	}
	assert_at_most(worst, 3e-7);
	assert_true(pen_asin(2.0f) == pen_asin(1.0f) && pen_asin(-2.0f) == pen_asin(-1.0f));
}

/* Solid angles are ratios of tiny numbers: their error must be relative. */
static void angle_errors(void **state)
{
	double worst = 0.0;

	(void)state;
	for (int i = 1; i < STEPS; i++) {
		const double angle = M_PI * i / STEPS;
		const float y = (float)sin(angle);
		const float x = (float)cos(angle);
		const double exact = atan2((double)y, (double)x);

		worst = fmax(worst, fabs((double)pen_angle(y, x) / exact - 1.0));
	}
	for (float y = 1e-30f; y < 1.0f; y *= 1.01f)
		worst = fmax(worst, fabs((double)pen_angle(y, 1.0f) / atan2((double)y, 1.0) - 1.0));
	assert_at_most(worst, 4e-7);
	assert_true(pen_angle(0.0f, 0.0f) == 0.0f);
	assert_true(pen_angle(0.0f, -1.0f) == PEN_PI);
}

/* A value of 1 would step out of a table; a value that repeats early would lose strata. */
static void unit_float_ends(void **state)
{
	(void)state;
	assert_true(pen_unit_float(0) == 0.0f);
	assert_true(pen_unit_float(UINT32_MAX) == PEN_UNIT_MAX);
	assert_true(PEN_UNIT_MAX < 1.0f);
	assert_true(pen_unit_float(1u << 8) > 0.0f);
	assert_int_equal(pen_reverse_bits(0x80000001u), 0x80000001u);
	assert_int_equal(pen_reverse_bits(0x12345678u), 0x1e6a2c48u);
}

/* A frame that is not orthonormal and right-handed scales light; -z is where such code breaks. */
static void bases_are_orthonormal(void **state)
{
	static const float heights[] = {1.0f, -1.0f, 0.0f, -0.9999999f, 0.3f, -0.7f};

	(void)state;
	for (size_t i = 0; i < sizeof(heights) / sizeof(heights[0]); i++) {
		for (float turn = 0.0f; turn < 1.0f; turn += 0.01f) {
			const struct pen_sincos sc = pen_sincos_turns(turn);
			const float r = pen_sqrt_clamped(1.0f - heights[i] * heights[i]);
			const struct pen_vec3 n = {r * sc.cos, r * sc.sin, heights[i]};
			const struct pen_basis basis = pen_basis(n);
			const struct pen_vec3 gap = pen_sub(pen_cross(basis.t, basis.b), n);

			assert_at_most((double)pen_length(gap), 1e-6);
			assert_at_most(fabs((double)pen_dot(basis.t, basis.b)), 1e-6);
			assert_at_most(fabs((double)pen_dot(basis.t, n)), 1e-6);
			assert_at_most(fabs((double)pen_length(basis.t) - 1.0), 1e-6);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sincos_errors),
		cmocka_unit_test(asin_errors),
		cmocka_unit_test(angle_errors),
		cmocka_unit_test(unit_float_ends),
		cmocka_unit_test(bases_are_orthonormal),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
