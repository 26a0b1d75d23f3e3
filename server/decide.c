/* SPDX-License-Identifier: Apache-2.0 */
#include "server/decide.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum {
	BLOCK_SAMPLES = 16,
	CHANNELS = 3,
	LOOKS = 5 /* how often a pixel is looked at, about; they share the chance of being wrong */
};

/* A frame that is gone through row by row, with the two rows before at hand. */
struct scan {
	struct pen_quota *quota;
	struct pen_framebuf_rows rows;
	uint32_t width, height; /* of the crop */
	float *film;		/* a row of the framebuffer */
	float *means[3], *spread[3];
};

double pen_decide_encode(double linear)
{
	double root, cube;

	if (!(linear > 0.0))
		return 0.0;
	if (linear >= 1.0)
		return 1.0;
	if (linear <= 0.0031308)
		return 12.92 * linear;
	/* x^(5/12) = x^(1/4) * (x^(1/2))^(1/3), the cube root by Newton's iteration. */
	root = __builtin_sqrt(linear);
	cube = 0.3 + 0.7 * root;
	for (int i = 0; i < 8; i++)
		cube -= (cube - root / (cube * cube)) / 3.0;
	return 1.055 * __builtin_sqrt(root) * cube - 0.055;
}

/* exp(-x), 0 <= x, by halving the argument and squaring the result. */
static double decay(double x)
{
	double term = 1.0, sum = 1.0, y = x / 1024.0;

	for (int i = 1; i < 12; i++) {
		term *= -y / i;
		sum += term;
	}
	for (int i = 0; i < 10; i++)
		sum *= sum;
	return sum;
}

/* The chance that a normal variable stays within z deviations (Marsaglia 2004, his series). */
static double chance_within(double z)
{
	double term = z, sum = z;

	for (int i = 3; i < 400; i += 2) {
		term *= z * z / i;
		sum += term;
	}
	return 2.0 * sum * decay(0.5 * z * z) * 0.39894228040143267794;
}

double pen_decide_deviations(double confidence)
{
	double low = 0.0, high = 8.0;

	for (int i = 0; i < 60; i++) {
		const double z = 0.5 * (low + high);

		if (chance_within(z) < confidence)
			low = z;
		else
			high = z;
	}
	return high;
}

/* The chance that a chi-squared variable of 2 * count degrees of freedom exceeds 2 * x. */
static double chance_beyond(uint32_t count, double x)
{
	double term = 1.0, sum = 1.0;

	for (uint32_t i = 1; i < count; i++) {
		term *= x / i;
		sum += term;
	}
	return decay(x) * sum;
}

double pen_decide_least_share(uint32_t blocks, double confidence)
{
	double low = 0.0, high = blocks;

	assert(confidence > 0.5);
	if (blocks > 64) { /* Wilson and Hilferty 1931 */
		const double variance = 1.0 / (9.0 * blocks);
		const double root =
			1.0 - variance -
			pen_decide_deviations(2.0 * confidence - 1.0) * __builtin_sqrt(variance);

		return root * root * root;
	}
	for (int i = 0; i < 60; i++) {
		const double x = 0.5 * (low + high);

		if (chance_beyond(blocks, x) > confidence)
			low = x;
		else
			high = x;
	}
	return low / blocks;
}

/* Where the rounds of the pixel at (x, y) of the crop stand. */
static uint8_t *rounds_at(const struct scan *scan, uint32_t x, uint32_t y)
{
	const struct pen_tiling *tiling = &scan->quota->framebuf->tiling;
	const uint32_t px = tiling->tile_px;
	const uint32_t column = (tiling->crop.x0 + x) / px - tiling->crop.x0 / px;
	const uint32_t row = (tiling->crop.y0 + y) / px - tiling->crop.y0 / px;
	const uint32_t tile = row * tiling->columns + column;
	const struct pen_rect rect = pen_tiling_rect(tiling, tile);

	return scan->quota->rounds + (size_t)tile * px * px +
	       (size_t)(tiling->crop.y0 + y - rect.y0) * pen_rect_width(rect) +
	       (tiling->crop.x0 + x - rect.x0);
}

