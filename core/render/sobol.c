/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/sobol.h"

/* A primitive polynomial over GF(2) and the first direction numbers of a dimension. */
struct direction {
	uint32_t degree, coefficients;
	uint32_t first[3];
};

static const struct direction directions[PEN_SOBOL_DIMENSIONS - 1] = {
	{1, 0, {1, 0, 0}},
	{2, 1, {1, 3, 0}},
	{3, 1, {1, 3, 1}},
	{3, 2, {1, 1, 1}},
};

/* m_k of Joe and Kuo 2008, equation 2, for k from 0. */
static void direction_numbers(const struct direction *direction, uint32_t ret_m[PEN_SOBOL_BITS])
{
	const uint32_t degree = direction->degree;

	for (uint32_t k = 0; k < PEN_SOBOL_BITS; k++) {
		if (k < degree) {
			ret_m[k] = direction->first[k];
			continue;
		}
		ret_m[k] = ret_m[k - degree] ^ ret_m[k - degree] << degree;
		for (uint32_t j = 1; j < degree; j++)
			if ((direction->coefficients >> (degree - 1 - j) & 1u) != 0)
				ret_m[k] ^= ret_m[k - j] << j;
	}
}

void pen_sobol_init(struct pen_sobol *sobol)
{
	for (uint32_t k = 0; k < PEN_SOBOL_BITS; k++)
		sobol->columns[0][k] = 1u << k;
	for (uint32_t d = 1; d < PEN_SOBOL_DIMENSIONS; d++) {
		uint32_t m[PEN_SOBOL_BITS];

		direction_numbers(&directions[d - 1], m);
		for (uint32_t k = 0; k < PEN_SOBOL_BITS; k++)
			sobol->columns[d][k] = pen_reverse_bits(m[k] << (31 - k));
	}
	for (uint32_t d = 0; d < PEN_SOBOL_DIMENSIONS; d++)
		for (uint32_t index = 0; index < 16; index++)
			sobol->sixteen[d][index] = pen_sobol_reversed(sobol, d, index);
}
