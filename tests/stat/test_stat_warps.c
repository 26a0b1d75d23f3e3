/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/warp.h"

#include "directions.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { N = 1000000, SIDE = 24 };

static const struct pen_vec3 up = {0.0f, 0.0f, 1.0f};

static bool sample_cosine(const void *context, float u, float v, float w, struct pen_vec3 *ret)
{
	(void)context;
	(void)w;
	*ret = pen_warp_cosine(u, v);
	return true;
}

static double density_cosine(const void *context, struct pen_vec3 direction)
{
	(void)context;
	return fmax((double)direction.z, 0.0) / M_PI;
}

/* A polar map without the square root crowds the pole. */
static void cosine_directions(void **state)
{
	const struct direction_case test = {"cosine", sample_cosine, density_cosine, NULL, up};

	(void)state;
	assert_directions(&test);
}

static bool sample_cone(const void *context, float u, float v, float w, struct pen_vec3 *ret)
{
	const float *h = context;

	(void)w;
	*ret = pen_warp_cone(*h, u, v);
	return true;
}

static double density_cone(const void *context, struct pen_vec3 direction)
{
	const float *h = context;
	const struct pen_vec3 gap = pen_sub(direction, up);

	/* 1 - cos is half the squared chord, which a narrow cone needs. */
	return 0.5f * pen_dot(gap, gap) <= *h ? 1.0 / (2.0 * M_PI * (double)*h) : 0.0;
}

/* A map of the disk that does not go with the cone's height; a wide cone passes the equator. */
static void cone_directions(void **state)
{
	static const float cones[] = {3e-4f, 0.01f, 0.5f, 1.7f};

	(void)state;
	for (size_t i = 0; i < 4; i++) {
		const struct direction_case test = {
			"cone", sample_cone, density_cone, &cones[i], up};

		assert_directions(&test);
	}
}

/* A cone so narrow that its cosine rounds to 1 must keep its width. */
static void narrow_cones_keep_their_width(void **state)
{
	struct random_numbers numbers = {.state = 6};
	double sum = 0.0;

	(void)state;
	for (int i = 0; i < N; i++) {
		const float u = random_next(&numbers);
		const struct pen_vec3 d = pen_warp_cone(1e-9f, u, random_next(&numbers));

		sum += 0.5 * (double)(d.x * d.x + d.y * d.y) / N;
	}
	assert_true(fabs(sum / 0.5e-9 - 1.0) < 0.003);
}

typedef bool (*inside_function)(double x, double y);

static bool inside_disk(double x, double y)
{
	return x * x + y * y <= 1.0;
}

/* A heptagon with a corner a tenth of a turn from +x. */
static bool inside_heptagon(double x, double y)
{
	for (int i = 0; i < 7; i++) {
		const double middle = 2.0 * M_PI * (0.1 + (i + 0.5) / 7.0);

		if (x * cos(middle) + y * sin(middle) > cos(M_PI / 7.0))
			return false;
	}
	return true;
}

/* Chi-squared over a grid on the square around the shape. */
static double uniformity(inside_function inside, const float *x, const float *y)
{
	enum { FINE = 100 };
	double observed[SIDE * SIDE] = {0}, expected[SIDE * SIDE] = {0};
	double area = 0.0;

	for (int i = 0; i < SIDE * SIDE * FINE * FINE; i++) {
		const int column = i % (SIDE * FINE);
		const int row = i / (SIDE * FINE);

		if (!inside(2.0 * (column + 0.5) / (SIDE * FINE) - 1.0,
			    2.0 * (row + 0.5) / (SIDE * FINE) - 1.0))
			continue;
		expected[row / FINE * SIDE + column / FINE]++;
		area++;
	}
	for (int i = 0; i < SIDE * SIDE; i++)
		expected[i] *= N / area;
	for (int i = 0; i < N; i++) {
		const int column = (int)((x[i] + 1.0f) * 0.4999999f * SIDE);
		const int row = (int)((y[i] + 1.0f) * 0.4999999f * SIDE);

		assert_true(x[i] * x[i] + y[i] * y[i] < 1.000001f);
		observed[row * SIDE + column]++;
	}
	return chi_squared_probability(observed, expected, SIDE * SIDE);
}

/* Light spread unevenly over the lens changes the blur of every point. */
static void lenses_are_filled_evenly(void **state)
{
	static float x[N], y[N];
	struct random_numbers numbers = {.state = 4};

	(void)state;
	for (int i = 0; i < N; i++) {
		const float u = random_next(&numbers);
		const struct pen_vec2 p = pen_warp_disk(u, random_next(&numbers));

		x[i] = p.x;
		y[i] = p.y;
	}
	assert_true(uniformity(inside_disk, x, y) > 1e-4);
	for (int i = 0; i < N; i++) {
		const float u = random_next(&numbers);
		const struct pen_vec2 p = pen_warp_polygon(7, 0.1f, u, random_next(&numbers));

		x[i] = p.x;
		y[i] = p.y;
	}
	assert_true(uniformity(inside_heptagon, x, y) > 1e-4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(cosine_directions),
		cmocka_unit_test(cone_directions),
		cmocka_unit_test(narrow_cones_keep_their_width),
		cmocka_unit_test(lenses_are_filled_evenly),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
