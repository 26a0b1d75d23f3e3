/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_VEC_H
#define PEN_RENDER_VEC_H

#include <math.h>
#include <stdint.h>

/*
 * Vectors, and the few transcendental functions of the renderer. All of it is inlined into loops
 * over lanes and vectorises: selects instead of branches, no call of libm. Polynomials are
 * minimax fits; the errors given are absolute unless they say relative, and tests hold them.
 */

/* A function of one lane: it must vanish in the loop, or that does not vectorise. */
#define PEN_LANE static inline __attribute__((always_inline))

#define PEN_PI	   3.14159265f
#define PEN_INV_PI 0.318309886f

/* Keeps denominators away from 0. */
#define PEN_TINY 1e-30f

struct pen_vec2 {
	float x, y;
};

struct pen_vec3 {
	float x, y, z;
};

PEN_LANE struct pen_vec3 pen_vec3(float x, float y, float z)
{
	return (struct pen_vec3){x, y, z};
}

PEN_LANE struct pen_vec3 pen_vec3_load(const double v[3])
{
	return pen_vec3((float)v[0], (float)v[1], (float)v[2]);
}

PEN_LANE struct pen_vec3 pen_add(struct pen_vec3 a, struct pen_vec3 b)
{
	return pen_vec3(a.x + b.x, a.y + b.y, a.z + b.z);
}

PEN_LANE struct pen_vec3 pen_sub(struct pen_vec3 a, struct pen_vec3 b)
{
	return pen_vec3(a.x - b.x, a.y - b.y, a.z - b.z);
}

PEN_LANE struct pen_vec3 pen_scale(struct pen_vec3 a, float s)
{
	return pen_vec3(a.x * s, a.y * s, a.z * s);
}

/* a + s * b */
PEN_LANE struct pen_vec3 pen_madd(struct pen_vec3 a, float s, struct pen_vec3 b)
{
	return pen_vec3(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}

PEN_LANE float pen_dot(struct pen_vec3 a, struct pen_vec3 b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

PEN_LANE struct pen_vec3 pen_cross(struct pen_vec3 a, struct pen_vec3 b)
{
	return pen_vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

PEN_LANE float pen_length(struct pen_vec3 a)
{
	return sqrtf(pen_dot(a, a));
}

/* The zero vector gives infinities. */
PEN_LANE struct pen_vec3 pen_normalize(struct pen_vec3 a)
{
	return pen_scale(a, 1.0f / pen_length(a));
}

PEN_LANE struct pen_vec3 pen_neg(struct pen_vec3 a)
{
	return pen_vec3(-a.x, -a.y, -a.z);
}

/* Unlike fminf these are one instruction: b where either is a NaN. */
PEN_LANE float pen_min(float a, float b)
{
	return a < b ? a : b;
}

PEN_LANE float pen_max(float a, float b)
{
	return a > b ? a : b;
}

PEN_LANE float pen_clamp(float x, float low, float high)
{
	return pen_min(pen_max(x, low), high);
}

/*
 * a where wanted is 1, b where it is 0, by their bits. Where b is what the result overwrites, a
 * conditional becomes a masked store, for which some processors take ten times as long.
 */
PEN_LANE float pen_pick(int wanted, float a, float b)
{
	const union {
		float f;
		uint32_t bits;
	} x = {a}, y = {b};
	const uint32_t mask = 0u - (uint32_t)wanted;
	const union {
		uint32_t bits;
		float f;
	} picked = {(x.bits & mask) | (y.bits & ~mask)};

	return picked.f;
}

PEN_LANE uint32_t pen_pick_bits(int wanted, uint32_t a, uint32_t b)
{
	const uint32_t mask = 0u - (uint32_t)wanted;

	return (a & mask) | (b & ~mask);
}

/* For values that rounding may have brought below 0. */
PEN_LANE float pen_sqrt_clamped(float x)
{
	return sqrtf(pen_max(x, 0.0f));
}

struct pen_sincos {
	float sin, cos;
};

/* sin and cos of 2 pi u, |u| < 2^20: error 1.2e-7. */
PEN_LANE struct pen_sincos pen_sincos_turns(float u)
{
	const int32_t quarter = (int32_t)floorf(u * 4.0f + 0.5f);
	const float r = u - (float)quarter * 0.25f; /* exact, |r| <= 1/8 */
	const float t = r * r;
	const float s =
		r * (6.28318525f + t * (-41.34163913f + t * (81.58940461f + t * -75.28394801f)));
	const float c =
		1.0f +
		t * (-19.73920865f + t * (64.93931621f + t * (-85.44285215f + t * 59.22040785f)));
	const float sine = (quarter & 1) != 0 ? c : s;
	const float cosine = (quarter & 1) != 0 ? s : c;

	return (struct pen_sincos){
		.sin = sine * (float)(1 - (quarter & 2)),
		.cos = cosine * (float)(1 - ((quarter + 1) & 2)),
	};
}

/* Arc sine, radians; x is clamped to [-1, 1]: error 3e-7. */
PEN_LANE float pen_asin(float x)
{
	const float a = pen_min(fabsf(x), 1.0f);
	const float t = a > 0.5f ? 0.5f - 0.5f * a : a * a;
	const float s = a > 0.5f ? sqrtf(t) : a;
	const float p = 0.166668f +
			t * (0.0749368f + t * (0.04564899f + t * (0.02338216f + t * 0.04341288f)));
	const float half = s + s * t * p;

	return copysignf(a > 0.5f ? 0.5f * PEN_PI - 2.0f * half : half, x);
}

/* The angle of (x, y) for y >= 0, in [0, pi]: relative error 4e-7; 0 for (0, 0). */
PEN_LANE float pen_angle(float y, float x)
{
	const float a = fabsf(x);
	const float high = pen_max(pen_max(a, y), 1e-37f);
	const float q = pen_min(a, y) / high;
	const float t = q * q;
	float p = 0.0029823f;

	p = p * t - 0.01661292f;
	p = p * t + 0.04360686f;
	p = p * t - 0.07585273f;
	p = p * t + 0.10681249f;
	p = p * t - 0.14214831f;
	p = p * t + 0.1999422f;
	p = p * t - 0.33333171f;

	const float octant = q + q * t * p;
	const float quarter = y > a ? 0.5f * PEN_PI - octant : octant;

	return x < 0.0f ? PEN_PI - quarter : quarter;
}

#endif
