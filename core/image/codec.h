/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_CODEC_H
#define PEN_IMAGE_CODEC_H

#include "core/base/error.h"
#include "core/base/format.h"
#include "core/base/layer.h"
#include "core/base/rect.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * Pictures to files. PNG and JPEG hold tone-mapped sRGB, EXR and HDR linear light. An EXR has the
 * window as its data window and the whole image as its display window, and layers whose channels
 * are named "albedo.R" and so on; the other formats hold the colour of the whole image, transparent
 * (PNG) or black outside the window. Equal pixels give equal bytes: no
 * file holds a date, a host or a program's name.
 */
/* What EXR and PNG say of where the image comes from, beside the program and its version. */
struct pen_image_origin {
	const char *content; /* address; "" or NULL: nothing of it all is known */
	const char *equivalence_class;
	uint32_t samples; /* of a pixel, at most */
	uint32_t frame;
};

struct pen_image_spec {
	enum pen_image_format format;
	uint32_t width, height; /* of the whole image */
	struct pen_rect window; /* the part of it that was asked for */
	bool final;	 /* every pixel of the window is rendered: compress well; else fast */
	double exposure; /* stops; PNG and JPEG */
	bool is_plain; /* PNG and JPEG hold values of 0..1 as they are, without exposure or curve */
	uint32_t layers; /* 1 << enum pen_layer: which an EXR has beside the colour */
	struct pen_image_origin origin;
};

/*
 * Tells row y of the image, y within the window: window width pixels of linear R, G, B and alpha,
 * which is 1 where rendered and 0 elsewhere, where the colour is black, and for an EXR the values
 * of its further layers, in their order. Called once a row, downwards.
 */
typedef int pen_image_row_fn(void *user, uint32_t y, float *ret_values, struct pen_error *err);

/*
 * Writes the picture into the empty file fd, row by row: memory is a few rows and, for JPEG, the
 * file. PEN_ENOSPACE and PEN_EIO as the system tells; errors of row are passed on.
 */
int pen_image_encode(const struct pen_image_spec *spec, pen_image_row_fn *row, void *user, int fd,
	uint64_t *ret_size, struct pen_error *err);

#endif
