/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ENCODING_H
#define PEN_SERVER_ENCODING_H

#include "core/base/rect.h"

#include <assert.h>
#include <stdint.h>

/*
 * What the coordinator and its encoder say to each other: one request and one reply at a time over
 * a SOCK_SEQPACKET pair that the encoder inherits as descriptor PEN_ENCODER_SOCKET. Both run the
 * same build on the same machine.
 */
enum { PEN_ENCODER_SOCKET = 3 };

/* Comes with two descriptors: the framebuffer (server/framebuf.h), and the empty file to fill. */
struct pen_encoding_request {
	uint32_t format; /* enum pen_image_format */
	uint32_t final;	 /* 0 or 1 */
	uint32_t width, height;
	struct pen_rect crop;
	uint32_t tile_px;
	uint32_t planes; /* enum pen_plane: of the framebuffer */
	double exposure;
};
static_assert(sizeof(struct pen_encoding_request) == 48, "no padding");

struct pen_encoding_reply {
	uint64_t size; /* of the file */
	int32_t code;  /* 0 or enum pen_code, then with text */
	char text[500];
};
static_assert(sizeof(struct pen_encoding_reply) == 512, "no padding");

#endif
