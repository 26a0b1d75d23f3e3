/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "core/image/codec.h"
#include "core/image/essence.h"
#include "core/image/mipmap.h"
#include "core/image/picture.h"
#include "core/image/probe.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 37, HEIGHT = 23, FILE_MAX = 1 << 16 };

struct file {
	uint8_t bytes[FILE_MAX];
	size_t size;
};

/* A gradient; linear light. */
static int row_of_gradient(void *user, uint32_t y, float *ret_rgba, struct pen_error *err)
{
	(void)user;
	(void)err;
	for (uint32_t x = 0; x < WIDTH; x++) {
		ret_rgba[4 * x] = (float)x / WIDTH;
		ret_rgba[4 * x + 1] = (float)y / HEIGHT;
		ret_rgba[4 * x + 2] = 0.25f;
		ret_rgba[4 * x + 3] = 1.0f;
	}
	return 0;
}

static void encode(enum pen_image_format format, struct file *ret_file)
{
	const struct pen_image_spec spec = {
		.format = format,
		.width = WIDTH,
		.height = HEIGHT,
		.window = {0, 0, WIDTH, HEIGHT},
		.final = true,
	};
	struct pen_error err = PEN_ERROR_INIT;
	const int fd = memfd_create("picture", 0);
	uint64_t size;

	assert_true(fd >= 0);
	assert_int_equal(pen_image_encode(&spec, row_of_gradient, NULL, fd, &size, &err), 0);
	assert_true(size <= FILE_MAX);
	ret_file->size = (size_t)size;
	assert_int_equal(pread(fd, ret_file->bytes, ret_file->size, 0), (ssize_t)size);
	(void)close(fd);
}

static struct pen_mipmap *load(const struct file *file, bool is_srgb)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_picture picture = {0};
	struct pen_mipmap *mipmap = NULL;

	if (pen_picture_decode(file->bytes, file->size, &picture, &err) < 0)
		fail_msg("%s", err.text);
	assert_int_equal(picture.width, WIDTH);
	assert_int_equal(picture.height, HEIGHT);
	assert_int_equal(pen_mipmap_create(&picture, is_srgb, &mipmap, &err), 0);
	return mipmap;
}

/* What the encoder writes comes back: broken by a wrong curve, swapped channels or rows. */
static void formats_come_back(void **state)
{
	static const double tolerances[PEN_IMAGE_FORMATS] = {0.005, 0.04, 1e-6, 0.005};
	static struct file file;

	(void)state;
	for (int format = 0; format < PEN_IMAGE_FORMATS; format++) {
		struct pen_mipmap *mipmap;

		encode((enum pen_image_format)format, &file);
		mipmap = load(&file, true);
		for (uint32_t y = 0; y < HEIGHT; y++) {
			for (uint32_t x = 0; x < WIDTH; x++) {
				const struct pen_texel t =
					pen_mipmap_fetch(mipmap, &mipmap->levels[0], x, y);

				if (fabs((double)t.red - (double)x / WIDTH) > tolerances[format] ||
					fabs((double)t.green - (double)y / HEIGHT) >
						tolerances[format] ||
					t.alpha != 1.0f)
					fail_msg("format %d at %u %u: %g %g %g", format, x, y,
						(double)t.red, (double)t.green, (double)t.alpha);
			}
		}
		pen_mipmap_destroy(mipmap);
	}
}

/* Averages in linear light keep the mean: sRGB averaged as it is stored comes out darker. */
static void averages_keep_the_mean(void **state)
{
	static struct file file;
	struct pen_mipmap *mipmap;
	const struct pen_mip_level *last;
	double mean = 0.0;

	(void)state;
	encode(PEN_IMAGE_PNG, &file);
	mipmap = load(&file, true);
	last = &mipmap->levels[mipmap->level_count - 1];
	assert_int_equal(last->width, 1);
	assert_int_equal(last->height, 1);
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
		mean += (double)pen_mipmap_fetch(mipmap, &mipmap->levels[0], i % WIDTH, i / WIDTH)
				.red;
	mean /= WIDTH * HEIGHT;
	assert_float_equal(pen_mipmap_fetch(mipmap, last, 0, 0).red, (float)mean, 0.01f);
	pen_mipmap_destroy(mipmap);
}

