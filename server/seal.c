/* SPDX-License-Identifier: Apache-2.0 */
#include "server/seal.h"

#include "core/base/digest.h"
#include "server/quota.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

static off_t offset_of(const struct pen_framebuf *framebuf)
{
	return (off_t)(pen_framebuf_bytes(framebuf) + pen_quota_bytes(framebuf));
}

uint64_t pen_seal_bytes(const struct pen_framebuf *framebuf)
{
	return (framebuf->tiling.count + 1) * sizeof(uint64_t);
}

/* The last one is of those before it. */
static uint64_t last_of(const struct pen_framebuf *framebuf, const uint64_t *hashes)
{
	return pen_xxh3(hashes, framebuf->tiling.count * sizeof *hashes);
}

int pen_seal_write(int fd, const struct pen_framebuf *framebuf, const struct pen_canvas_tile *tiles,
	struct pen_error *err)
{
	const size_t size = pen_seal_bytes(framebuf);
	uint64_t *hashes = malloc(size);
	int r = 0;

	if (!hashes)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < framebuf->tiling.count; i++)
		hashes[i] = tiles[i].xxh3;
	hashes[framebuf->tiling.count] = last_of(framebuf, hashes);
	/* The file has had the room from the beginning. */
	if (pwrite(fd, hashes, size, offset_of(framebuf)) != (ssize_t)size)
		r = pen_error_system(err, errno, "cannot write the framebuffer");
	free(hashes);
	return r;
}

static int check_tiles(int fd, const struct pen_framebuf *framebuf, const uint64_t *hashes,
	enum pen_seal_finding *ret_finding, uint32_t *ret_tile, struct pen_error *err)
{
	struct pen_framebuf_tile found;

	for (uint32_t i = 0; i < framebuf->tiling.count; i++) {
		int r = pen_framebuf_look(fd, framebuf, i, &found, err);

		if (r < 0)
			return r;
		if (found.xxh3 == hashes[i])
			continue;
		*ret_finding = PEN_SEAL_BROKEN;
		*ret_tile = i;
		return 0;
	}
	*ret_finding = PEN_SEAL_WHOLE;
	return 0;
}

int pen_seal_check(int fd, const struct pen_framebuf *framebuf, enum pen_seal_finding *ret_finding,
	uint32_t *ret_tile, struct pen_error *err)
{
	const size_t size = pen_seal_bytes(framebuf);
	uint64_t *hashes = malloc(size);
	int r = 0;

	if (!hashes)
		return pen_error_memory(err);
	*ret_finding = PEN_SEAL_ABSENT;
	if (pread(fd, hashes, size, offset_of(framebuf)) == (ssize_t)size &&
		hashes[framebuf->tiling.count] == last_of(framebuf, hashes))
		r = check_tiles(fd, framebuf, hashes, ret_finding, ret_tile, err);
	free(hashes);
	return r;
}
