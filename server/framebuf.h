/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_FRAMEBUF_H
#define PEN_SERVER_FRAMEBUF_H

#include "core/base/error.h"
#include "core/base/film.h"
#include "core/base/tile.h"

#include <stddef.h>
#include <stdint.h>

/*
 * The framebuffer of one frame is one file: tile after tile in the order of the tiling, each in a
 * slot of tile_px * tile_px pixels of its film's channels, little-endian floats (core/base/film.h),
 * of which the first width * height of the tile's own rectangle are used, row by row. A pixel whose
 * count is 0 is not rendered yet.
 */
struct pen_framebuf {
	struct pen_tiling tiling;
	struct pen_film film;
};

static inline size_t pen_framebuf_slot_bytes(const struct pen_framebuf *framebuf)
{
	return (size_t)framebuf->tiling.tile_px * framebuf->tiling.tile_px *
	       framebuf->film.channels * sizeof(float);
}

static inline size_t pen_framebuf_tile_bytes(const struct pen_framebuf *framebuf, uint32_t index)
{
	return (size_t)pen_rect_area(pen_tiling_rect(&framebuf->tiling, index)) *
	       framebuf->film.channels * sizeof(float);
}

/* Creates the file with all its space allocated (PEN_ENOSPACE), reading as zeros. */
int pen_framebuf_create(
	const char *path, const struct pen_framebuf *framebuf, struct pen_error *err);

/*
 * Adds a round's sums to tile index of the file fd and tells the xxh3 of the tile's bytes
 * afterwards. first = true for round 0, which overwrites. May block on disk: for the thread pool.
 */
int pen_framebuf_merge(int fd, const struct pen_framebuf *framebuf, uint32_t index, int first,
	const float *pixels, uint64_t *ret_xxh3, struct pen_error *err);

/* The xxh3 of a tile's bytes in the file. */
int pen_framebuf_hash(int fd, const struct pen_framebuf *framebuf, uint32_t index,
	uint64_t *ret_xxh3, struct pen_error *err);

#endif
