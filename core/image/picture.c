/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/picture.h"

#include "core/image/essence.h"
#include "core/image/oiio_reader.h"
#include "core/image/probe.h"

#include <stdlib.h>

/* From 1 to 4 channels that were read to all four. */
static void complete_bytes(uint8_t *texels, size_t count, uint32_t channels)
{
	for (size_t i = 0; i < count; i++, texels += 4) {
		if (channels == 2)
			texels[3] = texels[1];
		if (channels < 3)
			texels[1] = texels[2] = texels[0];
		if (channels % 2 == 1)
			texels[3] = UINT8_MAX;
	}
}

static float sane(float value)
{
	return value > 0.0f ? (value < PEN_TEXEL_MAX ? value : PEN_TEXEL_MAX) : 0.0f;
}

static void complete_floats(float *texels, size_t count, uint32_t channels)
{
	for (size_t i = 0; i < count; i++, texels += 4) {
		if (channels == 2)
			texels[3] = texels[1];
		if (channels < 3)
			texels[1] = texels[2] = texels[0];
		if (channels % 2 == 1)
			texels[3] = 1.0f;
		for (int c = 0; c < 4; c++)
			texels[c] = sane(texels[c]);
	}
}

static int read_pixels(struct pen_oiio_reader *reader, const struct pen_oiio_header *header,
	struct pen_picture *ret_picture, struct pen_error *err)
{
	const size_t count = (size_t)header->width * header->height;
	void *texels = calloc(count, 4 * (header->is_linear ? sizeof(float) : 1));
	int r;

	if (!texels)
		return pen_error_memory(err);
	r = pen_oiio_reader_read(reader, texels, err);
	if (r < 0) {
		free(texels);
		return r;
	}
	if (header->is_linear)
		complete_floats(texels, count, header->channels);
	else
		complete_bytes(texels, count, header->channels);
	*ret_picture = (struct pen_picture){
		.type = header->is_linear ? PEN_TEXEL_FLOATS : PEN_TEXEL_BYTES,
		.width = header->width,
		.height = header->height,
		.texels = texels,
	};
	return 0;
}

static int decode(const struct pen_probe *probe, const void *bytes, size_t size,
	struct pen_picture *ret_picture, struct pen_error *err)
{
	static const char *const names[PEN_IMAGE_FORMATS] = {"png", "jpeg", "openexr", "hdr"};
	struct pen_oiio_reader *reader = NULL;
	struct pen_oiio_header header = {0};
	int r = pen_oiio_reader_create(names[probe->format], bytes, size, &reader, &header, err);

	if (r == 0 && (header.width != probe->width || header.height != probe->height))
		r = pen_error_set(err, PEN_EINVALID, "its header contradicts itself");
	if (r == 0)
		r = read_pixels(reader, &header, ret_picture, err);
	pen_oiio_reader_destroy(reader);
	return r;
}

int pen_picture_decode(
	const void *bytes, size_t size, struct pen_picture *ret_picture, struct pen_error *err)
{
	struct pen_probe probe;
	void *copy = NULL;
	int r = pen_probe(bytes, size, &probe, err);

	if (r == 0)
		r = pen_essence(probe.format, bytes, size, &bytes, &size, &copy, err);
	if (r == 0)
		r = decode(&probe, bytes, size, ret_picture, err);
	if (r == 0)
		ret_picture->is_encoded =
			probe.format == PEN_IMAGE_PNG || probe.format == PEN_IMAGE_JPEG;
	free(copy);
	return r;
}

void pen_picture_finish(struct pen_picture *picture)
{
	free(picture->texels);
	picture->texels = NULL;
}
