/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/probe.h"

#include "core/base/limits.h"

#include <stdbool.h>
#include <string.h>

/* Bytes still to be read; reading past the end gives zeros and is remembered. */
struct cursor {
	const uint8_t *at, *end;
	bool is_short;
};

static const uint8_t *take(struct cursor *c, size_t count)
{
	static const uint8_t zeros[8];
	const uint8_t *at = c->at;

	if ((size_t)(c->end - c->at) < count) {
		c->is_short = true;
		c->at = c->end;
		return zeros;
	}
	c->at += count;
	return at;
}

static uint32_t big_endian(struct cursor *c, unsigned count)
{
	const uint8_t *at = take(c, count);
	uint32_t value = 0;

	for (unsigned i = 0; i < count; i++)
		value = value << 8 | at[i];
	return value;
}

static uint32_t little_endian(struct cursor *c)
{
	const uint8_t *at = take(c, 4);

	return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 |
	       (uint32_t)at[3] << 24;
}

static int damaged(struct pen_error *err, const char *format)
{
	return pen_error_set(err, PEN_EINVALID, "its %s header is damaged", format);
}

static int probe_png(struct cursor *c, struct pen_probe *ret, struct pen_error *err)
{
	const uint8_t *type;

	(void)take(c, 8 + 4);
	type = take(c, 4);
	if (memcmp(type, "IHDR", 4) != 0)
		return damaged(err, "PNG");
	ret->width = big_endian(c, 4);
	ret->height = big_endian(c, 4);
	return c->is_short ? damaged(err, "PNG") : 0;
}

/* Start of frame, but not the tables and arithmetic conditions between their codes. */
static bool is_frame(uint32_t marker)
{
	return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 &&
	       marker != 0xcc;
}

/* A marker's code, past whatever is between; 0 at the end. */
static uint32_t next_marker(struct cursor *c)
{
	while (c->at < c->end) {
		const uint8_t *found = memchr(c->at, 0xff, (size_t)(c->end - c->at));

		if (!found || c->end - found < 2)
			break;
		c->at = found + 1;
		while (c->at < c->end && *c->at == 0xff)
			c->at++;
		if (c->at < c->end && *c->at++ != 0)
			return c->at[-1];
	}
	return 0;
}

/*
 * Every scan of a progressive file passes over the whole picture, however few bytes it has: their
 * number is the time that it takes.
 */
static int probe_jpeg(struct cursor *c, struct pen_probe *ret, struct pen_error *err)
{
	uint32_t scans = 0, frames = 0, marker;

	while ((marker = next_marker(c)) != 0 && marker != 0xd9) {
		const uint8_t *segment = c->at;
		uint32_t length;

		if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8))
			continue;
		length = big_endian(c, 2);
		if (is_frame(marker)) {
			(void)take(c, 1);
			ret->height = big_endian(c, 2);
			ret->width = big_endian(c, 2);
			frames++;
		}
		scans += marker == 0xda;
		if (length < 2 || length > (size_t)(c->end - segment))
			break;
		c->at = segment + length;
	}
	if (frames != 1 || scans == 0)
		return damaged(err, "JPEG");
	if (scans > PEN_PICTURE_SCANS_MAX)
		return pen_error_set(
			err, PEN_ELIMIT, "it has more than %u scans", PEN_PICTURE_SCANS_MAX);
	return 0;
}

/* A string with its NUL; NULL when there is none within what is left. */
static const char *take_string(struct cursor *c)
{
	const uint8_t *end = memchr(c->at, 0, (size_t)(c->end - c->at));

	return end ? (const char *)take(c, (size_t)(end - c->at) + 1) : NULL;
}

/* Pixels from low to high, both counted; 0 when they are in the wrong order. */
static uint32_t extent(uint32_t low, uint32_t high)
{
	const int64_t count = (int64_t)(int32_t)high - (int64_t)(int32_t)low + 1;

	return count < 0 ? 0 : count > UINT32_MAX ? UINT32_MAX : (uint32_t)count;
}

static int exr_attribute(struct cursor *c, const char *name, const char *type, uint32_t size,
	struct pen_probe *ret, struct pen_error *err)
{
	struct cursor value = {c->at, c->end, false};

	(void)take(c, size);
	if (c->is_short)
		return damaged(err, "EXR");
	if (strcmp(name, "dataWindow") == 0 && strcmp(type, "box2i") == 0 && size == 16) {
		const uint32_t x0 = little_endian(&value), y0 = little_endian(&value);
		const uint32_t x1 = little_endian(&value), y1 = little_endian(&value);

		ret->width = extent(x0, x1);
		ret->height = extent(y0, y1);
	}
	if (strcmp(name, "tiles") == 0) {
		const uint32_t x = little_endian(&value), y = little_endian(&value);

		if (x == 0 || y == 0 || x > PEN_PICTURE_SIDE_MAX || y > PEN_PICTURE_SIDE_MAX)
			return pen_error_set(err, PEN_ELIMIT, "its tiles are too large");
	}
	return 0;
}

