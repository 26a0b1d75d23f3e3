/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_MASK_H
#define PEN_BASE_MASK_H

#include "core/base/rect.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * Some of a tile's pixels: a bit for each, row by row of its rectangle, the lowest bit of a byte
 * first; what is left of the last byte is 0.
 */
static inline size_t pen_mask_bytes(struct pen_rect rect)
{
	return (size_t)(pen_rect_area(rect) + 7) / 8;
}

/* Whether pixel i of the rectangle is one of them. */
static inline bool pen_mask_has(const uint8_t *mask, size_t i)
{
	return (mask[i / 8] >> i % 8 & 1) != 0;
}

static inline void pen_mask_add(uint8_t *mask, size_t i)
{
	mask[i / 8] = (uint8_t)(mask[i / 8] | 1u << i % 8);
}

/* How many they are. */
static inline uint32_t pen_mask_count(const uint8_t *mask, struct pen_rect rect)
{
	uint32_t count = 0;

	for (size_t i = 0; i < pen_mask_bytes(rect); i++)
		count += (uint32_t)__builtin_popcount(mask[i]);
	return count;
}

#endif
