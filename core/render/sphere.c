/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/sphere.h"

#include <assert.h>

/* Rows of a ray packet, as in struct pen_rays. */
enum { ORIGIN_X, ORIGIN_Y, ORIGIN_Z, TNEAR, DIRECTION_X, DIRECTION_Y, DIRECTION_Z, TIME };

static inline __attribute__((always_inline)) void distances(const struct pen_spheres *spheres,
	uint32_t primitive, const float *rays, uint32_t n, float *ret_distances)
{
#pragma omp simd
	for (uint32_t i = 0; i < n; i++)
		ret_distances[i] = pen_sphere_distance(
			pen_sphere_at(spheres, (int32_t)primitive, rays[TIME * n + i]),
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
