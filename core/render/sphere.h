/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SPHERE_H
#define PEN_RENDER_SPHERE_H

#include "core/render/geometry.h"

#include <stdint.h>

/* A model of spheres: those of step s begin at first + s * stride. */
struct pen_spheres {
	const struct pen_sphere *first;
	uint32_t stride, step_count;
};

/* Where a time falls among equidistant steps: between the step returned and the next. */
static inline int32_t pen_step_of(float time, uint32_t step_count, float *ret_rest)
{
	const int32_t last = (int32_t)step_count - 2;
	const float x = time * (float)(last + 1);
	const int32_t step = (int32_t)x;
	const int32_t clamped = step < last ? step : last;

	*ret_rest = x - (float)clamped;
	return clamped;
}

/* One of them at a time, the fraction of the shutter. */
static inline struct pen_sphere pen_sphere_at(
	const struct pen_spheres *spheres, int32_t primitive, float time)
{
	const struct pen_sphere *a = &spheres->first[primitive], *b;
	float rest;

	if (spheres->step_count == 1)
		return *a;
	a += pen_step_of(time, spheres->step_count, &rest) * (int32_t)spheres->stride;
	b = a + spheres->stride;
	return (struct pen_sphere){
		.x = a->x + rest * (b->x - a->x),
		.y = a->y + rest * (b->y - a->y),
		.z = a->z + rest * (b->z - a->z),
		.radius = a->radius + rest * (b->radius - a->radius),
	};
}

/*
 * Distances at which n rays (1, 4, 8 or 16) first meet a sphere after their tnear; INFINITY where
 * they don't. The rays are rows of n floats in the order of struct pen_rays. Each lane's result
 * is its own. Called by way of Embree, for which its own spheres would cost four times as much.
 */
void pen_sphere_distances(const struct pen_spheres *spheres, uint32_t primitive, const float *rays,
	uint32_t n, float *ret_distances);

#endif
