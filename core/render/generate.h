/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_GENERATE_H
#define PEN_RENDER_GENERATE_H

#include "core/render/path.h"

/*
 * Camera packets of canonical composition. Their sixteen lanes are always traced; key, index,
 * throughput and ray are set, the slots are left to the caller.
 */

/* Samples [first, first + 16) of pixel (x, y); first is a multiple of 16. */
void pen_generate_block(
	const struct pen_pass *pass, uint32_t x, uint32_t y, uint32_t first, struct pen_paths *ret);

/* Sample index of the 4x4 pixels from (x, y) on, which are multiples of 4, row by row. */
void pen_generate_grid(
	const struct pen_pass *pass, uint32_t x, uint32_t y, uint32_t index, struct pen_paths *ret);

#endif
