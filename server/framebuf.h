/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_FRAMEBUF_H
#define PEN_SERVER_FRAMEBUF_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "core/base/tile.h"

#include <stddef.h>
#include <stdint.h>

/*
 * The framebuffer of one frame is one file: tile after tile in the order of the tiling, each in a
 * slot of tile_px * tile_px * PEN_CHANNELS little-endian floats, of which the first
 * width * height * PEN_CHANNELS of the tile's own rectangle are used, row by row: the sums of R,
 * G, B and the sample count of each pixel. A pixel whose count is 0 is not rendered yet.
 */
static inline size_t pen_framebuf_slot_bytes(uint32_t tile_px)
{
	return (size_t)tile_px * tile_px * PEN_CHANNELS * sizeof(float);
}

static inline size_t pen_framebuf_tile_bytes(struct pen_rect rect)
{
	return (size_t)pen_rect_area(rect) * PEN_CHANNELS * sizeof(float);
}

/* Creates the file with all its space allocated (PEN_ENOSPACE), reading as zeros. */
int pen_framebuf_create(const char *path, const struct pen_tiling *tiling, struct pen_error *err);

/*
 * Adds a round's sums to tile index of the file fd and tells the xxh3 of the tile's bytes
 * afterwards. first = true for round 0, which overwrites. May block on disk: for the thread pool.
 */
int pen_framebuf_merge(int fd, const struct pen_tiling *tiling, uint32_t index, int first,
	const float *pixels, uint64_t *ret_xxh3, struct pen_error *err);

/* The xxh3 of a tile's bytes in the file. */
int pen_framebuf_hash(int fd, const struct pen_tiling *tiling, uint32_t index, uint64_t *ret_xxh3,
	struct pen_error *err);

#endif
