/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/sphere.h"

#include "core/render/vec.h"

#include <assert.h>
#include <math.h>

/* Rows of a ray packet, as in struct pen_rays. */
enum { ORIGIN_X, ORIGIN_Y, ORIGIN_Z, TNEAR, DIRECTION_X, DIRECTION_Y, DIRECTION_Z, TIME };

/*
 * The stable form of the quadratic: the discriminant from the distance between ray and centre, the
 * smaller root from the larger one (Haines et al. 2019, "Precision improvements for ray/sphere
 * intersection", Ray Tracing Gems, chapter 7).
 */
static inline float distance_of(
	struct pen_sphere sphere, struct pen_vec3 origin, struct pen_vec3 direction, float tnear)
{
	const struct pen_vec3 f = {origin.x - sphere.x, origin.y - sphere.y, origin.z - sphere.z};
	const float inv_a = 1.0f / pen_dot(direction, direction);
	const float middle = -pen_dot(f, direction) * inv_a;
	const struct pen_vec3 closest = pen_madd(f, middle, direction);
	const float radius2 = sphere.radius * sphere.radius;
	const float gap2 = radius2 - pen_dot(closest, closest);
	const float half = pen_sqrt_clamped(gap2 * inv_a);
	const float far_root = middle + copysignf(half, middle);
	const float near_root = (pen_dot(f, f) - radius2) * inv_a / far_root;
	const float first = pen_min(near_root, far_root);
	const float second = pen_max(near_root, far_root);
	const float distance = first >= tnear ? first : second;

	return gap2 >= 0.0f && distance >= tnear ? distance : INFINITY;
}

static inline __attribute__((always_inline)) void distances(const struct pen_spheres *spheres,
	uint32_t primitive, const float *rays, uint32_t n, float *ret_distances)
{
#pragma omp simd
	for (uint32_t i = 0; i < n; i++)
		ret_distances[i] =
			distance_of(pen_sphere_at(spheres, (int32_t)primitive, rays[TIME * n + i]),
				pen_vec3(rays[ORIGIN_X * n + i], rays[ORIGIN_Y * n + i],
					rays[ORIGIN_Z * n + i]),
				pen_vec3(rays[DIRECTION_X * n + i], rays[DIRECTION_Y * n + i],
					rays[DIRECTION_Z * n + i]),
				rays[TNEAR * n + i]);
}

void pen_sphere_distances(const struct pen_spheres *spheres, uint32_t primitive, const float *rays,
	uint32_t n, float *ret_distances)
{
	assert(n == 1 || n == 4 || n == 8 || n == 16);
	switch (n) {
	case 4: distances(spheres, primitive, rays, 4, ret_distances); break;
	case 8: distances(spheres, primitive, rays, 8, ret_distances); break;
	case 16: distances(spheres, primitive, rays, 16, ret_distances); break;
	default: distances(spheres, primitive, rays, 1, ret_distances); break;
	}
}
