/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/essence.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* What has been kept so far: never more than there was. */
struct copy {
	uint8_t *bytes;
	size_t size;
};

static void keep(struct copy *copy, const uint8_t *from, size_t size)
{
	memcpy(copy->bytes + copy->size, from, size);
	copy->size += size;
}

enum { PNG_SIGNATURE = 8, PNG_AROUND = 12 }; /* a chunk's length, name and checksum */

/* The case of a chunk's first letter tells whether pictures can do without it. */
static bool is_png_essence(const uint8_t *name)
{
	return (name[0] & 0x20) == 0 || memcmp(name, "tRNS", 4) == 0;
}

static void take_png(const uint8_t *at, size_t left, struct copy *copy)
{
	keep(copy, at, left < PNG_SIGNATURE ? left : PNG_SIGNATURE);
	at += copy->size;
	left -= copy->size;
	while (left >= PNG_AROUND) {
		const uint64_t length = (uint64_t)at[0] << 24 | (uint64_t)at[1] << 16 |
					(uint64_t)at[2] << 8 | at[3];
		/* What is cut off is kept for the library to find fault with. */
		const size_t size = length + PNG_AROUND < left ? length + PNG_AROUND : left;

		if (is_png_essence(at + 4))
			keep(copy, at, size);
		at += size;
		left -= size;
	}
	keep(copy, at, left);
}

enum { JPEG_SOS = 0xda, JPEG_APP0 = 0xe0, JPEG_ADOBE = 0xee };

/* Without a length: a restart, a start or an end. */
static bool is_jpeg_bare(uint8_t marker)
{
	return marker == 0x01 || (marker >= 0xd0 && marker <= 0xd9);
}

static bool is_jpeg_essence(uint8_t marker)
{
	return marker == JPEG_ADOBE || (marker >= 0xc0 && marker <= JPEG_APP0);
}

/* Segments up to the first scan; from there on all that there is. */
static void take_jpeg(const uint8_t *at, size_t left, struct copy *copy)
{
	const uint8_t *const end = at + left;

	keep(copy, at, left < 2 ? left : 2);
	at += copy->size;
	while (end - at >= 4) {
		size_t length;

		if (at[0] != 0xff || at[1] == 0x00 || at[1] == 0xff) {
			at++;
			continue;
		}
		if (is_jpeg_bare(at[1])) {
			at += 2;
			continue;
		}
		if (at[1] == JPEG_SOS) {
			keep(copy, at, (size_t)(end - at));
			return;
		}
		length = 2 + ((size_t)at[2] << 8 | at[3]);
		if (length < 4 || length > (size_t)(end - at))
			return;
		if (is_jpeg_essence(at[1]))
			keep(copy, at, length);
		at += length;
	}
}

int pen_essence(enum pen_image_format format, const void *bytes, size_t size,
	const void **ret_bytes, size_t *ret_size, void **ret_copy, struct pen_error *err)
{
	struct copy copy = {NULL, 0};

	if (format == PEN_IMAGE_PNG || format == PEN_IMAGE_JPEG) {
		copy.bytes = malloc(size + 1);
		if (!copy.bytes)
			return pen_error_memory(err);
	}
	if (format == PEN_IMAGE_PNG)
		take_png(bytes, size, &copy);
	if (format == PEN_IMAGE_JPEG)
		take_jpeg(bytes, size, &copy);
	*ret_bytes = copy.bytes ? copy.bytes : bytes;
	*ret_size = copy.bytes ? copy.size : size;
	*ret_copy = copy.bytes;
	return 0;
}
