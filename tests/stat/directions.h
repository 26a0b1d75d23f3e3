/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_STAT_DIRECTIONS_H
#define PEN_TESTS_STAT_DIRECTIONS_H

#include "core/render/vec.h"

#include <stdbool.h>
#include <stdint.h>

/* A sequence of independent numbers, the same each time. */
struct random_numbers {
	uint64_t state;
};

/* In [0, 1). */
float random_next(struct random_numbers *numbers);

/*
 * A way to sample directions and the density by solid angle that it claims. sample may lose a
 * direction (false).
 */
struct direction_case {
	const char *name;
	bool (*sample)(const void *context, float u, float v, float w, struct pen_vec3 *ret);
	double (*density)(const void *context, struct pen_vec3 direction);
	const void *context;
	struct pen_vec3 axis; /* bins are finest at its two ends */
};

/*
 * Pearson's chi-squared test of 300,000 samples in 800 bins around the axis; fails the
 * running test, with the name, below a probability of 1e-4. Also fails when
 * the density does not integrate to one less the lost share.
 */
void assert_directions(const struct direction_case *test);

/* The probability of a chi-squared value as high, for bins of expected counts; rare bins pooled. */
double chi_squared_probability(const double *observed, const double *expected, int bins);

#endif
