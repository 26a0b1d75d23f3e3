/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SOLID_ANGLE_H
#define PEN_RENDER_SOLID_ANGLE_H

#include "core/render/vec.h"

/*
 * Rectangles and triangles as seen from a point: how much of the sphere they fill, and points of
 * them that are uniform on the sphere.
 */

/*
 * The solid angle of a triangle (Van Oosterom, Strackee 1983) from its volume with the eye and the
 * vectors to its corners. Accurate however small.
 */
PEN_LANE float pen_triangle_solid_angle(
	float volume, struct pen_vec3 a, struct pen_vec3 b, struct pen_vec3 c)
{
	const float la = pen_length(a);
	const float lb = pen_length(b);
	const float lc = pen_length(c);
	const float cosines =
		la * lb * lc + pen_dot(a, b) * lc + pen_dot(b, c) * la + pen_dot(c, a) * lb;

	return 2.0f * pen_angle(volume, cosines);
}

/* A rectangle in a frame of its edges and its normal, with the eye at the origin. */
struct pen_window {
	float x0, x1, y0, y1, z;
};

PEN_LANE float pen_window_solid_angle(struct pen_window w)
{
	const struct pen_vec3 a = {w.x0, w.y0, w.z};
	const struct pen_vec3 b = {w.x1, w.y0, w.z};
	const struct pen_vec3 c = {w.x1, w.y1, w.z};
	const struct pen_vec3 d = {w.x0, w.y1, w.z};
	const float volume = fabsf(w.z) * (w.x1 - w.x0) * (w.y1 - w.y0);

	return pen_triangle_solid_angle(volume, a, b, c) +
	       pen_triangle_solid_angle(volume, a, c, d);
}

/*
 * A point (x, y) of the window, uniform by solid angle (Urena et al. 2013, "An area-preserving
 * parametrization for spherical rectangles"), with arc sines: the strip of the window left of x
 * fills asin(c b1) - asin(c b0) more than that left of 0, where c, b0 and b1 are the sines under
 * which x, y0 and y1 are seen. Loses digits in proportion to 1 / solid_angle.
 */
PEN_LANE struct pen_vec2 pen_window_sample(struct pen_window w, float solid_angle, float u, float v)
{
	const float z2 = w.z * w.z + PEN_TINY;
	const float b0 = w.y0 / sqrtf(w.y0 * w.y0 + z2);
	const float b1 = w.y1 / sqrtf(w.y1 * w.y1 + z2);
	const float c0 = w.x0 / sqrtf(w.x0 * w.x0 + z2);
	const float strip = pen_asin(c0 * b1) - pen_asin(c0 * b0) + u * solid_angle;
	/* sin(strip) = c |b1 - b0 exp(i strip)|, by the half angle; x is z c / sqrt(1 - c^2). */
	const struct pen_sincos half = pen_sincos_turns(strip * (0.25f * PEN_INV_PI));
	const float sine = 2.0f * half.sin * half.cos;
	const float chord2 = (b1 - b0) * (b1 - b0) + 4.0f * b0 * b1 * half.sin * half.sin;
	const float reach = sqrtf(z2 / pen_max(chord2 - sine * sine, PEN_TINY));
	const float x = pen_clamp(sine * reach, w.x0, w.x1);
	/* Along the chosen column the sine of the elevation is uniform. */
	const float d2 = x * x + z2;
	const float h0 = w.y0 / sqrtf(w.y0 * w.y0 + d2);
	const float h1 = w.y1 / sqrtf(w.y1 * w.y1 + d2);
	const float h = h0 + v * (h1 - h0);
	const float y = h * sqrtf(d2 / pen_max(1.0f - h * h, PEN_TINY));

	return (struct pen_vec2){x, pen_clamp(y, w.y0, w.y1)};
}

/* A triangle by the directions of its corners, and what follows from them. */
struct pen_corners {
	struct pen_vec3 a, b, c; /* unit */
	float volume;		 /* of their parallelepiped */
	float ab, rest;		 /* 1 + a.b, and b.c + c.a */
	float solid_angle;
};

/* From the vectors to the corners and the volume of their parallelepiped. */
PEN_LANE struct pen_corners pen_corners(
	struct pen_vec3 a, struct pen_vec3 b, struct pen_vec3 c, float volume)
{
	const float inv_a = 1.0f / pen_max(pen_length(a), PEN_TINY);
	const float inv_b = 1.0f / pen_max(pen_length(b), PEN_TINY);
	const float inv_c = 1.0f / pen_max(pen_length(c), PEN_TINY);
	struct pen_corners corners = {
		.a = pen_scale(a, inv_a),
		.b = pen_scale(b, inv_b),
		.c = pen_scale(c, inv_c),
		.volume = volume * inv_a * inv_b * inv_c,
	};

	corners.ab = 1.0f + pen_dot(corners.a, corners.b);
	corners.rest = pen_dot(corners.b, corners.c) + pen_dot(corners.c, corners.a);
	corners.solid_angle = 2.0f * pen_angle(corners.volume, corners.ab + corners.rest);
	return corners;
}

/*
 * A unit direction, uniform by solid angle (Arvo 1995, "Stratified sampling of spherical
 * triangles"): u chooses a point d on the side from a to c such that the triangle a b d has the
 * share u of the solid angle, v a point between b and d. d = (1 - r^2, 2 r (1 + r a.c)) /
 * (1 + 2 r a.c + r^2) in terms of a and c, where r = p / q follows from the tangent of half the
 * share's angle.
 */
PEN_LANE struct pen_vec3 pen_corners_sample(const struct pen_corners *corners, float u, float v)
{
	const float ac = pen_dot(corners->a, corners->c);
	const struct pen_sincos half =
		pen_sincos_turns(u * corners->solid_angle * (0.25f * PEN_INV_PI));
	const float p = half.sin * corners->ab;
	const float q = half.cos * corners->volume - half.sin * corners->rest;
	const float scale = 1.0f / (q * q + 2.0f * p * q * ac + p * p);
	const struct pen_vec3 d = pen_madd(pen_scale(corners->a, (q * q - p * p) * scale),
		2.0f * p * (q + p * ac) * scale, corners->c);
	const struct pen_vec3 gap = pen_sub(d, corners->b);
	const float drop = 0.5f * pen_dot(gap, gap); /* 1 - b.d, exact for small triangles */
	const struct pen_vec3 side = pen_madd(d, drop - 1.0f, corners->b);
	const float spread = sqrtf(v * (2.0f - v * drop) / pen_max(2.0f - drop, 1e-6f));

	return pen_normalize(pen_madd(pen_scale(corners->b, 1.0f - v * drop), spread, side));
}

#endif
