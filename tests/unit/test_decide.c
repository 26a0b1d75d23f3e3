/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "server/decide.h"

/* clang-format off */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
/* clang-format on */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { WIDTH = 53, HEIGHT = 41, PIXELS = WIDTH * HEIGHT };

/* A crop that no tile border meets. */
static const struct pen_rect crop = {7, 5, 7 + WIDTH, 5 + HEIGHT};

static struct pen_framebuf make_framebuf(enum pen_rounds_kind kind, uint32_t tile_px)
{
	struct pen_framebuf framebuf = {
		.film = pen_film_of(kind == PEN_ROUNDS_ADAPTIVE ? PEN_PLANE_MOMENTS : 0),
		.rounds = pen_rounds_of(kind, 256, 16),
		.threshold = 0.1,
		.error = 0.01,
		.confidence = 0.95,
	};

	pen_tiling_init(&framebuf.tiling, crop, tile_px);
	return framebuf;
}

static double noise(uint32_t *state)
{
	*state = *state * 1664525u + 1013904223u;
	return (double)(*state >> 8) / (1 << 24);
}

/* A file of the framebuffer that holds film, which is row by row. */
static int write_film(const struct pen_framebuf *framebuf, const float *film)
{
	const int fd = memfd_create("framebuffer", 0);
	const uint32_t channels = framebuf->film.channels;

	assert_true(fd >= 0);
	assert_int_equal(
		ftruncate(fd, (off_t)(pen_framebuf_bytes(framebuf) + pen_quota_bytes(framebuf))),
		0);
	for (uint32_t i = 0; i < framebuf->tiling.count; i++) {
		const struct pen_rect rect = pen_tiling_rect(&framebuf->tiling, i);
		off_t at = (off_t)(i * pen_framebuf_slot_bytes(framebuf));

		for (uint32_t y = rect.y0; y < rect.y1; y++) {
			const size_t bytes = pen_rect_width(rect) * channels * sizeof *film;
			const float *row = film + channels * ((size_t)(y - crop.y0) * WIDTH +
								     (rect.x0 - crop.x0));

			assert_int_equal(pwrite(fd, row, bytes, at), (ssize_t)bytes);
			at += (off_t)bytes;
		}
	}
	return fd;
}

/* Which pixels take part in a round, row by row. */
static void read_mask(const struct pen_quota *quota, uint32_t round, bool ret_mask[PIXELS])
{
	const struct pen_tiling *tiling = &quota->framebuf->tiling;
	uint8_t mask[PEN_MASK_BYTES_MAX];

	for (uint32_t i = 0; i < tiling->count; i++) {
		const struct pen_rect rect = pen_tiling_rect(tiling, i);
		size_t place = 0;

		assert_true(pen_quota_mask(quota, i, round, mask));
		for (uint32_t y = rect.y0; y < rect.y1; y++)
			for (uint32_t x = rect.x0; x < rect.x1; x++)
				ret_mask[(y - crop.y0) * WIDTH + (x - crop.x0)] =
					pen_mask_has(mask, place++);
	}
}

/* Decides once on film and compares with what the pixels should do. */
static void check(enum pen_rounds_kind kind, const float *film, const bool wanted[PIXELS])
{
	static const uint32_t sides[] = {16, 32, 48, 64};

	for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
		const struct pen_framebuf framebuf = make_framebuf(kind, sides[i]);
		const int fd = write_film(&framebuf, film);
		bool mask[PIXELS];
		struct pen_quota quota;

		assert_int_equal(pen_quota_init(&quota, &framebuf, NULL), 0);
		assert_int_equal(pen_decide(&quota, fd, NULL), 0);
		assert_int_equal(quota.decided, framebuf.rounds.sure);
		read_mask(&quota, framebuf.rounds.sure, mask);
		assert_memory_equal(mask, wanted, sizeof mask);
		pen_quota_finish(&quota);
		(void)close(fd);
	}
}

static double encode(double linear)
{
	const double v = linear > 0.0 ? (linear < 1.0 ? linear : 1.0) : 0.0;

	return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1.0 / 2.4) - 0.055;
}

static bool are_apart(const float *a, const float *b)
{
	double sum = 0.0;

	for (int c = 0; c < 3; c++)
		sum += pow(
			encode((double)a[c] / (double)a[3]) - encode((double)b[c] / (double)b[3]),
			2);
	return sqrt(sum) > 0.1;
}

/* Broken by a pair that is not looked at, above all across tiles, and by colours not encoded. */
static void edges_are_found(void **state)
{
	static float film[PIXELS * 4];
	static bool wanted[PIXELS];
	uint32_t seed = 1, count = 0;

	(void)state;
	for (size_t i = 0; i < PIXELS; i++) {
		const bool is_bright = (i % WIDTH) / 9 % 2 != (i / WIDTH) / 13 % 2;

		for (int c = 0; c < 3; c++)
			film[4 * i + (size_t)c] =
				(float)((is_bright ? 0.6 : 0.02) + 0.03 * noise(&seed));
		film[4 * i + 3] = 1.0f;
	}
	for (size_t i = 0; i < PIXELS; i++) {
		const float *pixel = film + 4 * i;

		if (i % WIDTH > 0 && are_apart(pixel, pixel - 4))
			wanted[i] = wanted[i - 1] = true;
		if (i >= WIDTH && are_apart(pixel, pixel - 4 * WIDTH))
			wanted[i] = wanted[i - WIDTH] = true;
	}
	for (size_t i = 0; i < PIXELS; i++)
		count += wanted[i];
	assert_in_range(count, PIXELS / 10, PIXELS / 2);
	check(PEN_ROUNDS_EDGE, film, wanted);
}

