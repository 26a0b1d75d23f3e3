/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/filter.h"

#include "core/render/vec.h"

#include <math.h>
#include <string.h>

/* Mitchell and Netravali 1988 with B = C = 1/3, at |r| <= 2. */
PEN_LANE float mitchell(float r)
{
	const float inner = 16.0f / 18.0f + r * r * (-2.0f + r * (21.0f / 18.0f));
	const float outer = 32.0f / 18.0f + r * (-60.0f / 18.0f + r * (2.0f + r * (-7.0f / 18.0f)));

	return r < 1.0f ? inner : outer;
}

/* The filter at a share t in [0, 1] of its radius, up to a factor. */
static double profile(enum pen_filter_type type, double t)
{
	switch (type) {
	case PEN_FILTER_BOX: return 1.0;
	case PEN_FILTER_TRIANGLE: return 1.0 - t;
	case PEN_FILTER_GAUSSIAN: return exp(-4.5 * t * t); /* sigma = radius / 3 */
	case PEN_FILTER_BLACKMAN_HARRIS:
		return 0.35875 + 0.48829 * cos(M_PI * t) + 0.14128 * cos(2.0 * M_PI * t) +
		       0.01168 * cos(3.0 * M_PI * t);
	case PEN_FILTER_MITCHELL: return (double)mitchell((float)(2.0 * t));
	}
	return 0.0;
}

/*
 * Inverts the mass beyond an offset: walks inwards in small steps and notes where the share
 * (i / PEN_FILTER_CELLS)^2 of the whole is reached.
 */
static void tabulate(struct pen_filter *filter, enum pen_filter_type type, double radius)
{
	const int steps = 1 << 17;
	double mass = 0.0;
	double whole = 0.0;
	double sum = 0.0;
	int cell = 0;

	for (int i = 0; i < steps; i++) {
		const double f = profile(type, 1.0 - (i + 0.5) / steps);

		whole += fabs(f) / steps;
		sum += f / steps;
	}
	for (int i = 0; i < steps && cell < PEN_FILTER_CELLS; i++) {
		const double step = fabs(profile(type, 1.0 - (i + 0.5) / steps)) / steps / whole;

		for (; cell < PEN_FILTER_CELLS; cell++) {
			const double q = (double)cell / PEN_FILTER_CELLS;

			if (q * q > mass + step)
				break;
			filter->offset[cell] =
				(float)(radius * (1.0 - (i + (q * q - mass) / step) / steps));
		}
		mass += step;
	}
	for (; cell < PEN_FILTER_CELLS + 2; cell++)
		filter->offset[cell] = 0.0f;
	filter->norm = (float)(1.0 / (sum * radius));
}

void pen_filter_init(struct pen_filter *filter, const struct pen_image_desc *desc)
{
	const double radius = 0.5 * desc->filter_width;

	memset(filter, 0, sizeof(*filter));
	filter->radius = (float)radius;
	filter->has_negative = desc->filter == PEN_FILTER_MITCHELL;
	tabulate(filter, desc->filter, radius);
}

struct axis {
	float offset, weight;
};

/* weighted asks for the weight f / density; without it the weight is 1. */
PEN_LANE struct axis sample_axis(const struct pen_filter *filter, float u, bool weighted)
{
	const float side = 2.0f * u - 1.0f;
	/* A quarter of side's last digit keeps q above 0. */
	const float q = sqrtf(1.0f - fabsf(side) + 0x1p-25f);
	const float at = q * PEN_FILTER_CELLS;
	const int32_t cell = (int32_t)at;
	const float outer = filter->offset[cell];
	const float step = filter->offset[cell + 1] - outer;
	const float offset = outer + (at - (float)cell) * step;
	/* The table's own density is 2 q / |d offset / d q|. */
	const float inv_density = -step * PEN_FILTER_CELLS / (2.0f * q);
	const float f = filter->norm * mitchell(2.0f * offset / filter->radius);

	return (struct axis){
		.offset = copysignf(offset, side),
		.weight = weighted ? f * inv_density : 1.0f,
	};
}

static void sample_positive(const struct pen_filter *filter, uint32_t n, const float *u,
	const float *v, float *restrict ret_dx, float *restrict ret_dy, float *restrict ret_weight)
{
#pragma omp simd
	for (uint32_t i = 0; i < n; i++) {
		ret_dx[i] = sample_axis(filter, u[i], false).offset;
		ret_dy[i] = sample_axis(filter, v[i], false).offset;
		ret_weight[i] = 1.0f;
	}
}

static void sample_signed(const struct pen_filter *filter, uint32_t n, const float *u,
	const float *v, float *restrict ret_dx, float *restrict ret_dy, float *restrict ret_weight)
{
#pragma omp simd
	for (uint32_t i = 0; i < n; i++) {
		const struct axis x = sample_axis(filter, u[i], true);
		const struct axis y = sample_axis(filter, v[i], true);

		ret_dx[i] = x.offset;
		ret_dy[i] = y.offset;
		ret_weight[i] = x.weight * y.weight;
	}
}

void pen_filter_sample(const struct pen_filter *filter, uint32_t n, const float *u, const float *v,
	float *ret_dx, float *ret_dy, float *ret_weight)
{
	if (filter->has_negative)
		sample_signed(filter, n, u, v, ret_dx, ret_dy, ret_weight);
	else
		sample_positive(filter, n, u, v, ret_dx, ret_dy, ret_weight);
}
