/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_TILE_H
#define PEN_BASE_TILE_H

#include "core/base/rect.h"

#include <stdint.h>

/*
 * The tiles of an image: cells of an absolute grid of tile_px (a multiple of 16) that meet the
 * crop, clipped to it, numbered row by row from 0. The grid starts at pixel (0, 0) of the full
 * image, so that 4x4 pixel blocks never straddle two tiles.
 */
struct pen_tiling {
	struct pen_rect crop;
	uint32_t tile_px;
	uint32_t columns, rows; /* of tiles */
	uint32_t count;
};

/* crop must be valid, tile_px a multiple of 16 and at most PEN_TILE_SIDE_MAX (asserted). */
void pen_tiling_init(struct pen_tiling *tiling, struct pen_rect crop, uint32_t tile_px);

/* Tile index (< count) in pixels of the full image. */
struct pen_rect pen_tiling_rect(const struct pen_tiling *tiling, uint32_t index);

/*
 * Rounds: which samples of a pixel are rendered together. A function of the request's sample count
 * alone: [0,1) [1,16) [16,32) [32,64) [64,128) [128,256) and then 256 at a time, cut at samples.
 */
struct pen_round {
	uint32_t first, end; /* sample indices, half open */
};

uint32_t pen_round_count(uint32_t samples);
struct pen_round pen_round_get(uint32_t samples, uint32_t index);

#endif
