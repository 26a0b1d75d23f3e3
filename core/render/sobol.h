/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SOBOL_H
#define PEN_RENDER_SOBOL_H

#include <stdint.h>

/*
 * Hash-based Owen scrambling of Sobol points (Burley 2020, "Practical hash-based Owen scrambling",
 * JCGT 9(4)): any dimension of any sample at any time, with no state.
 *
 * Digits are kept reversed, the first binary digit of the value in bit 0: scrambling then is a
 * hash whose information flows from low bits to high bits only, and the first dimension (van der
 * Corput) of a sample is its index as it stands. Values are turned round once, at the end.
 */

/* A bijection of 32 bits without visible bias (the "lowbias32" constants of Wellons 2018). */
static inline uint32_t pen_hash(uint32_t x)
{
	x ^= x >> 16;
	x *= 0x7feb352du;
	x ^= x >> 15;
	x *= 0x846ca68bu;
	return x ^ x >> 16;
}

static inline uint32_t pen_reverse_bits(uint32_t x)
{
	x = __builtin_bswap32(x);
	x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
	x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
	return (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
}

/* The leading 24 bits as a float in [0, 1), never 1. */
static inline float pen_unit_float(uint32_t bits)
{
	return (float)(int32_t)(bits >> 8) * 0x1p-24f;
}

#define PEN_UNIT_MAX 0x1.fffffep-1f /* the largest value of pen_unit_float */

/*
 * Nested uniform scrambling of reversed digits: each is flipped or not by a hash of the digits
 * before it (Laine, Karras 2011, in the form and with the constants of Vegdahl 2021). seed must
 * come from pen_hash.
 */
static inline uint32_t pen_owen_scramble(uint32_t reversed, uint32_t seed)
{
	uint32_t x = reversed;

	x ^= x * 0x3d20adeau;
	x += seed;
	x *= seed >> 16 | 1u;
	x ^= x * 0x05526c56u;
	x ^= x * 0x53a22864u;
	return x;
}

/* The second Sobol dimension of an index, reversed: its digits times Pascal's triangle mod 2. */
static inline uint32_t pen_sobol_second(uint32_t index)
{
	uint32_t x = index;

	x ^= x >> 1 & 0x55555555u;
	x ^= x >> 2 & 0x33333333u;
	x ^= x >> 4 & 0x0f0f0f0fu;
	x ^= x >> 8 & 0x00ff00ffu;
	return x ^ x >> 16;
}

enum { PEN_SOBOL_DIMENSIONS = 5, PEN_SOBOL_BITS = 16 };

/* Generator columns of dimensions 0 to 4, reversed: that of index bit k is columns[d][k]. */
struct pen_sobol {
	uint32_t columns[PEN_SOBOL_DIMENSIONS][PEN_SOBOL_BITS];
	uint32_t sixteen[PEN_SOBOL_DIMENSIONS][16]; /* the points of indices 0 to 15 */
};

/* The first five dimensions by Joe and Kuo's direction numbers ("new-joe-kuo-6", 2008). */
void pen_sobol_init(struct pen_sobol *sobol);

/* Dimension d of the index, below 2^PEN_SOBOL_BITS, reversed and not scrambled. */
static inline uint32_t pen_sobol_reversed(const struct pen_sobol *sobol, uint32_t d, uint32_t index)
{
	uint32_t x = 0;

	for (uint32_t rest = index; rest != 0; rest &= rest - 1)
		x ^= sobol->columns[d][__builtin_ctz(rest)];
	return x;
}

#endif
