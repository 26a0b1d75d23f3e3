/* SPDX-License-Identifier: Apache-2.0 */
#include "directions.h"

#include "core/render/warp.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* Rings count from the axis to the equator and again from its far end. */
enum { RINGS = 20, SECTORS = 20, BINS = 2 * RINGS * SECTORS, FINE = 40, SAMPLES = 300000 };

float random_next(struct random_numbers *numbers)
{
	/* The finaliser of splitmix64 (Steele, Lea, Flood 2014) over a Weyl sequence. */
	uint64_t x = numbers->state += 0x9e3779b97f4a7c15u;

	x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
	x = (x ^ x >> 27) * 0x94d049bb133111ebu;
	return (float)((x ^ x >> 31) >> 40) * 0x1p-24f;
}

double chi_squared_probability(const double *observed, const double *expected, int bins)
{
	double pooled_observed = 0.0;
	double pooled_expected = 0.0;
	double sum = 0.0;
	int freedom = -1;

	for (int i = 0; i < bins; i++) {
		pooled_observed += observed[i];
		pooled_expected += expected[i];
		if (pooled_expected < 10.0)
			continue;
		sum += (pooled_observed - pooled_expected) * (pooled_observed - pooled_expected) /
		       pooled_expected;
		freedom++;
		pooled_observed = 0.0;
		pooled_expected = 0.0;
	}
	if (freedom < 1)
		return pooled_observed > pooled_expected + 50.0 ? 0.0 : 1.0;

	/* Wilson and Hilferty 1931: the cube root is nearly normal. */
	const double spread = 2.0 / (9.0 * freedom);
	const double z = (cbrt(sum / freedom) - (1.0 - spread)) / sqrt(spread);

	return 0.5 * erfc(z / sqrt(2.0));
}

/* Rings of 1 - |cos| = s^4, s in equal steps: narrow lobes at either end fill many of them. */
static int bin_of(const struct pen_basis *basis, struct pen_vec3 direction)
{
	const bool far = pen_dot(direction, basis->n) < 0.0f;
	const struct pen_vec3 gap =
		far ? pen_add(direction, basis->n) : pen_sub(direction, basis->n);
	const double s = sqrt(sqrt(0.5 * (double)pen_dot(gap, gap)));
	const double turn = 0.5 + atan2((double)pen_dot(direction, basis->b),
					  (double)pen_dot(direction, basis->t)) /
					  (2.0 * M_PI);
	const int ring = s < 1.0 ? (int)(s * RINGS) : RINGS - 1;
	const int sector = turn < 1.0 ? (int)(turn * SECTORS) : SECTORS - 1;

	return ((far ? RINGS : 0) + ring) * SECTORS + sector;
}

/*
 * The density's integral over a bin, by one random point in each of FINE^2 cells, so that the
 * error at an edge of the density averages out.
 */
static double bin_mass(const struct direction_case *test, const struct pen_basis *basis, int bin,
	struct random_numbers *numbers)
{
	const int ring = bin / SECTORS % RINGS;
	const int sector = bin % SECTORS;
	const double side = bin < RINGS * SECTORS ? 1.0 : -1.0;
	double sum = 0.0;

	for (int cell = 0; cell < FINE * FINE; cell++) {
		const double i = cell / FINE + (double)random_next(numbers);
		const double j = cell % FINE + (double)random_next(numbers);
		const double s = (ring + i / FINE) / RINGS;
		const double phi = 2.0 * M_PI * ((sector + j / FINE) / SECTORS - 0.5);
		const double drop = s * s * s * s;
		const double r = sqrt(drop * (2.0 - drop));
		const struct pen_vec3 local = {
			(float)(r * cos(phi)), (float)(r * sin(phi)), (float)(side * (1.0 - drop))};

		sum += s * s * s * test->density(test->context, pen_to_world(basis, local));
	}
	return sum * 4.0 / (RINGS * FINE) * 2.0 * M_PI / (SECTORS * FINE);
}

void assert_directions(const struct direction_case *test)
{
	const struct pen_basis basis = pen_basis(test->axis);
	struct random_numbers numbers = {.state = 1};
	double observed[BINS + 1] = {0}; /* the last: lost */
	double expected[BINS] = {0};
	double total = 0.0;

	for (int i = 0; i < SAMPLES; i++) {
		const float u = random_next(&numbers);
		const float v = random_next(&numbers);
		struct pen_vec3 direction;

		if (test->sample(test->context, u, v, random_next(&numbers), &direction))
			observed[bin_of(&basis, direction)]++;
		else
			observed[BINS]++;
	}
	for (int bin = 0; bin < BINS; bin++) {
		expected[bin] = SAMPLES * bin_mass(test, &basis, bin, &numbers);
		total += expected[bin] / SAMPLES;
	}
	if (fabs(total + observed[BINS] / SAMPLES - 1.0) > 0.002)
		fail_msg("%s: the density integrates to %g, %g is lost", test->name, total,
			observed[BINS] / SAMPLES);

	const double p = chi_squared_probability(observed, expected, BINS);

	if (p < 1e-4)
		fail_msg("%s: p = %g; integral %.5f, lost %.5f", test->name, p, total,
			observed[BINS] / SAMPLES);
}
