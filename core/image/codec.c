/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/codec.h"

#include "core/image/oiio.h"
#include "core/image/tonemap.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* One picture on its way: a row comes in as rgba and leaves as pixels. */
struct encoding {
	const struct pen_image_spec *spec;
	struct pen_oiio_layout layout;
	struct pen_tonemap *tonemap; /* NULL for linear formats */
	float *rgba;		     /* a row of the stored width */
	void *pixels;		     /* the same as the file has it */
	struct pen_oiio_output *output;
};

static struct pen_oiio_layout layout_of(const struct pen_image_spec *spec)
{
	static const char *const names[PEN_IMAGE_FORMATS] = {"png", "jpeg", "openexr", "hdr"};
	struct pen_rect whole = {.x1 = spec->width, .y1 = spec->height};
	bool opaque = spec->final && pen_rect_contains(spec->window, whole);
	struct pen_oiio_layout layout = {
		.format = names[spec->format],
		.width = spec->width,
		.height = spec->height,
		.window = whole,
		.channels = 3,
		.linear = spec->format == PEN_IMAGE_EXR || spec->format == PEN_IMAGE_HDR,
		.final = spec->final,
	};

	if (spec->format == PEN_IMAGE_EXR)
		layout.window = spec->window;
	if (spec->format == PEN_IMAGE_EXR || (spec->format == PEN_IMAGE_PNG && !opaque))
		layout.channels = 4;
	return layout;
}

static int encoding_init(struct encoding *encoding, int fd, struct pen_error *err)
{
	size_t width = pen_rect_width(encoding->layout.window);
	size_t channels = encoding->layout.channels;

	encoding->rgba = calloc(width, 4 * sizeof(float));
	encoding->pixels = calloc(width, channels * sizeof(float));
	if (!encoding->rgba || !encoding->pixels)
		return pen_error_memory(err);
	if (!encoding->layout.linear) {
		encoding->tonemap = malloc(sizeof *encoding->tonemap);
		if (!encoding->tonemap)
			return pen_error_memory(err);
		pen_tonemap_init(encoding->tonemap, encoding->spec->exposure);
	}
	return pen_oiio_create(&encoding->layout, fd, &encoding->output, err);
}

static void encoding_finish(struct encoding *encoding)
{
	pen_oiio_destroy(encoding->output);
	free(encoding->tonemap);
	free(encoding->pixels);
	free(encoding->rgba);
}

static int encode_row(struct encoding *encoding, uint32_t y, struct pen_error *err)
{
	size_t width = pen_rect_width(encoding->layout.window);
	unsigned channels = encoding->layout.channels;
	float *pixels = encoding->pixels;

	if (encoding->tonemap) {
		pen_tonemap_row(
			encoding->tonemap, encoding->rgba, width, channels, encoding->pixels);
	} else {
		for (size_t x = 0; x < width; x++)
			memcpy(pixels + x * channels, encoding->rgba + 4 * x,
				channels * sizeof(float));
	}
	return pen_oiio_write(encoding->output, y, encoding->pixels, err);
}

static int encode_rows(
	struct encoding *encoding, pen_image_row_fn *row, void *user, struct pen_error *err)
{
	struct pen_rect stored = encoding->layout.window, window = encoding->spec->window;
	size_t row_bytes = (size_t)pen_rect_width(stored) * 4 * sizeof(float);
	float *inside = encoding->rgba + (size_t)4 * (window.x0 - stored.x0);
	int r = 0;

	for (uint32_t y = stored.y0; r == 0 && y < stored.y1; y++) {
		if (y >= window.y0 && y < window.y1)
			r = row(user, y, inside, err);
		else
			memset(encoding->rgba, 0, row_bytes);
		if (r == 0)
			r = encode_row(encoding, y, err);
	}
	return r;
}

int pen_image_encode(const struct pen_image_spec *spec, pen_image_row_fn *row, void *user, int fd,
	uint64_t *ret_size, struct pen_error *err)
{
	struct encoding encoding = {.spec = spec, .layout = layout_of(spec)};
	int r;

	assert(pen_rect_valid(spec->window));
	assert(spec->window.x1 <= spec->width && spec->window.y1 <= spec->height);
	r = encoding_init(&encoding, fd, err);
	if (r == 0)
		r = encode_rows(&encoding, row, user, err);
	if (r == 0)
		r = pen_oiio_complete(encoding.output, ret_size, err);
	encoding_finish(&encoding);
	return r;
}
