/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_ESSENCE_H
#define PEN_IMAGE_ESSENCE_H

#include "core/base/error.h"
#include "core/base/format.h"

#include <stddef.h>

/*
 * Of an encoded image what its pixels are made of: PNG's critical chunks and its transparency,
 * JPEG's tables, frames and scans with the two markers that tell its colours; of EXR and HDR all.
 * What else a file brings along (Exif, IPTC, XMP, profiles, texts) no picture needs, and libraries
 * read it with less care. Nothing is checked but what tells the parts from each other.
 *
 * The result is bytes themselves, or a copy that is the caller's to free: *ret_copy, else NULL.
 * PEN_ENOMEM.
 */
int pen_essence(enum pen_image_format format, const void *bytes, size_t size,
	const void **ret_bytes, size_t *ret_size, void **ret_copy, struct pen_error *err);

#endif
