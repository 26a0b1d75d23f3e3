/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ENCODING_H
#define PEN_SERVER_ENCODING_H

#include "core/base/film.h"
#include "core/base/limits.h"
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
	uint32_t format;	/* enum pen_image_format */
	uint32_t final;		/* 0 or 1 */
	uint32_t width, height; /* of the whole image */
	struct pen_rect region; /* of it, shrunk to out_width by out_height; 0: all of it */
	uint32_t out_width, out_height;
	struct pen_rect crop;
	uint32_t tile_px;
	uint32_t planes;  /* enum pen_plane: of the framebuffer */
	uint32_t layers;  /* 1 << enum pen_layer: which an EXR of the colour has */
	uint32_t layer;	  /* enum pen_layer: what the image shows */
	uint32_t samples; /* of a pixel, at most */
	uint32_t frame;
	double exposure;
	char content[72]; /* address; "": not known yet, nor is the class */
	char equivalence_class[PEN_CLASS_BYTES_MAX + 1];
};
static_assert(sizeof(struct pen_encoding_request) == 256, "no padding");

/* How long an encoder may take for it: a large image with many layers takes minutes. */
static inline uint64_t pen_encoding_ms(const struct pen_encoding_request *request)
{
	return PEN_ENCODING_MS + pen_rect_area(request->crop) *
					 pen_film_of(request->planes).channels /
					 PEN_ENCODING_MS_VALUES;
}

struct pen_encoding_reply {
	uint64_t size; /* of the file */
	int32_t code;  /* 0 or enum pen_code, then with text */
	char text[500];
};
static_assert(sizeof(struct pen_encoding_reply) == 512, "no padding");

#endif
