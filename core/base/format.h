/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_FORMAT_H
#define PEN_BASE_FORMAT_H

#include <stdbool.h>

/* The image files that are offered. */
enum pen_image_format { PEN_IMAGE_PNG, PEN_IMAGE_JPEG, PEN_IMAGE_EXR, PEN_IMAGE_HDR };

enum { PEN_IMAGE_FORMATS = PEN_IMAGE_HDR + 1 };

/* "png", "jpg", "exr", "hdr". */
const char *pen_image_format_extension(enum pen_image_format format);

/* "image/png" and so on. */
const char *pen_image_format_media_type(enum pen_image_format format);

/* From an extension without its dot, as above or "jpeg"; lower case. */
bool pen_image_format_parse(const char *extension, enum pen_image_format *ret_format);

#endif
