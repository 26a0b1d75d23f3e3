/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/film.h"

#include <string.h>

#define INFINITE_BITS 0x7f800000u /* and above, without the sign: infinite or not a number */

/* Branches and floating point would keep it from being done many at a time. */
bool pen_film_is_finite(const float *values, size_t count)
{
	uint32_t not_finite = 0;

	for (size_t i = 0; i < count; i++) {
		uint32_t bits;

		memcpy(&bits, values + i, sizeof bits);
		not_finite |= (bits & INFINITE_BITS) == INFINITE_BITS;
	}
	return !not_finite;
}

void pen_film_add(const float *restrict values, size_t count, float *restrict sums)
{
	for (size_t i = 0; i < count; i++)
		sums[i] += values[i];
}
