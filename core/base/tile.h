/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_TILE_H
#define PEN_BASE_TILE_H

#include "core/base/rect.h"

#include <stdbool.h>
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
 * Rounds: which samples of a pixel are rendered together. A function of the request alone, all cut
 * at its sample count:
 *
 * PEN_ROUNDS_UNIFORM:  [0,1) [1,16) [16,32) [32,64) [64,128) [128,256), then 256 at a time
 * PEN_ROUNDS_ADAPTIVE: [0,16) [16,32) [32,48) [48,64) [64,96) [96,128) [128,192) and so on, half
 *                      of a power of two at a time, from 512 on 256
 * PEN_ROUNDS_EDGE:     [0,1) at the pixel's centre, to be discarded where another round follows,
 *                      then [0,16) [16,32) [32,64) and on as uniform
 */
enum pen_rounds_kind { PEN_ROUNDS_UNIFORM, PEN_ROUNDS_ADAPTIVE, PEN_ROUNDS_EDGE };

struct pen_rounds {
	enum pen_rounds_kind kind;
	uint32_t samples; /* of a pixel, at most */
	uint32_t sure;	  /* how many rounds every pixel gets, before anything is decided */
};

/* min_samples counts for adaptive rounds alone: no pixel gets fewer. */
struct pen_rounds pen_rounds_of(enum pen_rounds_kind kind, uint32_t samples, uint32_t min_samples);

struct pen_round {
	uint32_t first, end; /* sample indices, half open */
	bool at_centre;
};

uint32_t pen_round_count(const struct pen_rounds *rounds);
struct pen_round pen_round_get(const struct pen_rounds *rounds, uint32_t index);

/* How many samples a pixel has after so many rounds. */
uint32_t pen_round_samples(const struct pen_rounds *rounds, uint32_t count);

#endif