/* Of a channel, the mean over the 3x3 pixels around, those that there are. */
static double mean_around(const float *film, long x, long y, long c)
{
	double sum = 0.0, count = 0.0;

	for (long j = y - 1; j <= y + 1; j++)
		for (long i = x - 1; i <= x + 1; i++) {
			if (i < 0 || j < 0 || i >= WIDTH || j >= HEIGHT)
				continue;
			sum += (double)film[7 * (j * WIDTH + i) + 4 + c];
			count += 1.0;
		}
	return sum / count;
}

/* Of the largest channel; neighbours count by half. */
static double largest_around(const float *film, long x, long y)
{
	double largest = 0.0;

	for (long j = y - 1; j <= y + 1; j++)
		for (long i = x - 1; i <= x + 1; i++)
			for (long c = 0; c < 3; c++)
				if (i >= 0 && j >= 0 && i < WIDTH && j < HEIGHT)
					largest = fmax(largest, (i == x && j == y ? 1.0 : 0.5) *
									mean_around(film, i, j, c));
	return largest;
}

/* Broken by neighbours that are not looked at, above all across tiles, and by a wrong limit. */
static void errors_are_estimated(void **state)
{
	static float film[PIXELS * 7];
	static bool wanted[PIXELS];
	const double limit = pow(0.01 / 1.9599639845400545, 2) * -log(0.99);
	uint32_t seed = 1, count = 0;

	(void)state;
	for (size_t i = 0; i < PIXELS; i++) {
		film[7 * i + 3] = 16.0f;
		for (size_t c = 0; c < 3; c++)
			film[7 * i + 4 + c] = (float)(limit * 5.0 * pow(noise(&seed), 8));
	}
	for (long i = 0; i < PIXELS; i++) {
		wanted[i] = largest_around(film, i % WIDTH, i / WIDTH) >= limit;
		count += wanted[i];
	}
	assert_in_range(count, PIXELS / 10, 9 * PIXELS / 10);
	check(PEN_ROUNDS_ADAPTIVE, film, wanted);
}

/* Broken by a pixel that comes back after it has stopped, or that stops after more than it had. */
static void pixels_stop_for_good(void **state)
{
	static float film[PIXELS * 7];
	const struct pen_framebuf framebuf = make_framebuf(PEN_ROUNDS_ADAPTIVE, 32);
	bool before[PIXELS], after[PIXELS];
	struct pen_quota quota;
	int fd;

	(void)state;
	assert_int_equal(pen_quota_init(&quota, &framebuf, NULL), 0);
	for (size_t i = 0; i < PIXELS; i++) {
		film[7 * i + 3] = 16.0f;
		film[7 * i + 4] = i % WIDTH < WIDTH / 2 ? 1.0f : 0.0f;
	}
	fd = write_film(&framebuf, film);
	assert_int_equal(pen_decide(&quota, fd, NULL), 0);
	(void)close(fd);
	read_mask(&quota, 1, before);
	assert_true(before[0] && !before[WIDTH - 1]);
	for (size_t i = 0; i < PIXELS; i++)
		film[7 * i + 4] = i / WIDTH < HEIGHT / 2 ? 1.0f : 0.0f;
	fd = write_film(&framebuf, film);
	assert_int_equal(pen_decide(&quota, fd, NULL), 0);
	(void)close(fd);
	read_mask(&quota, 1, after);
	assert_memory_equal(before, after, sizeof before);
	read_mask(&quota, 2, after);
	assert_true(after[0] && !after[WIDTH - 1] && !after[PIXELS - WIDTH]);
	pen_quota_finish(&quota);
}

/* Broken by a series that is cut off early: against the C library, which the server avoids. */
static void functions_without_libm(void **state)
{
	static const struct {
		double confidence, deviations;
	} known[] = {{0.5, 0.6744897501960817}, {0.6826894921370859, 1.0},
		{0.95, 1.9599639845400545}, {0.99, 2.5758293035489004},
		{0.999999, 4.891638475698708}};

	static const struct {
		uint32_t blocks;
		double confidence, quantile; /* of chi-squared with 2 * blocks degrees */
	} shares[] = {{1, 0.95, 0.102587}, {2, 0.95, 0.710723}, {16, 0.95, 20.0719},
		{16, 0.99, 16.3622}, {64, 0.95, 102.867}, {65, 0.95, 104.662},
		{1000, 0.95, 1897.27}};

	(void)state;
	for (int i = -10; i <= 1010; i++) {
		const double linear = i / 1000.0;

		assert_true(fabs(pen_decide_encode(linear) - encode(linear)) < 1e-12);
		assert_true(fabs(pen_decide_encode(linear / 300) - encode(linear / 300)) < 1e-12);
	}
	assert_true(pen_decide_encode((double)NAN) == 0.0);
	for (size_t i = 0; i < sizeof shares / sizeof *shares; i++)
		assert_true(fabs(pen_decide_least_share(shares[i].blocks, shares[i].confidence) -
				    shares[i].quantile / (2 * shares[i].blocks)) < 2e-4);
	for (size_t i = 0; i < sizeof known / sizeof *known; i++)
		assert_true(fabs(pen_decide_deviations(known[i].confidence) - known[i].deviations) <
			    1e-6);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(edges_are_found),
		cmocka_unit_test(errors_are_estimated),
		cmocka_unit_test(pixels_stop_for_good),
		cmocka_unit_test(functions_without_libm),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
