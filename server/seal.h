/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SEAL_H
#define PEN_SERVER_SEAL_H

#include "server/canvas.h"

/*
 * What the bytes of a finished frame must be: behind its tiles and its quota the framebuffer file
 * has the xxh3 of each tile, and one of all these.
 */
uint64_t pen_seal_bytes(const struct pen_framebuf *framebuf);

/* Of a frame whose tiles are known to hold this; does not wait for the disk. */
int pen_seal_write(int fd, const struct pen_framebuf *framebuf, const struct pen_canvas_tile *tiles,
	struct pen_error *err);

enum pen_seal_finding {
	PEN_SEAL_WHOLE,
	PEN_SEAL_ABSENT, /* of an earlier version, or of a frame that is not finished */
	PEN_SEAL_BROKEN	 /* a tile's bytes are others: *ret_tile */
};

/* Reads the whole file. PEN_EIO, PEN_ENOMEM. */
int pen_seal_check(int fd, const struct pen_framebuf *framebuf, enum pen_seal_finding *ret_finding,
	uint32_t *ret_tile, struct pen_error *err);

#endif
