/* SPDX-License-Identifier: Apache-2.0 */

/* Any bytes as an encoded image: nothing but an error or a picture within the limits comes of it.
 */
#include "core/base/limits.h"
#include "core/image/mipmap.h"
#include "core/image/probe.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Larger pictures are valid, but too slow to find anything with. */
enum { PIXELS_MAX = 1 << 16 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_picture picture = {0};
	struct pen_mipmap *mipmap = NULL;
	struct pen_probe probe;

	if (pen_probe(data, size, &probe, &err) < 0)
		return 0;
	if (probe.width > PEN_PICTURE_SIDE_MAX || probe.height > PEN_PICTURE_SIDE_MAX)
		abort();
	if ((uint64_t)probe.width * probe.height > PIXELS_MAX)
		return 0;
	if (pen_picture_decode(data, size, &picture, &err) < 0)
		return 0;
	if (picture.width != probe.width || picture.height != probe.height)
		abort();
	if (pen_mipmap_create(&picture, size % 2 == 1, &mipmap, &err) == 0)
		pen_mipmap_destroy(mipmap);
	return 0;
}