enum { EXR_DEEP = 0x800, EXR_PARTS = 0x1000 };

static int probe_exr(struct cursor *c, struct pen_probe *ret, struct pen_error *err)
{
	(void)take(c, 4);
	if (little_endian(c) & (EXR_DEEP | EXR_PARTS))
		return pen_error_set(err, PEN_EUNSUPPORTED,
			"it is a deep EXR file or one of several parts; save it as a flat one");
	for (;;) {
		const char *name = take_string(c);
		const char *type = name && name[0] != '\0' ? take_string(c) : name;
		int r;

		if (!type)
			return damaged(err, "EXR");
		if (name[0] == '\0')
			return ret->width == 0 || ret->height == 0 ? damaged(err, "EXR") : 0;
		r = exr_attribute(c, name, type, little_endian(c), ret, err);
		if (r < 0)
			return r;
	}
}

/* A line without its end; NULL when it is longer than a header's lines are. */
static const char *take_line(struct cursor *c, size_t *ret_length)
{
	const size_t left = (size_t)(c->end - c->at);
	const char *line = (const char *)c->at;
	const uint8_t *end = memchr(c->at, '\n', left < 4096 ? left : 4096);

	if (!end)
		return NULL;
	*ret_length = (size_t)(end - c->at);
	c->at = end + 1;
	return line;
}

static uint32_t hdr_number(const char **at, const char *end, const char *before)
{
	const size_t length = strlen(before);
	uint32_t value = 0;

	if ((size_t)(end - *at) < length || memcmp(*at, before, length) != 0)
		return 0;
	*at += length;
	while (*at < end && **at >= '0' && **at <= '9' && value < 100000000u)
		value = value * 10 + (uint32_t)(*(*at)++ - '0');
	return value;
}

/* Lines down to an empty one, then "-Y height +X width". */
static int probe_hdr(struct cursor *c, struct pen_probe *ret, struct pen_error *err)
{
	const char *line;
	size_t length = 1;

	do {
		line = take_line(c, &length);
		if (!line)
			return damaged(err, "HDR");
	} while (length > 0);
	line = take_line(c, &length);
	if (!line)
		return damaged(err, "HDR");

	const char *const end = line + length;

	ret->height = hdr_number(&line, end, "-Y ");
	ret->width = hdr_number(&line, end, " +X ");
	return ret->width == 0 || ret->height == 0 ? damaged(err, "HDR") : 0;
}

typedef int probe_fn(struct cursor *c, struct pen_probe *ret, struct pen_error *err);

static const struct {
	enum pen_image_format format;
	const char *magic;
	size_t length;
	probe_fn *probe;
} formats[] = {
	{PEN_IMAGE_PNG, "\x89PNG\r\n\x1a\n", 8, probe_png},
	{PEN_IMAGE_JPEG, "\xff\xd8\xff", 3, probe_jpeg},
	{PEN_IMAGE_EXR, "\x76\x2f\x31\x01", 4, probe_exr},
	{PEN_IMAGE_HDR, "#?RADIANCE\n", 11, probe_hdr},
	{PEN_IMAGE_HDR, "#?RGBE\n", 7, probe_hdr},
};

static int check(const struct pen_probe *probe, struct pen_error *err)
{
	if (probe->width == 0 || probe->height == 0)
		return pen_error_set(err, PEN_EINVALID, "it has no pixels");
	if (probe->width > PEN_PICTURE_SIDE_MAX || probe->height > PEN_PICTURE_SIDE_MAX ||
		(uint64_t)probe->width * probe->height > PEN_PICTURE_PIXELS_MAX)
		return pen_error_set(err, PEN_ELIMIT,
			"it has %u x %u pixels; %u a side and %u in all are the limit",
			probe->width, probe->height, PEN_PICTURE_SIDE_MAX, PEN_PICTURE_PIXELS_MAX);
	return 0;
}

int pen_probe(const void *bytes, size_t size, struct pen_probe *ret_probe, struct pen_error *err)
{
	struct cursor c = {bytes, (const uint8_t *)bytes + size, false};

	for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
		struct pen_probe probe = {.format = formats[i].format};
		int r;

		if (size < formats[i].length ||
			memcmp(bytes, formats[i].magic, formats[i].length) != 0)
			continue;
		r = formats[i].probe(&c, &probe, err);
		if (r == 0)
			r = check(&probe, err);
		if (r == 0)
			*ret_probe = probe;
		return r;
	}
	return pen_error_set(err, PEN_EUNSUPPORTED,
		"it is not a PNG, JPEG, EXR or HDR image; convert it to one");
}