/* Edges */

static void encode_row(const struct scan *scan, float *ret_colors)
{
	const struct pen_film *film = &scan->quota->framebuf->film;

	for (uint32_t x = 0; x < scan->width; x++) {
		const float *pixel = scan->film + (size_t)x * film->channels;

		for (uint32_t c = 0; c < CHANNELS; c++)
			ret_colors[CHANNELS * (size_t)x + c] = (float)pen_decide_encode(
				(double)pixel[c] / (double)pixel[PEN_CHANNEL_COUNT]);
	}
}

static bool differs(const struct scan *scan, const float *a, const float *b)
{
	const double threshold = scan->quota->framebuf->threshold;
	double sum = 0.0;

	for (uint32_t c = 0; c < CHANNELS; c++)
		sum += ((double)a[c] - (double)b[c]) * ((double)a[c] - (double)b[c]);
	return sum > threshold * threshold;
}

static void mark(const struct scan *scan, uint32_t x, uint32_t y)
{
	*rounds_at(scan, x, y) = PEN_QUOTA_ALL;
}

static int decide_edges(struct scan *scan, struct pen_error *err)
{
	int r = 0;

	for (uint32_t y = 0; r == 0 && y < scan->height; y++) {
		float *row = scan->means[y % 2], *above = scan->means[(y + 1) % 2];

		r = pen_framebuf_row(&scan->rows, y, scan->film, err);
		if (r < 0)
			break;
		encode_row(scan, row);
		for (uint32_t x = 0; x < scan->width; x++) {
			const float *color = row + CHANNELS * (size_t)x;

			if (x > 0 && differs(scan, color, color - CHANNELS)) {
				mark(scan, x, y);
				mark(scan, x - 1, y);
			}
			if (y > 0 && differs(scan, color, above + CHANNELS * (size_t)x)) {
				mark(scan, x, y);
				mark(scan, x, y - 1);
			}
		}
	}
	return r;
}

/* Errors */

/* Variances of a block's mean, as each pixel alone has them. */
static void variance_row(const struct scan *scan, float *ret_variances)
{
	const struct pen_film *film = &scan->quota->framebuf->film;

	for (uint32_t x = 0; x < scan->width; x++) {
		const float *pixel = scan->film + (size_t)x * film->channels;
		const float blocks = pixel[PEN_CHANNEL_COUNT] / BLOCK_SAMPLES;

		for (uint32_t c = 0; c < CHANNELS; c++)
			ret_variances[CHANNELS * (size_t)x + c] = pixel[film->moments + c] / blocks;
	}
}

/* One channel over 3x3 places of three rows, absent ones left out. */
static float mean_around(const struct scan *scan, float *const rows[3], uint32_t x, uint32_t c)
{
	float sum = 0.0f, count = 0.0f;

	for (uint32_t k = 0; k < 3; k++)
		for (uint32_t i = x > 0 ? x - 1 : 0; rows[k] && i <= x + 1 && i < scan->width;
			i++) {
			sum += rows[k][CHANNELS * (size_t)i + c];
			count += 1.0f;
		}
	return sum / count;
}

/* What a pixel's variance counts as: its own estimate, or half of the largest around it. */
static float doubted(const struct scan *scan, float *const rows[3], uint32_t x)
{
	float largest = 2.0f * rows[1][x];

	for (uint32_t k = 0; k < 3; k++)
		for (uint32_t i = x > 0 ? x - 1 : 0; rows[k] && i <= x + 1 && i < scan->width; i++)
			if (rows[k][i] > largest)
				largest = rows[k][i];
	return 0.5f * largest;
}

/* Three neighbouring rows of a ring around row y; NULL where the image has ended. */
static void rows_around(float *const ring[3], uint32_t y, uint32_t height, float *ret_rows[3])
{
	for (uint32_t k = 0; k < 3; k++)
		ret_rows[k] = y + k == 0 || y + k > height ? NULL : ring[(y + k - 1) % 3];
}

