/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_PROBE_H
#define PEN_IMAGE_PROBE_H

#include "core/base/error.h"
#include "core/base/format.h"

#include <stddef.h>
#include <stdint.h>

/* What an encoded image says of itself, read by our own code before a library sees it. */
struct pen_probe {
	enum pen_image_format format;
	uint32_t width, height;
};

/*
 * Knows PNG, JPEG, EXR and HDR by their first bytes, whatever the file was called. PEN_EUNSUPPORTED
 * for anything else and for EXR files that are deep or of several parts; PEN_ELIMIT when it is
 * larger than PEN_PICTURE_SIDE_MAX or PEN_PICTURE_PIXELS_MAX, or would take a library too long;
 * PEN_EINVALID for a header that is damaged.
 */
int pen_probe(const void *bytes, size_t size, struct pen_probe *ret_probe, struct pen_error *err);

#endif
