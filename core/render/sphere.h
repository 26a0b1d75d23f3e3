/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SPHERE_H
#define PEN_RENDER_SPHERE_H

#include "core/render/geometry.h"
#include "core/render/vec.h"

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

/* How the line of a ray passes a sphere. */
struct pen_passage {
	struct pen_vec3 from; /* the origin, seen from the centre */
	float inv_a;	      /* 1 / direction^2 */
	float middle;	      /* where it comes closest */
	float gap2;	      /* radius^2 less the square of that distance; negative: a miss */
};

/* inv_a: 1 / direction^2. */
PEN_LANE struct pen_passage pen_sphere_passage_by(
	struct pen_sphere sphere, struct pen_vec3 origin, struct pen_vec3 direction, float inv_a)
{
	const struct pen_vec3 from = {
		origin.x - sphere.x, origin.y - sphere.y, origin.z - sphere.z};
	const float middle = -pen_dot(from, direction) * inv_a;
	const struct pen_vec3 closest = pen_madd(from, middle, direction);

	return (struct pen_passage){
		from, inv_a, middle, sphere.radius * sphere.radius - pen_dot(closest, closest)};
}

PEN_LANE struct pen_passage pen_sphere_passage(
	struct pen_sphere sphere, struct pen_vec3 origin, struct pen_vec3 direction)
{
	return pen_sphere_passage_by(
		sphere, origin, direction, 1.0f / pen_dot(direction, direction));
}

/*
 * Where the ray first meets the sphere after tnear; INFINITY where it doesn't. The stable form of
 * the quadratic: the discriminant from the distance between ray and centre, the smaller root from
 * the larger one (Haines et al. 2019, "Precision improvements for ray/sphere intersection", Ray
 * Tracing Gems, chapter 7). outside2: from^2 less radius^2.
 */
PEN_LANE float pen_sphere_root(float gap2, float middle, float outside2, float inv_a, float tnear)
{
	const float half = pen_sqrt_clamped(gap2 * inv_a);
	const float far_root = middle + copysignf(half, middle);
	const float near_root = outside2 * inv_a / far_root;
	const float first = pen_min(near_root, far_root);
	const float second = pen_max(near_root, far_root);
	const float distance = first >= tnear ? first : second;

	return gap2 >= 0.0f && distance >= tnear ? distance : INFINITY;
}

PEN_LANE float pen_sphere_distance(
	struct pen_sphere sphere, struct pen_vec3 origin, struct pen_vec3 direction, float tnear)
{
	const struct pen_passage p = pen_sphere_passage(sphere, origin, direction);
	const float outside2 = pen_dot(p.from, p.from) - sphere.radius * sphere.radius;

	return pen_sphere_root(p.gap2, p.middle, outside2, p.inv_a, tnear);
}

/*
 * Distances at which n rays (1, 4, 8 or 16) first meet a sphere after their tnear; INFINITY where
 * they don't. The rays are rows of n floats in the order of struct pen_rays. Each lane's result
 * is its own. Called by way of Embree, for which its own spheres would cost four times as much.
 */
void pen_sphere_distances(const struct pen_spheres *spheres, uint32_t primitive, const float *rays,
	uint32_t n, float *ret_distances);

#endif
