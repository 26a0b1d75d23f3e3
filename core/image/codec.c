/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/codec.h"

#include "core/image/oiio.h"
#include "core/image/tonemap.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What EXR calls a layer's channels; a number alone is called as Blender calls its own. */
static const char *const channel_names[PEN_LAYERS][4] = {
	[PEN_LAYER_COLOR] = {"R", "G", "B", "A"},
	[PEN_LAYER_ALBEDO] = {"albedo.R", "albedo.G", "albedo.B"},
	[PEN_LAYER_NORMAL] = {"normal.X", "normal.Y", "normal.Z"},
	[PEN_LAYER_DEPTH] = {"depth.Z"},
	[PEN_LAYER_SAMPLES] = {"samples.X"},
};

/* One picture on its way: a row comes in as values and leaves as pixels. */
struct encoding {
	const struct pen_image_spec *spec;
	struct pen_oiio_layout layout;
	struct pen_tonemap *tonemap; /* NULL for linear formats */
	size_t value_count;	     /* of a pixel: 4 and the layers' */
	float *values;		     /* a row of the stored width */
	void *pixels;		     /* the same as the file has it */
	struct pen_oiio_output *output;
};

static void add_channels(struct pen_oiio_layout *layout, enum pen_layer layer, uint32_t count)
{
	for (uint32_t i = 0; i < count; i++)
		layout->names[layout->channels++] = channel_names[layer][i];
}

static void add_attribute(struct pen_oiio_layout *layout, const char *name, const char *text)
{
	struct pen_oiio_attribute *attribute = &layout->attributes[layout->attribute_count++];

	assert(layout->attribute_count <= PEN_OIIO_ATTRIBUTES);
	attribute->name = name;
	(void)snprintf(attribute->text, sizeof attribute->text, "%s", text);
}

static void add_number(struct pen_oiio_layout *layout, const char *name, uint32_t number)
{
	char text[12];

	(void)snprintf(text, sizeof text, "%" PRIu32, number);
	add_attribute(layout, name, text);
}

/* Nothing that varies between two renders of one request. */
static void add_origin(struct pen_oiio_layout *layout, const struct pen_image_origin *origin)
{
	add_attribute(layout, "Software", "Penumbra " PEN_VERSION);
	if (!origin->content || origin->content[0] == '\0')
		return;
	add_attribute(layout, "penumbra:content", origin->content);
	add_attribute(layout, "penumbra:class", origin->equivalence_class);
	add_number(layout, "penumbra:samples", origin->samples);
	add_number(layout, "penumbra:frame", origin->frame);
}

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
		.linear = spec->format == PEN_IMAGE_EXR || spec->format == PEN_IMAGE_HDR,
		.final = spec->final,
	};

	if (spec->format == PEN_IMAGE_EXR || spec->format == PEN_IMAGE_PNG)
		add_origin(&layout, &spec->origin);
	add_channels(&layout, PEN_LAYER_COLOR, 3);
	if (spec->format == PEN_IMAGE_EXR || (spec->format == PEN_IMAGE_PNG && !opaque))
		layout.names[layout.channels++] = "A";
	if (spec->format != PEN_IMAGE_EXR)
		return layout;
	layout.window = spec->window;
	for (unsigned i = PEN_LAYER_ALBEDO; i < PEN_LAYERS; i++)
		if (spec->layers >> i & 1)
			add_channels(
				&layout, (enum pen_layer)i, pen_layer_channels((enum pen_layer)i));
	return layout;
}

static int encoding_init(struct encoding *encoding, int fd, struct pen_error *err)
{
	size_t width = pen_rect_width(encoding->layout.window);
	size_t channels = encoding->layout.channels;

	encoding->value_count = channels > 4 ? channels : 4;
	encoding->values = calloc(width, encoding->value_count * sizeof(float));
	encoding->pixels = calloc(width, channels * sizeof(float));
	if (!encoding->values || !encoding->pixels)
		return pen_error_memory(err);
	if (!encoding->layout.linear) {
		encoding->tonemap = malloc(sizeof *encoding->tonemap);
		if (!encoding->tonemap)
			return pen_error_memory(err);
		if (encoding->spec->is_plain)
			pen_tonemap_init_plain(encoding->tonemap);
		else
			pen_tonemap_init(encoding->tonemap, encoding->spec->exposure);
	}
	return pen_oiio_create(&encoding->layout, fd, &encoding->output, err);
}

static void encoding_finish(struct encoding *encoding)
{
	pen_oiio_destroy(encoding->output);
	free(encoding->tonemap);
	free(encoding->pixels);
	free(encoding->values);
}

static int encode_row(struct encoding *encoding, uint32_t y, struct pen_error *err)
{
	size_t width = pen_rect_width(encoding->layout.window);
	unsigned channels = encoding->layout.channels;
	float *pixels = encoding->pixels;

	if (encoding->tonemap) {
		pen_tonemap_row(
			encoding->tonemap, encoding->values, width, channels, encoding->pixels);
	} else {
		for (size_t x = 0; x < width; x++)
			memcpy(pixels + x * channels, encoding->values + x * encoding->value_count,
				channels * sizeof(float));
	}
	return pen_oiio_write(encoding->output, y, encoding->pixels, err);
}

static int encode_rows(
	struct encoding *encoding, pen_image_row_fn *row, void *user, struct pen_error *err)
{
	struct pen_rect stored = encoding->layout.window, window = encoding->spec->window;
	const size_t stride = encoding->value_count;
	size_t row_bytes = pen_rect_width(stored) * stride * sizeof(float);
	float *inside = encoding->values + stride * (window.x0 - stored.x0);
	int r = 0;

	for (uint32_t y = stored.y0; r == 0 && y < stored.y1; y++) {
		if (y >= window.y0 && y < window.y1)
			r = row(user, y, inside, err);
		else
			memset(encoding->values, 0, row_bytes);
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
