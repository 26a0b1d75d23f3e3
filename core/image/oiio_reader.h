/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_OIIO_READER_H
#define PEN_IMAGE_OIIO_READER_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * OpenImageIO's readers behind a C face: no exception passes it, it opens no file and starts no
 * thread. For picture.c alone.
 */

struct pen_oiio_reader;

struct pen_oiio_header {
	uint32_t width, height;
	uint32_t channels; /* that are read: 1 grey, 2 and alpha, 3 colour, 4 and alpha */
	bool is_linear;	   /* more than 8 bits a channel: floats are read; else bytes */
};

/* Reads the header by the named reader ("png", …) and no other. bytes must outlive the reader. */
int pen_oiio_reader_create(const char *format, const void *bytes, size_t size,
	struct pen_oiio_reader **ret_reader, struct pen_oiio_header *ret_header,
	struct pen_error *err);

/* All pixels, row by row from the top, each in the first channels of four values. */
int pen_oiio_reader_read(struct pen_oiio_reader *reader, void *ret_pixels, struct pen_error *err);

void pen_oiio_reader_destroy(struct pen_oiio_reader *reader);

#endif
