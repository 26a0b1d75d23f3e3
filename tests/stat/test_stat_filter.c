/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/filter.h"

#include "directions.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { N = 1 << 20, BINS = 64, WIDTH = 3 };

static float u[N], v[N], dx[N], dy[N], weight[N];

/* The filters' definitions over [-1, 1], in double, up to a factor. */
static double box(double t)
{
	return fabs(t) <= 1.0 ? 1.0 : 0.0;
}

static double triangle(double t)
{
	return 1.0 - fabs(t);
}

static double gaussian(double t)
{
	const double sigma = 2.0 / 6.0; /* of a width of 2 */

	return exp(-0.5 * t * t / (sigma * sigma));
}

static double blackman_harris(double t)
{
	const double x = M_PI * (t + 1.0);

	return 0.35875 - 0.48829 * cos(x) + 0.14128 * cos(2.0 * x) - 0.01168 * cos(3.0 * x);
}

static double mitchell(double t)
{
	const double b = 1.0 / 3.0, c = 1.0 / 3.0;
	const double r = 2.0 * fabs(t);

	if (r < 1.0)
		return (12.0 - 9.0 * b - 6.0 * c) * r * r * r +
		       (-18.0 + 12.0 * b + 6.0 * c) * r * r + 6.0 - 2.0 * b;
	return (-b - 6.0 * c) * r * r * r + (6.0 * b + 30.0 * c) * r * r +
	       (-12.0 * b - 48.0 * c) * r + 8.0 * b + 24.0 * c;
}

static const struct {
	enum pen_filter_type type;
	double (*profile)(double t);
} filters[] = {
	{PEN_FILTER_BOX, box},
	{PEN_FILTER_TRIANGLE, triangle},
	{PEN_FILTER_GAUSSIAN, gaussian},
	{PEN_FILTER_BLACKMAN_HARRIS, blackman_harris},
	{PEN_FILTER_MITCHELL, mitchell},
};

enum { FILTERS = sizeof(filters) / sizeof(filters[0]) };

static void sample_filter(enum pen_filter_type type)
{
	const struct pen_image_desc desc = {.filter = type, .filter_width = WIDTH};
	struct random_numbers numbers = {.state = 2};
	struct pen_filter filter;

	pen_filter_init(&filter, &desc);
	for (int i = 0; i < N; i++) {
		u[i] = random_next(&numbers);
		v[i] = random_next(&numbers);
	}
	pen_filter_sample(&filter, N, u, v, dx, dy, weight);
}

/* The share of the filter, or of its absolute value, in a bin of one axis. */
static void bin_shares(double (*profile)(double t), bool absolute, double ret_share[BINS])
{
	enum { FINE = 1000 };
	double sum = 0.0;

	for (int bin = 0; bin < BINS; bin++) {
		ret_share[bin] = 0.0;
		for (int i = 0; i < FINE; i++) {
			const double f = profile(2.0 * (bin + (i + 0.5) / FINE) / BINS - 1.0);

			ret_share[bin] += absolute ? fabs(f) : f;
		}
		sum += ret_share[bin];
	}
	for (int bin = 0; bin < BINS; bin++)
		ret_share[bin] /= sum;
}

static int bin_of(float offset)
{
	const int bin = (int)((offset / WIDTH + 0.5f) * BINS);

	assert_true(fabsf(offset) <= 0.5f * WIDTH);
	return bin < BINS ? bin : BINS - 1;
}

/* A table too coarse for tails, or one that inverts the wrong half. */
static void offsets_follow_the_filter(void **state)
{
	(void)state;
	for (size_t f = 0; f < FILTERS; f++) {
		double across[BINS] = {0}, down[BINS] = {0}, expected[BINS];

		sample_filter(filters[f].type);
		bin_shares(filters[f].profile, true, expected);
		for (int bin = 0; bin < BINS; bin++)
			expected[bin] *= N;
		for (int i = 0; i < N; i++) {
			across[bin_of(dx[i])]++;
			down[bin_of(dy[i])]++;
		}
		if (chi_squared_probability(across, expected, BINS) < 1e-4 ||
			chi_squared_probability(down, expected, BINS) < 1e-4)
			fail_msg("filter %d: the offsets do not follow it", (int)filters[f].type);
	}
}

/* Weights of another mean than 1 change the brightness; by bins they show the negative lobes. */
static void weights_carry_the_filter(void **state)
{
	(void)state;
	for (size_t f = 0; f < FILTERS; f++) {
		double sums[BINS] = {0}, expected[BINS];
		double mean = 0.0;

		sample_filter(filters[f].type);
		bin_shares(filters[f].profile, false, expected);
		for (int i = 0; i < N; i++) {
			assert_true(filters[f].type == PEN_FILTER_MITCHELL || weight[i] == 1.0f);
			sums[bin_of(dx[i])] += (double)weight[i] / N;
			mean += (double)weight[i] / N;
		}
		assert_float_equal((float)mean, 1.0f, 0.005f);
		for (int bin = 0; bin < BINS; bin++)
			assert_float_equal((float)sums[bin], (float)expected[bin], 0.001f);
	}
}

/* The ends of [0, 1) must stay within the filter, and finite. */
static void ends_are_within(void **state)
{
	static const float ends[4] = {0.0f, 0x1p-24f, 0.5f, 0x1.fffffep-1f};

	(void)state;
	for (size_t f = 0; f < FILTERS; f++) {
		const struct pen_image_desc desc = {
			.filter = filters[f].type, .filter_width = WIDTH};
		struct pen_filter filter;
		float x[4], y[4], w[4];

		pen_filter_init(&filter, &desc);
		pen_filter_sample(&filter, 4, ends, ends, x, y, w);
		assert_float_equal(x[0], -1.5f, 1e-2f);
		assert_float_equal(x[3], 1.5f, 1e-2f);
		assert_float_equal(x[2], 0.0f, 1e-6f);
		for (int i = 0; i < 4; i++)
			assert_true(isfinite(w[i]) && fabsf(x[i]) <= 1.5f && y[i] == x[i]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(offsets_follow_the_filter),
		cmocka_unit_test(weights_carry_the_filter),
		cmocka_unit_test(ends_are_within),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
