/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_OIIO_H
#define PEN_IMAGE_OIIO_H

#include "core/base/error.h"
#include "core/base/layer.h"
#include "core/base/limits.h"
#include "core/base/rect.h"

#include <stdbool.h>
#include <stdint.h>

/* OpenImageIO behind a C face: no exception passes it, and it starts no thread. For codec.c alone.
 */

struct pen_oiio_attribute {
	const char *name;
	char text[PEN_CLASS_BYTES_MAX + 1];
};

enum { PEN_OIIO_ATTRIBUTES = 5 };

struct pen_oiio_layout {
	const char *format;	/* OpenImageIO's name: "png", "jpeg", "openexr", "hdr" */
	uint32_t width, height; /* of the whole image */
	struct pen_rect window; /* the pixels that are stored */
	unsigned channels;	/* 3: R, G, B; 4: and A; more in EXR */
	const char *names[PEN_LAYER_CHANNELS_MAX]; /* of the channels */
	unsigned attribute_count;
	struct pen_oiio_attribute attributes[PEN_OIIO_ATTRIBUTES]; /* in EXR and PNG */
	bool linear; /* floats in linear light; else bytes in sRGB */
	bool final;  /* compress well; else fast */
};

struct pen_oiio_output;

/* Starts a file at the start of fd, which stays the caller's and must outlive the output. */
int pen_oiio_create(const struct pen_oiio_layout *layout, int fd,
	struct pen_oiio_output **ret_output, struct pen_error *err);

/* Row y of the window, rows in order: channels floats or bytes a pixel. */
int pen_oiio_write(
	struct pen_oiio_output *output, uint32_t y, const void *pixels, struct pen_error *err);

/* Completes the file and tells its size. */
int pen_oiio_complete(struct pen_oiio_output *output, uint64_t *ret_size, struct pen_error *err);

void pen_oiio_destroy(struct pen_oiio_output *output);

#endif
