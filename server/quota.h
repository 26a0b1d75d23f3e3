/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_QUOTA_H
#define PEN_SERVER_QUOTA_H

#include "core/base/error.h"
#include "core/base/mask.h"
#include "server/framebuf.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * How many rounds each pixel of a frame shall have, where that is decided on the way: a pixel that
 * has got its share gets no more. It lies behind the tiles in the framebuffer file, twice, so that
 * it outlives the coordinator at any moment, and says of every earlier round which pixels had it.
 */
struct pen_quota {
	const struct pen_framebuf *framebuf; /* borrowed */
	uint8_t *
		rounds; /* a byte a pixel, in slots like the tiles'; PEN_QUOTA_ALL: all there are */
	uint32_t decided; /* after how many rounds the last decision was made; 0: none yet */
};

enum { PEN_QUOTA_ALL = UINT8_MAX };

/* What is known of a tile's needs. */
struct pen_demand {
	uint16_t rounds;  /* that it shall have */
	bool is_final;	  /* and it will not be more */
	uint32_t pixels;  /* that take part in the last of them */
	uint64_t samples; /* of all its pixels, at most */
};

/* Of a tile of area pixels before anything is decided. */
struct pen_demand pen_demand_first(const struct pen_rounds *rounds, uint64_t area);

/* Bytes behind the tiles of the file. */
uint64_t pen_quota_bytes(const struct pen_framebuf *framebuf);

/* Every pixel has the rounds that are sure. PEN_ENOMEM. */
int pen_quota_init(
	struct pen_quota *quota, const struct pen_framebuf *framebuf, struct pen_error *err);
void pen_quota_finish(struct pen_quota *quota);

/* From the file, as far as what is there is whole; else it stays as it is. */
void pen_quota_load(struct pen_quota *quota, int fd);

/* Onto the disk. */
int pen_quota_save(const struct pen_quota *quota, int fd, struct pen_error *err);

struct pen_demand pen_quota_demand(const struct pen_quota *quota, uint32_t tile);

/*
 * The pixels of a tile that take part in a round (counted from 0); false when all do. ret_mask
 * holds PEN_MASK_BYTES_MAX.
 */
bool pen_quota_mask(
	const struct pen_quota *quota, uint32_t tile, uint32_t round, uint8_t *ret_mask);

#endif
