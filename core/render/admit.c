/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/admit.h"

#include "core/render/vec.h"

#include <math.h>

/* Embree asserts that |component| < 1.844e18. */
#define COMPONENT_MAX 1e18f

/*
 * Shares of a box's largest coordinate and side, and of a ray's origin, that the box grows by.
 * Tests of rays and boxes round within some 2^-22 of these, Embree's and ours.
 */
#define BOX_SHARE    0x1p-14f
#define ORIGIN_SHARE 0x1p-19f

/* Directions along a wall have a slope all the same. */
#define COMPONENT_MIN 1e-18f

/* Rare: left in the loop below it would become masked stores for every lane. */
static __attribute__((noinline)) void park(struct pen_rays *rays, int lane)
{
	rays->origin_x[lane] = rays->origin_y[lane] = rays->origin_z[lane] = 0.0f;
	rays->direction_x[lane] = rays->direction_y[lane] = 0.0f;
	rays->direction_z[lane] = 1.0f;
	rays->tnear[lane] = 1.0f;
	rays->tfar[lane] = 0.0f;
}

uint32_t pen_admit_rays(struct pen_rays *rays, int32_t ret_valid[PEN_LANES])
{
	uint32_t dropped = 0, parked = 0;

#pragma omp simd reduction(+ : dropped, parked)
	for (int i = 0; i < PEN_LANES; i++) {
		const int sane = (fabsf(rays->origin_x[i]) < COMPONENT_MAX) &
				 (fabsf(rays->origin_y[i]) < COMPONENT_MAX) &
				 (fabsf(rays->origin_z[i]) < COMPONENT_MAX) &
				 (fabsf(rays->direction_x[i]) < COMPONENT_MAX) &
				 (fabsf(rays->direction_y[i]) < COMPONENT_MAX) &
				 (fabsf(rays->direction_z[i]) < COMPONENT_MAX);
		const int wanted = rays->tnear[i] <= rays->tfar[i];

		ret_valid[i] = -(sane & wanted);
		dropped += (uint32_t)(wanted & ~sane);
		parked += (uint32_t)(1 - (sane & wanted));
		rays->mask[i] = UINT32_MAX;
		rays->flags[i] = 0;
		rays->id[i] = (uint32_t)i;
	}
	for (int i = 0; i < PEN_LANES && parked > 0; i++)
		if (!ret_valid[i])
			park(rays, i);
	return dropped;
}

void pen_admit_box_init(struct pen_admit_box *box, const float lower[3], const float upper[3])
{
	for (int k = 0; k < 3; k++) {
		const float reach = pen_max(fabsf(lower[k]), fabsf(upper[k]));
		const float slack = BOX_SHARE * (reach + (upper[k] - lower[k])) + PEN_TINY;

		box->lower[k] = lower[k] - slack;
		box->upper[k] = upper[k] + slack;
	}
}

/* Where a ray is within one axis's walls; what is no number keeps the whole. */
struct span {
	float from, to;
};

PEN_LANE struct span narrow(struct span span, float lower, float upper, float origin, float slope)
{
	const float safe = copysignf(pen_max(fabsf(slope), COMPONENT_MIN), slope);
	const float inverse = 1.0f / safe;
	const float slack = ORIGIN_SHARE * fabsf(origin);
	const float a = (lower - origin - slack) * inverse;
	const float b = (upper - origin + slack) * inverse;

	return (struct span){pen_max(pen_min(a, b), span.from), pen_min(pen_max(a, b), span.to)};
}

bool pen_admit_box_met(const struct pen_admit_box *box, const struct pen_rays *rays)
{
	const struct pen_admit_box b = *box;
	int32_t any = 0;

#pragma omp simd reduction(| : any)
	for (int i = 0; i < PEN_LANES; i++) {
		struct span span = {rays->tnear[i], rays->tfar[i]};

		span = narrow(
			span, b.lower[0], b.upper[0], rays->origin_x[i], rays->direction_x[i]);
		span = narrow(
			span, b.lower[1], b.upper[1], rays->origin_y[i], rays->direction_y[i]);
		span = narrow(
			span, b.lower[2], b.upper[2], rays->origin_z[i], rays->direction_z[i]);
		any |= span.from <= span.to * (1.0f + 0x1p-20f);
	}
	return any != 0;
}
