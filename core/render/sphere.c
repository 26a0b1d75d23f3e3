/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/sphere.h"

#include <assert.h>
#include <stdbool.h>

/* Rows of a ray packet, as in struct pen_rays. */
enum { ORIGIN_X, ORIGIN_Y, ORIGIN_Z, TNEAR, DIRECTION_X, DIRECTION_Y, DIRECTION_Z, TIME };

/* Of a sphere between two of its steps: the only ones, or both the same for one at rest. */
PEN_LANE void straight_distances(struct pen_sphere a, struct pen_sphere b, bool is_still,
	const float *restrict rays, uint32_t n, float *restrict ret_distances)
{
#pragma omp simd
	for (uint32_t i = 0; i < n; i++) {
		const float t = rays[TIME * n + i];
		const struct pen_sphere at = {
			is_still ? a.x : a.x + t * (b.x - a.x),
			is_still ? a.y : a.y + t * (b.y - a.y),
			is_still ? a.z : a.z + t * (b.z - a.z),
			is_still ? a.radius : a.radius + t * (b.radius - a.radius),
		};

		ret_distances[i] = pen_sphere_distance(at,
			pen_vec3(rays[ORIGIN_X * n + i], rays[ORIGIN_Y * n + i],
				rays[ORIGIN_Z * n + i]),
			pen_vec3(rays[DIRECTION_X * n + i], rays[DIRECTION_Y * n + i],
				rays[DIRECTION_Z * n + i]),
			rays[TNEAR * n + i]);
	}
}

PEN_LANE void curved_distances(const struct pen_spheres *spheres, uint32_t primitive,
	const float *rays, uint32_t n, float *ret_distances)
{
	for (uint32_t i = 0; i < n; i++)
		ret_distances[i] = pen_sphere_distance(
			pen_sphere_at(spheres, (int32_t)primitive, rays[TIME * n + i]),
			pen_vec3(rays[ORIGIN_X * n + i], rays[ORIGIN_Y * n + i],
				rays[ORIGIN_Z * n + i]),
			pen_vec3(rays[DIRECTION_X * n + i], rays[DIRECTION_Y * n + i],
				rays[DIRECTION_Z * n + i]),
			rays[TNEAR * n + i]);
}

PEN_LANE void distances(const struct pen_spheres *spheres, uint32_t primitive, const float *rays,
	uint32_t n, float *ret_distances)
{
	const struct pen_sphere *a = &spheres->first[primitive];

	if (spheres->step_count == 1)
		straight_distances(*a, *a, true, rays, n, ret_distances);
	else if (spheres->step_count == 2)
		straight_distances(*a, a[spheres->stride], false, rays, n, ret_distances);
	else
		curved_distances(spheres, primitive, rays, n, ret_distances);
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
