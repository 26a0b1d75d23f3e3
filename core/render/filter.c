/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/filter.h"

#include "core/render/vec.h"

#include <math.h>

void pen_filter_init(struct pen_filter *filter, const struct pen_image_desc *desc)
{
	const struct pen_filter_table *table = &pen_filter_tables[desc->filter];
	const double radius = 0.5 * desc->filter_width;

	*filter = (struct pen_filter){
		.radius = (float)radius,
		.norm = (float)(1.0 / (table->mean * radius)),
		.has_negative = desc->filter == PEN_FILTER_MITCHELL,
	};
	for (int i = 0; i < PEN_FILTER_CELLS; i++)
		filter->offset[i] = (float)(radius * table->offsets[i]);
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
	const float f = filter->norm * pen_filter_mitchell(2.0f * offset / filter->radius);

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