/* An EXR of the linear kind is not decoded as sRGB, whatever a texture says. */
static void floats_are_linear(void **state)
{
	static struct file file;
	struct pen_mipmap *mipmap;

	(void)state;
	encode(PEN_IMAGE_EXR, &file);
	mipmap = load(&file, true);
	assert_int_equal(mipmap->type, PEN_TEXEL_FLOATS);
	assert_float_equal(pen_mipmap_fetch(mipmap, &mipmap->levels[0], 0, 0).blue, 0.25f, 1e-6f);
	pen_mipmap_destroy(mipmap);
}

/* Values that are not finite, as EXR can hold them, would become NaN pixels. */
static void wild_values_are_tamed(void **state)
{
	static struct file file;
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_picture picture = {0};
	const uint8_t infinity[] = {0x00, 0x00, 0x80, 0x7f}, nan[] = {0x00, 0x00, 0xc0, 0x7f};
	/* An uncompressed EXR of one pixel, floats A B G R. */
	static const char header[] =
		"\x76\x2f\x31\x01\x02\0\0\0"
		"channels\0chlist\0\x37\0\0\0"
		"B\0\x02\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\0"
		"G\0\x02\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\0"
		"R\0\x02\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\0\0"
		"compression\0compression\0\x01\0\0\0\0"
		"dataWindow\0box2i\0\x10\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0"
		"displayWindow\0box2i\0\x10\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0"
		"lineOrder\0lineOrder\0\x01\0\0\0\0"
		"pixelAspectRatio\0float\0\x04\0\0\0\0\0\x80\x3f"
		"screenWindowCenter\0v2f\0\x08\0\0\0\0\0\0\0\0\0\0\0"
		"screenWindowWidth\0float\0\x04\0\0\0\0\0\x80\x3f";
	const size_t at = sizeof header; /* with the NUL that ends the header */
	const float *texel;

	(void)state;
	memset(&file, 0, sizeof file);
	memcpy(file.bytes, header, sizeof header);
	file.bytes[at] = (uint8_t)((at + 8) & 0xff);
	file.bytes[at + 1] = (uint8_t)((at + 8) >> 8);
	file.bytes[at + 12] = 12;
	memcpy(file.bytes + at + 16, infinity, 4);
	memcpy(file.bytes + at + 20, nan, 4);
	memcpy(file.bytes + at + 24, "\0\0\x80\xbf", 4); /* -1 */
	file.size = at + 28;
	if (pen_picture_decode(file.bytes, file.size, &picture, &err) < 0)
		fail_msg("%s", err.text);
	texel = picture.texels;
	assert_true(texel[0] == 0.0f && texel[1] == 0.0f);
	assert_true(texel[2] == PEN_TEXEL_MAX && texel[3] == 1.0f);
	pen_picture_finish(&picture);
}

static void big_endian(uint8_t *to, uint32_t value)
{
	for (int i = 0; i < 4; i++)
		to[i] = (uint8_t)(value >> (24 - 8 * i));
}

static int probe_png(uint32_t width, uint32_t height)
{
	uint8_t header[33] = "\x89PNG\r\n\x1a\n\0\0\0\rIHDR";
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_probe probe;

	big_endian(header + 16, width);
	big_endian(header + 20, height);
	return pen_probe(header, sizeof header, &probe, &err);
}

/* Each limit one below, at and one above it: broken by < in the place of <=. */
static void sizes_have_limits(void **state)
{
	const uint32_t side = PEN_PICTURE_SIDE_MAX, area = PEN_PICTURE_PIXELS_MAX;

	(void)state;
	assert_int_equal(probe_png(side - 1, 1), 0);
	assert_int_equal(probe_png(side, 1), 0);
	assert_int_equal(probe_png(side + 1, 1), PEN_ELIMIT);
	assert_int_equal(probe_png(1, side), 0);
	assert_int_equal(probe_png(1, side + 1), PEN_ELIMIT);
	assert_int_equal(probe_png(area / side, side), 0);
	assert_int_equal(probe_png(area / side + 1, side), PEN_ELIMIT);
	assert_int_equal(probe_png(65536, 65536), PEN_ELIMIT);
	assert_int_equal(probe_png(UINT32_MAX, UINT32_MAX), PEN_ELIMIT);
	assert_int_equal(probe_png(0, 1), PEN_EINVALID);
}

