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
	/* How it is sampled; behind the tiles lies a quota unless that is uniform. */
	struct pen_rounds rounds;
	double threshold;	  /* edge */
	double error, confidence; /* adaptive */
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

/* Creates a file of size bytes with all its space allocated (PEN_ENOSPACE), reading as zeros. */
int pen_framebuf_create(const char *path, uint64_t size, struct pen_error *err);

static inline uint64_t pen_framebuf_bytes(const struct pen_framebuf *framebuf)
{
	return (uint64_t)framebuf->tiling.count * pen_framebuf_slot_bytes(framebuf);
}

/* What is in a tile: the xxh3 of its bytes, and how many samples over all its pixels. */
struct pen_framebuf_tile {
	uint64_t xxh3, samples;
};

/*
 * Adds a round's sums to tile index of the file fd and tells what is in it afterwards. Round 0
 * overwrites; where round 1 of edge sampling has samples, they take the place of the first one. May
 * block on disk: for the thread pool.
 */
int pen_framebuf_merge(int fd, const struct pen_framebuf *framebuf, uint32_t index, uint32_t round,
	const float *pixels, struct pen_framebuf_tile *ret_tile, struct pen_error *err);

/* What is in a tile of the file. */
int pen_framebuf_look(int fd, const struct pen_framebuf *framebuf, uint32_t index,
	struct pen_framebuf_tile *ret_tile, struct pen_error *err);

/* The file as rows of the crop; one row of tiles is held at a time. */
struct pen_framebuf_rows {
	int fd;
	const struct pen_framebuf *framebuf; /* borrowed */
	uint32_t tile_row;		     /* which is held; tiling.rows: none yet */
	float *tiles;			     /* its slots, as in the file */
};

int pen_framebuf_rows_init(struct pen_framebuf_rows *rows, int fd,
	const struct pen_framebuf *framebuf, struct pen_error *err);
void pen_framebuf_rows_finish(struct pen_framebuf_rows *rows);

/* The film of row y, counted from the crop's first, pixel by pixel. */
int pen_framebuf_row(
	struct pen_framebuf_rows *rows, uint32_t y, float *ret_film, struct pen_error *err);

#endif
