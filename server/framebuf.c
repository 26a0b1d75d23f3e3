/* SPDX-License-Identifier: Apache-2.0 */
#include "server/framebuf.h"

#include "core/base/digest.h"
#include "core/base/film.h"
#include "server/disk.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int pen_framebuf_create(const char *path, uint64_t size, struct pen_error *err)
{
	int fd, r;

	/* A new inode: whoever still reads or merges into an earlier file keeps that one. */
	(void)unlink(path);
	fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	if (fd < 0)
		return pen_error_system(err, errno, "cannot create the framebuffer");
	r = pen_disk_check(fd, PEN_DISK_RENDER, size, err);
	if (r == 0) {
		r = posix_fallocate(fd, 0, (off_t)size);
		if (r != 0)
			r = pen_error_system(err, r, "no space for the framebuffer");
	}
	if (r < 0)
		(void)unlink(path);
	(void)close(fd);
	return r;
}

static int read_all(int fd, void *ret_data, size_t size, off_t offset, struct pen_error *err)
{
	char *data = ret_data;

	while (size > 0) {
		ssize_t n = pread(fd, data, size, offset);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0)
			return pen_error_system(err, errno, "cannot read the framebuffer");
		if (n == 0)
			return pen_error_set(err, PEN_EIO, "the framebuffer is too short");
		data += n;
		size -= (size_t)n;
		offset += n;
	}
	return 0;
}

static int write_all(int fd, const void *bytes, size_t size, off_t offset, struct pen_error *err)
{
	const char *data = bytes;

	while (size > 0) {
		ssize_t n = pwrite(fd, data, size, offset);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0)
			return pen_error_system(err, errno, "cannot write the framebuffer");
		data += n;
		size -= (size_t)n;
		offset += n;
	}
	return 0;
}

static off_t slot_offset(const struct pen_framebuf *framebuf, uint32_t index)
{
	assert(index < framebuf->tiling.count);
	return (off_t)((uint64_t)index * pen_framebuf_slot_bytes(framebuf));
}

static void describe(const struct pen_framebuf *framebuf, const float *sums, size_t size,
	struct pen_framebuf_tile *ret_tile)
{
	const uint32_t channels = framebuf->film.channels;
	double samples = 0.0;

	for (size_t i = PEN_CHANNEL_COUNT; i < size / sizeof *sums; i += channels)
		samples += (double)sums[i];
	ret_tile->samples = (uint64_t)samples;
	ret_tile->xxh3 = pen_xxh3(sums, size);
}

static void add_round(const struct pen_framebuf *framebuf, uint32_t round, const float *pixels,
	size_t count, float *sums)
{
	const uint32_t channels = framebuf->film.channels;
	const bool replaces = framebuf->rounds.kind == PEN_ROUNDS_EDGE && round == 1;

	for (size_t i = 0; replaces && i < count; i += channels)
		if (pixels[i + PEN_CHANNEL_COUNT] > 0.0f)
			memset(sums + i, 0, channels * sizeof *sums);
	pen_film_add(pixels, count, sums);
}

int pen_framebuf_merge(int fd, const struct pen_framebuf *framebuf, uint32_t index, uint32_t round,
	const float *pixels, struct pen_framebuf_tile *ret_tile, struct pen_error *err)
{
	size_t size = pen_framebuf_tile_bytes(framebuf, index);
	off_t offset = slot_offset(framebuf, index);
	const float *merged = pixels;
	float *sums = NULL;
	int r = 0;

	if (round > 0) {
		sums = malloc(size);
		r = sums ? read_all(fd, sums, size, offset, err) : pen_error_memory(err);
		if (r < 0)
			goto out;
		add_round(framebuf, round, pixels, size / sizeof *sums, sums);
		merged = sums;
	}
	r = write_all(fd, merged, size, offset, err);
	if (r == 0)
		describe(framebuf, merged, size, ret_tile);
out:
	free(sums);
	return r;
}

int pen_framebuf_look(int fd, const struct pen_framebuf *framebuf, uint32_t index,
	struct pen_framebuf_tile *ret_tile, struct pen_error *err)
{
	size_t size = pen_framebuf_tile_bytes(framebuf, index);
	float *sums = malloc(size);
	int r;

	if (!sums)
		return pen_error_memory(err);
	r = read_all(fd, sums, size, slot_offset(framebuf, index), err);
	if (r == 0)
		describe(framebuf, sums, size, ret_tile);
	free(sums);
	return r;
}

int pen_framebuf_rows_init(struct pen_framebuf_rows *rows, int fd,
	const struct pen_framebuf *framebuf, struct pen_error *err)
{
	*rows = (struct pen_framebuf_rows){
		.fd = fd,
		.framebuf = framebuf,
		.tile_row = framebuf->tiling.rows,
		.tiles = calloc(framebuf->tiling.columns, pen_framebuf_slot_bytes(framebuf)),
	};
	return rows->tiles ? 0 : pen_error_memory(err);
}

void pen_framebuf_rows_finish(struct pen_framebuf_rows *rows)
{
	free(rows->tiles);
	rows->tiles = NULL;
}

int pen_framebuf_row(
	struct pen_framebuf_rows *rows, uint32_t y, float *ret_film, struct pen_error *err)
{
	const struct pen_tiling *tiling = &rows->framebuf->tiling;
	const size_t slot = pen_framebuf_slot_bytes(rows->framebuf);
	const uint32_t image_y = tiling->crop.y0 + y;
	const uint32_t tile_row = image_y / tiling->tile_px - tiling->crop.y0 / tiling->tile_px;
	const uint32_t channels = rows->framebuf->film.channels;

	/* The last row of tiles may be cut, its slots are whole all the same. */
	if (tile_row != rows->tile_row) {
		const size_t bytes = tiling->columns * slot;
		int r = read_all(rows->fd, rows->tiles, bytes, (off_t)(tile_row * bytes), err);

		if (r < 0)
			return r;
		rows->tile_row = tile_row;
	}
	for (uint32_t column = 0; column < tiling->columns; column++) {
		struct pen_rect rect = pen_tiling_rect(tiling, tile_row * tiling->columns + column);
		size_t floats = (size_t)pen_rect_width(rect) * channels;
		const float *from =
			rows->tiles + column * (slot / sizeof *from) + (image_y - rect.y0) * floats;

		memcpy(ret_film, from, floats * sizeof *from);
		ret_film += floats;
	}
	return 0;
}
