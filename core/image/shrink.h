/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_SHRINK_H
#define PEN_IMAGE_SHRINK_H

#include "core/base/error.h"
#include "core/base/rect.h"
#include "core/image/codec.h"

/*
 * A region of a picture made smaller: each pixel is the mean over the square that it covers, of
 * what is rendered of that, in linear light.
 */
struct pen_shrink {
	pen_image_row_fn *row; /* of the picture: R, G, B, alpha over the columns of window */
	void *user;
	struct pen_rect window; /* what there is of the picture; all else is not rendered */
	struct pen_rect region;
	uint32_t width, height; /* at most the region's */
	float *values;		/* a row of the window */
	double *sums;		/* a row of the result: R, G, B, weight */
};

/* The first six members are the caller's to set. PEN_ENOMEM. */
int pen_shrink_init(struct pen_shrink *shrink, struct pen_error *err);
void pen_shrink_finish(struct pen_shrink *shrink);

/* As pen_image_row_fn, of a struct pen_shrink; downwards. */
int pen_shrink_row(void *user, uint32_t y, float *ret_values, struct pen_error *err);

#endif
