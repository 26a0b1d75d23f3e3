/* SPDX-License-Identifier: Apache-2.0 */
#include "server/quota.h"

#include "core/base/digest.h"
#include "core/base/limits.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Each of the two copies begins with this. */
struct header {
	uint64_t decided;
	uint64_t xxh3; /* of decided and of the rounds */
};

static size_t slot_pixels(const struct pen_framebuf *framebuf)
{
	return (size_t)framebuf->tiling.tile_px * framebuf->tiling.tile_px;
}

static size_t pixel_count(const struct pen_framebuf *framebuf)
{
	return framebuf->tiling.count * slot_pixels(framebuf);
}

static off_t copy_offset(const struct pen_framebuf *framebuf, uint32_t copy)
{
	const uint64_t tiles = (uint64_t)framebuf->tiling.count * pen_framebuf_slot_bytes(framebuf);

	return (off_t)(tiles + copy * (sizeof(struct header) + pixel_count(framebuf)));
}

uint64_t pen_quota_bytes(const struct pen_framebuf *framebuf)
{
	if (framebuf->rounds.kind == PEN_ROUNDS_UNIFORM)
		return 0;
	return 2 * (sizeof(struct header) + (uint64_t)pixel_count(framebuf));
}

int pen_quota_init(
	struct pen_quota *quota, const struct pen_framebuf *framebuf, struct pen_error *err)
{
	const uint32_t sure = framebuf->rounds.sure;

	*quota = (struct pen_quota){.framebuf = framebuf, .rounds = malloc(pixel_count(framebuf))};
	if (!quota->rounds)
		return pen_error_memory(err);
	memset(quota->rounds, sure < PEN_QUOTA_ALL ? (int)sure : PEN_QUOTA_ALL,
		pixel_count(framebuf));
	return 0;
}

void pen_quota_finish(struct pen_quota *quota)
{
	free(quota->rounds);
	quota->rounds = NULL;
}

static uint64_t hash(uint32_t decided, const uint8_t *rounds, size_t count)
{
	return pen_xxh3(rounds, count) + decided;
}

static int transfer(
	ssize_t (*move)(int, void *, size_t, off_t), int fd, void *data, size_t size, off_t offset)
{
	char *bytes = data;

	while (size > 0) {
		ssize_t n = move(fd, bytes, size, offset);

		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			return n < 0 ? -errno : -EIO;
		bytes += n;
		offset += n;
		size -= (size_t)n;
	}
	return 0;
}

static ssize_t move_out(int fd, void *data, size_t size, off_t offset)
{
	return pwrite(fd, data, size, offset);
}

void pen_quota_load(struct pen_quota *quota, int fd)
{
	const size_t count = pixel_count(quota->framebuf);
	uint8_t *rounds = malloc(count);
	struct header header;

	for (uint32_t copy = 0; rounds && copy < 2; copy++) {
		const off_t offset = copy_offset(quota->framebuf, copy);
		uint8_t *before = quota->rounds;

		if (transfer(pread, fd, &header, sizeof header, offset) < 0 ||
			transfer(pread, fd, rounds, count, offset + (off_t)sizeof header) < 0 ||
			header.decided <= quota->decided || header.decided > UINT16_MAX ||
			header.xxh3 != hash((uint32_t)header.decided, rounds, count))
			continue;
		quota->decided = (uint32_t)header.decided;
		quota->rounds = rounds;
		rounds = before;
	}
	free(rounds);
}

int pen_quota_save(const struct pen_quota *quota, int fd, struct pen_error *err)
{
	const size_t count = pixel_count(quota->framebuf);
	const off_t offset = copy_offset(quota->framebuf, quota->decided % 2);
	struct header header = {quota->decided, hash(quota->decided, quota->rounds, count)};
	int r = transfer(move_out, fd, quota->rounds, count, offset + (off_t)sizeof header);

	if (r == 0)
		r = transfer(move_out, fd, &header, sizeof header, offset);
	if (r == 0 && fdatasync(fd) < 0)
		r = -errno;
	return r < 0 ? pen_error_system(err, -r, "cannot write the framebuffer") : 0;
}

struct pen_demand pen_demand_first(const struct pen_rounds *rounds, uint64_t area)
{
	return (struct pen_demand){
		.rounds = (uint16_t)rounds->sure,
		.is_final = rounds->sure == pen_round_count(rounds),
		.pixels = (uint32_t)area,
		.samples = area * rounds->samples,
	};
}

/* Samples of a pixel that shall have so many rounds and no more. */
static uint32_t samples_of(const struct pen_quota *quota, uint8_t rounds)
{
	const struct pen_rounds *all = &quota->framebuf->rounds;

	return rounds == PEN_QUOTA_ALL || rounds > quota->decided ? all->samples
								  : pen_round_samples(all, rounds);
}

struct pen_demand pen_quota_demand(const struct pen_quota *quota, uint32_t tile)
{
	const struct pen_framebuf *framebuf = quota->framebuf;
	const uint64_t area = pen_rect_area(pen_tiling_rect(&framebuf->tiling, tile));
	const uint8_t *rounds = quota->rounds + tile * slot_pixels(framebuf);
	const uint32_t all = pen_round_count(&framebuf->rounds);
	uint32_t counts[PEN_QUOTA_ALL + 1] = {0}, most = PEN_QUOTA_ALL;
	struct pen_demand demand = {0};

	if (quota->decided == 0)
		return pen_demand_first(&framebuf->rounds, area);
	for (uint64_t i = 0; i < area; i++)
		counts[rounds[i]]++;
	while (counts[most] == 0)
		most--;
	for (uint32_t i = 0; i <= most; i++)
		if (counts[i] > 0)
			demand.samples += (uint64_t)counts[i] * samples_of(quota, (uint8_t)i);
	demand.rounds = (uint16_t)(most == PEN_QUOTA_ALL ? all : most);
	demand.is_final = most <= quota->decided || demand.rounds == all;
	demand.pixels = counts[most];
	return demand;
}

bool pen_quota_mask(const struct pen_quota *quota, uint32_t tile, uint32_t round, uint8_t *ret_mask)
{
	const struct pen_framebuf *framebuf = quota->framebuf;
	const struct pen_rect rect = pen_tiling_rect(&framebuf->tiling, tile);
	const uint8_t *rounds = quota->rounds + tile * slot_pixels(framebuf);

	if (round < framebuf->rounds.sure)
		return false;
	memset(ret_mask, 0, PEN_MASK_BYTES_MAX);
	for (size_t i = 0; i < pen_rect_area(rect); i++)
		if (rounds[i] == PEN_QUOTA_ALL || rounds[i] > round)
			pen_mask_add(ret_mask, i);
	return true;
}
