/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/format.h"

#include <string.h>

static const struct {
	const char *extension, *media_type;
} formats[PEN_IMAGE_FORMATS] = {
	[PEN_IMAGE_PNG] = {"png", "image/png"},
	[PEN_IMAGE_JPEG] = {"jpg", "image/jpeg"},
	[PEN_IMAGE_EXR] = {"exr", "image/x-exr"},
	[PEN_IMAGE_HDR] = {"hdr", "image/vnd.radiance"},
};

const char *pen_image_format_extension(enum pen_image_format format)
{
	return formats[format].extension;
}

const char *pen_image_format_media_type(enum pen_image_format format)
{
	return formats[format].media_type;
}

bool pen_image_format_parse(const char *extension, enum pen_image_format *ret_format)
{
	for (unsigned i = 0; i < PEN_IMAGE_FORMATS; i++) {
		if (strcmp(extension, formats[i].extension) == 0) {
			*ret_format = (enum pen_image_format)i;
			return true;
		}
	}
	if (strcmp(extension, "jpeg") != 0)
		return false;
	*ret_format = PEN_IMAGE_JPEG;
	return true;
}