/* The largest channel of the means around each pixel of row y. */
static void spread_row(const struct scan *scan, uint32_t y)
{
	float *rows[3], *to = scan->spread[y % 3];

	rows_around(scan->means, y, scan->height, rows);
	for (uint32_t x = 0; x < scan->width; x++) {
		to[x] = 0.0f;
		for (uint32_t c = 0; c < CHANNELS; c++) {
			const float mean = mean_around(scan, rows, x, c);

			if (mean > to[x])
				to[x] = mean;
		}
	}
}

/* A pixel goes on where the variance of a block may be limit or more. */
static void decide_row(const struct scan *scan, uint32_t y, double limit)
{
	const struct pen_quota *quota = scan->quota;
	float *rows[3];

	rows_around(scan->spread, y, scan->height, rows);
	for (uint32_t x = 0; x < scan->width; x++) {
		uint8_t *rounds = rounds_at(scan, x, y);

		if (*rounds < quota->decided || *rounds == PEN_QUOTA_ALL)
			continue;
		if ((double)doubted(scan, rows, x) >= limit)
			*rounds = quota->decided + 1 < PEN_QUOTA_ALL ? (uint8_t)(*rounds + 1)
								     : PEN_QUOTA_ALL;
	}
}

/* Rows of variances are read two ahead of the row that is decided, rows of means are one ahead. */
static int decide_errors(struct scan *scan, struct pen_error *err)
{
	const struct pen_framebuf *framebuf = scan->quota->framebuf;
	const double sigma = framebuf->error / pen_decide_deviations(framebuf->confidence);
	const uint32_t blocks =
		pen_round_samples(&framebuf->rounds, scan->quota->decided) / BLOCK_SAMPLES;
	const double limit =
		sigma * sigma * blocks *
		pen_decide_least_share(blocks, 1.0 - (1.0 - framebuf->confidence) / LOOKS);
	int r = 0;

	for (uint32_t y = 0; r == 0 && y < scan->height + 2; y++) {
		if (y < scan->height) {
			r = pen_framebuf_row(&scan->rows, y, scan->film, err);
			if (r < 0)
				break;
			variance_row(scan, scan->means[y % 3]);
		}
		if (y >= 1 && y - 1 < scan->height)
			spread_row(scan, y - 1);
		if (y >= 2)
			decide_row(scan, y - 2, limit);
	}
	return r;
}

static void scan_finish(struct scan *scan)
{
	pen_framebuf_rows_finish(&scan->rows);
	for (uint32_t i = 0; i < 3; i++) {
		free(scan->means[i]);
		free(scan->spread[i]);
	}
	free(scan->film);
}

static int scan_init(struct scan *scan, struct pen_quota *quota, int fd, struct pen_error *err)
{
	const struct pen_rect crop = quota->framebuf->tiling.crop;
	bool whole = true;

	*scan = (struct scan){
		.quota = quota, .width = pen_rect_width(crop), .height = pen_rect_height(crop)};
	scan->film = calloc((size_t)scan->width * quota->framebuf->film.channels, sizeof(float));
	for (uint32_t i = 0; i < 3; i++) {
		scan->means[i] = calloc((size_t)scan->width * CHANNELS, sizeof(float));
		scan->spread[i] = calloc(scan->width, sizeof(float));
		whole = whole && scan->means[i] && scan->spread[i];
	}
	if (!whole || !scan->film)
		return pen_error_memory(err);
	return pen_framebuf_rows_init(&scan->rows, fd, quota->framebuf, err);
}

int pen_decide(struct pen_quota *quota, int fd, struct pen_error *err)
{
	struct scan scan;
	int r = scan_init(&scan, quota, fd, err);

	if (r == 0) {
		quota->decided =
			quota->decided == 0 ? quota->framebuf->rounds.sure : quota->decided + 1;
		r = quota->framebuf->rounds.kind == PEN_ROUNDS_EDGE ? decide_edges(&scan, err)
								    : decide_errors(&scan, err);
	}
	scan_finish(&scan);
	return r;
}
