/* SPDX-License-Identifier: Apache-2.0 */
#include "server/framebuf.h"

#include "core/base/digest.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

int pen_framebuf_create(
	const char *path, const struct pen_framebuf *framebuf, struct pen_error *err)
{
	uint64_t size = (uint64_t)framebuf->tiling.count * pen_framebuf_slot_bytes(framebuf);
	int fd, r;

	/* A new inode: whoever still reads or merges into an earlier file keeps that one. */
	(void)unlink(path);
	fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	if (fd < 0)
		return pen_error_system(err, errno, "cannot create the framebuffer");
	r = posix_fallocate(fd, 0, (off_t)size);
	if (r != 0) {
		(void)unlink(path);
		r = pen_error_system(err, r, "no space for the framebuffer");
	}
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

int pen_framebuf_merge(int fd, const struct pen_framebuf *framebuf, uint32_t index, int first,
	const float *pixels, uint64_t *ret_xxh3, struct pen_error *err)
{
	size_t size = pen_framebuf_tile_bytes(framebuf, index);
	off_t offset = slot_offset(framebuf, index);
	const float *merged = pixels;
	float *sums = NULL;
	int r = 0;

	if (!first) {
		sums = malloc(size);
		r = sums ? read_all(fd, sums, size, offset, err) : pen_error_memory(err);
		if (r < 0)
			goto out;
		for (size_t i = 0; i < size / sizeof *sums; i++)
			sums[i] += pixels[i];
		merged = sums;
	}
	r = write_all(fd, merged, size, offset, err);
	if (r == 0)
		*ret_xxh3 = pen_xxh3(merged, size);
out:
	free(sums);
	return r;
}

int pen_framebuf_hash(int fd, const struct pen_framebuf *framebuf, uint32_t index,
	uint64_t *ret_xxh3, struct pen_error *err)
{
	size_t size = pen_framebuf_tile_bytes(framebuf, index);
	void *data = malloc(size);
	int r;

	if (!data)
		return pen_error_memory(err);
	r = read_all(fd, data, size, slot_offset(framebuf, index), err);
	if (r == 0)
		*ret_xxh3 = pen_xxh3(data, size);
	free(data);
	return r;
}
