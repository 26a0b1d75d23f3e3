/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_PICTURE_H
#define PEN_IMAGE_PICTURE_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum pen_texel_type {
	PEN_TEXEL_BYTES, /* 0..255 for 0..1 */
	PEN_TEXEL_FLOATS /* 0..PEN_TEXEL_MAX */
};

/* A decoded picture: red, green, blue, alpha of each pixel, row by row from the top. */
struct pen_picture {
	enum pen_texel_type type;
	bool is_encoded; /* of a PNG or JPEG: an sRGB curve may lie on the colours */
	uint32_t width, height;
	void *texels; /* of the heap */
};

/* What is brighter, infinite too, is taken for this; what is negative or no number for 0. */
#define PEN_TEXEL_MAX 1e9f

/*
 * Decodes a PNG, JPEG, EXR or HDR image, which its first bytes tell, within the limits that
 * pen_probe checks first. Grey becomes red, green and blue, a missing alpha 1, and colours are not
 * multiplied by alpha (but EXR's, which are stored so). 8 bits a channel stay bytes with the
 * encoding that they have; everything else becomes floats. No file is opened and no thread is
 * started. PEN_EINVALID, PEN_ELIMIT, PEN_EUNSUPPORTED, PEN_ENOMEM say what is wrong with "it".
 */
int pen_picture_decode(
	const void *bytes, size_t size, struct pen_picture *ret_picture, struct pen_error *err);
void pen_picture_finish(struct pen_picture *picture);

#endif
