/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_WARP_H
#define PEN_RENDER_WARP_H

#include "core/render/vec.h"

/* Maps of the unit square that carry uniform points (u, v in [0,1)) to points of a known density.
 */

/* An orthonormal right-handed frame: world = x t + y b + z n. */
struct pen_basis {
	struct pen_vec3 t, b, n;
};

/* From a unit normal, without a branch (Duff et al. 2017, "Building an orthonormal basis,
 * revisited"). */
PEN_LANE struct pen_basis pen_basis(struct pen_vec3 n)
{
	const float sign = copysignf(1.0f, n.z);
	const float a = -1.0f / (sign + n.z);
	const float b = n.x * n.y * a;

	return (struct pen_basis){
		.t = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x},
		.b = {b, sign + n.y * n.y * a, -n.y},
		.n = n,
	};
}

PEN_LANE struct pen_vec3 pen_to_world(const struct pen_basis *basis, struct pen_vec3 v)
{
	return pen_madd(pen_madd(pen_scale(basis->t, v.x), v.y, basis->b), v.z, basis->n);
}

PEN_LANE struct pen_vec3 pen_to_local(const struct pen_basis *basis, struct pen_vec3 v)
{
	return pen_vec3(pen_dot(v, basis->t), pen_dot(v, basis->b), pen_dot(v, basis->n));
}

/* The unit disk by area; squares become wedges of bounded stretch (Shirley, Chiu 1997). */
PEN_LANE struct pen_vec2 pen_warp_disk(float u, float v)
{
	const float a = 2.0f * u - 1.0f;
	const float b = 2.0f * v - 1.0f;
	const int wide = fabsf(a) > fabsf(b);
	const float r = wide ? a : b;
	const float other = wide ? b : a;
	/* In eighths of a turn; the summand is lost but where r = 0, and there makes it 0. */
	const float angle = other / (r + 0x1p-60f);
	const struct pen_sincos sc = pen_sincos_turns(0.125f * angle);

	return (struct pen_vec2){
		r * (wide ? sc.cos : sc.sin),
		r * (wide ? sc.sin : sc.cos),
	};
}

/*
 * A regular polygon with its corners on the unit circle, by area. The first corner lies `turns`
 * of a full turn counter-clockwise from +x; u chooses the wedge and is used again within it.
 */
PEN_LANE struct pen_vec2 pen_warp_polygon(uint32_t corners, float turns, float u, float v)
{
	const float n = (float)corners;
	const float wedge = (float)(int32_t)(u * n);
	const float along = sqrtf(u * n - wedge); /* 0 at the centre, 1 at the edge */
	const struct pen_sincos from = pen_sincos_turns(turns + wedge / n);
	const struct pen_sincos to = pen_sincos_turns(turns + (wedge + 1.0f) / n);

	return (struct pen_vec2){
		along * (from.cos + v * (to.cos - from.cos)),
		along * (from.sin + v * (to.sin - from.sin)),
	};
}

/* The hemisphere around +z with density cos / pi (Malley's method). */
PEN_LANE struct pen_vec3 pen_warp_cosine(float u, float v)
{
	const struct pen_vec2 d = pen_warp_disk(u, v);

	return pen_vec3(d.x, d.y, pen_sqrt_clamped(1.0f - d.x * d.x - d.y * d.y));
}

/*
 * Directions within a cone around +z, uniform: density 1 / (2 pi h), where h is one minus the
 * cosine of its half angle, so that narrow cones keep their precision.
 */
PEN_LANE struct pen_vec3 pen_warp_cone(float h, float u, float v)
{
	const struct pen_vec2 d = pen_warp_disk(u, v);
	const float drop = h * (d.x * d.x + d.y * d.y); /* 1 - cos of the direction's angle */
	const float spread = sqrtf(h * (2.0f - drop));

	return pen_vec3(d.x * spread, d.y * spread, 1.0f - drop);
}

#endif