static int probe_text(const void *bytes, size_t size)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_probe probe;

	return pen_probe(bytes, size, &probe, &err);
}

/* Huge headers of the other formats: a library would reserve memory for them at once. */
static void huge_headers_are_refused(void **state)
{
	static const char hdr[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 65536 +X 65536\n";
	static const char jpeg[] = "\xff\xd8\xff\xc2\0\x11\x08\xff\xff\xff\xff\x03\x01\x22\0\x02"
				   "\x11\x01\x03\x11\x01\xff\xda\0\x0c\x03\x01\0\x02\x11\x03\x11"
				   "\0\x3f\0";
	static const char exr[] = "\x76\x2f\x31\x01\x02\0\0\0dataWindow\0box2i\0\x10\0\0\0"
				  "\0\0\0\x80\0\0\0\x80\xff\xff\xff\x7f\xff\xff\xff\x7f";
	static const char parts[] = "\x76\x2f\x31\x01\x02\x10\0\0";

	(void)state;
	assert_int_equal(probe_text(hdr, sizeof hdr - 1), PEN_ELIMIT);
	assert_int_equal(probe_text(jpeg, sizeof jpeg - 1), PEN_ELIMIT);
	assert_int_equal(probe_text(exr, sizeof exr), PEN_ELIMIT);
	assert_int_equal(probe_text(parts, sizeof parts), PEN_EUNSUPPORTED);
	assert_int_equal(probe_text("GIF89a", 6), PEN_EUNSUPPORTED);
	assert_int_equal(probe_text("", 0), PEN_EUNSUPPORTED);
}

/* A JPEG of endless scans: every one costs a pass over the picture. */
static void scans_have_a_limit(void **state)
{
	static const uint8_t scan[] = {0xff, 0xda, 0, 2};
	static struct file file;
	static const uint32_t counts[] = {
		PEN_PICTURE_SCANS_MAX - 1, PEN_PICTURE_SCANS_MAX, PEN_PICTURE_SCANS_MAX + 1};

	(void)state;
	for (int k = 0; k < 3; k++) {
		memcpy(file.bytes, "\xff\xd8\xff\xc2\0\x11\x08\0\x08\0\x08", 11);
		file.size = 4 + 17;
		for (uint32_t i = 0; i < counts[k]; i++, file.size += sizeof scan)
			memcpy(file.bytes + file.size, scan, sizeof scan);
		assert_int_equal(probe_text(file.bytes, file.size), k < 2 ? 0 : PEN_ELIMIT);
	}
}

static uint32_t random_next(uint32_t *state)
{
	*state = *state * 1664525u + 1013904223u;
	return *state >> 8;
}

/* One of: a byte changed, a length made huge, an end cut off, a stretch moved or removed. */
static void mutate(struct file *file, uint32_t *random)
{
	const uint32_t at = random_next(random) % (uint32_t)file->size;
	const uint32_t from = random_next(random) % (uint32_t)file->size;
	const uint32_t lower = at < from ? at : from, upper = at < from ? from : at;

	switch (random_next(random) % 5) {
	case 0: file->bytes[at] = (uint8_t)random_next(random); break;
	case 1: memset(file->bytes + at, 0xff, file->size - at < 4 ? file->size - at : 4); break;
	case 2: file->size = at > 0 ? at : 1; break;
	case 3: memmove(file->bytes + lower, file->bytes + upper, file->size - upper); break;
	default:
		memmove(file->bytes + lower, file->bytes + upper, file->size - upper);
		file->size -= upper - lower;
	}
}

/*
 * 1,200 damaged files, 300 a format, by seed: each is refused in words or becomes a picture within
 * the limits. Broken by whatever crashes, hangs, leaks (under ASan) or asks for much memory.
 */
static void damaged_files_do_no_harm(void **state)
{
	static struct file whole, file;
	uint32_t decoded = 0, refused = 0;
	struct rusage usage;

	(void)state;
	for (uint32_t i = 0; i < 1200; i++) {
		struct pen_error err = PEN_ERROR_INIT;
		struct pen_picture picture = {0};
		uint32_t random = i;
		int r;

		if (i % 300 == 0)
			encode((enum pen_image_format)(i / 300), &whole);
		file = whole;
		for (uint32_t k = 0; k <= i % 4; k++)
			mutate(&file, &random);
		r = pen_picture_decode(file.bytes, file.size, &picture, &err);
		if (r == 0) {
			assert_true(picture.width <= PEN_PICTURE_SIDE_MAX);
			assert_true(
				(uint64_t)picture.width * picture.height <= PEN_PICTURE_PIXELS_MAX);
			decoded++;
			pen_picture_finish(&picture);
		} else {
			assert_true(err.text[0] != '\0');
			refused++;
		}
	}
	/* Either alone would mean that the mutations do nothing, or everything. */
	assert_true(decoded > 50 && refused > 300);
	assert_int_equal(getrusage(RUSAGE_SELF, &usage), 0);
	assert_true(usage.ru_maxrss < 3 << 20);
}

/* Puts bytes into a file. */
static void insert(struct file *file, size_t at, const char *bytes, size_t size)
{
	assert_true(file->size + size <= FILE_MAX);
	memmove(file->bytes + at + size, file->bytes + at, file->size - at);
	memcpy(file->bytes + at, bytes, size);
	file->size += size;
}

static void take_essence(enum pen_image_format format, const struct file *file, struct file *ret)
{
	struct pen_error err = PEN_ERROR_INIT;
	const void *bytes;
	void *copy = NULL;

	assert_int_equal(
		pen_essence(format, file->bytes, file->size, &bytes, &ret->size, &copy, &err), 0);
	memcpy(ret->bytes, bytes, ret->size);
	free(copy);
}

/*
 * Broken by what a library reads of a file without need: Exif that leads it in circles, IPTC whose
 * length is a lie, texts that inflate without end. What is cut off stays, and is found out later.
 */
static void only_pixels_reach_the_library(void **state)
{
	static const char text[] = "\0\0\0\4eXIfabcd\1\2\3\4", critical[] = "\0\0\0\0ABCD\1\2\3\4";
	static const char iptc[] = "\xff\xed\0\6abcd\xff\xfe\0\2", adobe[] = "\xff\xee\0\3a";
	static struct file whole, more, plain, found;

	(void)state;
	encode(PEN_IMAGE_PNG, &whole);
	take_essence(PEN_IMAGE_PNG, &whole, &plain);
	more = whole;
	insert(&more, 33, text, sizeof text - 1);
	take_essence(PEN_IMAGE_PNG, &more, &found);
	assert_int_equal(found.size, plain.size);
	assert_memory_equal(found.bytes, plain.bytes, plain.size);
	insert(&more, 33, critical, sizeof critical - 1);
	more.size -= 3;
	take_essence(PEN_IMAGE_PNG, &more, &found);
	assert_int_equal(found.size, plain.size + sizeof critical - 1 - 3);

	encode(PEN_IMAGE_JPEG, &whole);
	take_essence(PEN_IMAGE_JPEG, &whole, &plain);
	more = whole;
	insert(&more, 2, iptc, sizeof iptc - 1);
	take_essence(PEN_IMAGE_JPEG, &more, &found);
	assert_int_equal(found.size, plain.size);
	assert_memory_equal(found.bytes, plain.bytes, plain.size);
	insert(&more, 2, adobe, sizeof adobe - 1);
	take_essence(PEN_IMAGE_JPEG, &more, &found);
	assert_int_equal(found.size, plain.size + sizeof adobe - 1);

	encode(PEN_IMAGE_EXR, &whole);
	take_essence(PEN_IMAGE_EXR, &whole, &found);
	assert_int_equal(found.size, whole.size);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(formats_come_back),
		cmocka_unit_test(averages_keep_the_mean),
		cmocka_unit_test(floats_are_linear),
		cmocka_unit_test(wild_values_are_tamed),
		cmocka_unit_test(sizes_have_limits),
		cmocka_unit_test(huge_headers_are_refused),
		cmocka_unit_test(scans_have_a_limit),
		cmocka_unit_test(damaged_files_do_no_harm),
		cmocka_unit_test(only_pixels_reach_the_library),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
