/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/sequence.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { SAMPLES = 256, PIXELS = 4096, SIDE = 64 };

static struct pen_sampler make_sampler(enum pen_sequence sequence)
{
	const struct pen_sampling_desc desc = {.samples = SAMPLES, .sequence = sequence, .seed = 1};
	struct pen_sampler sampler;

	pen_sampler_init(&sampler, &desc, 0);
	return sampler;
}

/* The estimate of a pixel: the mean of an integrand over its samples. */
typedef double (*estimate_function)(const struct pen_sampler *sampler, uint32_t x, uint32_t y);

struct moments {
	double mean, variance;
};

static struct moments measure(enum pen_sequence sequence, estimate_function estimate)
{
	const struct pen_sampler sampler = make_sampler(sequence);
	double sum = 0.0, squares = 0.0;

	for (uint32_t i = 0; i < PIXELS; i++) {
		const double value = estimate(&sampler, i % SIDE, i / SIDE);

		sum += value;
		squares += value * value;
	}
	return (struct moments){sum / PIXELS, squares / PIXELS - sum * sum / PIXELS / PIXELS};
}

/* An edge across two groups of dimensions: the product of what they have in common. */
static double two_groups(const struct pen_sampler *sampler, uint32_t x, uint32_t y)
{
	uint32_t key[SAMPLES], index[SAMPLES];
	float a[SAMPLES], b[SAMPLES], c[SAMPLES], d[SAMPLES];
	double sum = 0.0;

	for (uint32_t i = 0; i < SAMPLES; i++) {
		key[i] = pen_sampler_key(sampler, x, y);
		index[i] = i;
	}
	pen_sampler_pairs(sampler, pen_sample_group(0, PEN_SLOT_LIGHT), SAMPLES, key, index, a, b);
	pen_sampler_pairs(sampler, pen_sample_group(1, PEN_SLOT_LOBE), SAMPLES, key, index, c, d);
	for (uint32_t i = 0; i < SAMPLES; i++)
		sum += a[i] + c[i] < 1.0f ? 4.0 * (double)(b[i] * d[i]) : 0.0;
	return sum / SAMPLES;
}

/* A moving edge out of focus: joins film, lens and time. */
static double moving_edge(const struct pen_sampler *sampler, uint32_t x, uint32_t y)
{
	double sum = 0.0;

	for (uint32_t first = 0; first < SAMPLES; first += 16) {
		struct pen_camera_samples s;

		pen_sampler_block(sampler, x, y, first, &s);
		for (int i = 0; i < 16; i++)
			sum += 0.5f * s.x[i] + 0.3f * s.y[i] + 0.6f * s.u[i] - 0.2f * s.v[i] +
						       0.7f * s.time[i] <
					       0.95f
				       ? 1.0
				       : 0.0;
	}
	return sum / SAMPLES;
}

/* One smooth pair by itself. */
static double one_pair(const struct pen_sampler *sampler, uint32_t x, uint32_t y)
{
	uint32_t key[SAMPLES], index[SAMPLES];
	float u[SAMPLES], v[SAMPLES];
	double sum = 0.0;

	for (uint32_t i = 0; i < SAMPLES; i++) {
		key[i] = pen_sampler_key(sampler, x, y);
		index[i] = i;
	}
	pen_sampler_pairs(sampler, 33, SAMPLES, key, index, u, v);
	for (uint32_t i = 0; i < SAMPLES; i++)
		sum += (double)(u[i] * v[i]);
	return sum / SAMPLES;
}

static void assert_gain(
	const char *name, estimate_function estimate, enum pen_sequence sequence, double least)
{
	const struct moments random = measure(PEN_SEQUENCE_RANDOM, estimate);
	const struct moments other = measure(sequence, estimate);
	const double error = fabs(other.mean - random.mean);

	if (error > 4.0 * sqrt((random.variance + other.variance) / PIXELS))
		fail_msg("%s: mean %g instead of %g", name, other.mean, random.mean);
	if (random.variance / other.variance < least)
		fail_msg("%s: %.2f times less variance than random; %.2f expected", name,
			random.variance / other.variance, least);
	print_message("%s: %.1f times less variance than random\n", name,
		random.variance / other.variance);
}

/* Groups that share a scramble or a shuffle correlate, and the mean of their product shows it. */
static void groups_are_independent(void **state)
{
	(void)state;
	assert_gain("sobol, two groups", two_groups, PEN_SEQUENCE_SOBOL, 1.5);
	assert_gain("jittered, two groups", two_groups, PEN_SEQUENCE_JITTERED, 1.2);
}

/* Lens and time as pairs of their own instead of one joint point gain 2.2 times at most. */
static void camera_dimensions_gain_together(void **state)
{
	(void)state;
	assert_gain("sobol, moving edge", moving_edge, PEN_SEQUENCE_SOBOL, 4.0);
	assert_gain("jittered, moving edge", moving_edge, PEN_SEQUENCE_JITTERED, 1.2);
}

/*
 * A smooth integrand of one pair shows the net's order. Shuffling the index from its last digit
 * instead of its first leaves a gain of 1.7.
 */
static void pairs_converge_fast(void **state)
{
	(void)state;
	assert_gain("sobol, one pair", one_pair, PEN_SEQUENCE_SOBOL, 500.0);
	assert_gain("jittered, one pair", one_pair, PEN_SEQUENCE_JITTERED, 50.0);
}

/* Errors of neighbouring pixels that go together show as blotches. */
static void neighbours_are_uncorrelated(void **state)
{
	const struct pen_sampler sampler = make_sampler(PEN_SEQUENCE_SOBOL);
	static double value[PIXELS];
	double mean = 0.0, variance = 0.0, right = 0.0, below = 0.0;

	(void)state;
	for (uint32_t i = 0; i < PIXELS; i++) {
		value[i] = two_groups(&sampler, i % SIDE, i / SIDE);
		mean += value[i] / PIXELS;
	}
	for (uint32_t i = 0; i < PIXELS - SIDE - 1; i++) {
		variance += (value[i] - mean) * (value[i] - mean);
		right += (value[i] - mean) * (value[i + 1] - mean);
		below += (value[i] - mean) * (value[i + SIDE] - mean);
	}
	assert_true(fabs(right / variance) < 4.0 / SIDE);
	assert_true(fabs(below / variance) < 4.0 / SIDE);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(groups_are_independent),
		cmocka_unit_test(camera_dimensions_gain_together),
		cmocka_unit_test(pairs_converge_fast),
		cmocka_unit_test(neighbours_are_uncorrelated),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
