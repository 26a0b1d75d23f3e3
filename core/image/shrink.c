/* SPDX-License-Identifier: Apache-2.0 */
#include "core/image/shrink.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CHANNELS = 4 };

int pen_shrink_init(struct pen_shrink *shrink, struct pen_error *err)
{
	shrink->values =
		calloc((size_t)pen_rect_width(shrink->window) * CHANNELS, sizeof *shrink->values);
	shrink->sums = calloc((size_t)shrink->width * CHANNELS, sizeof *shrink->sums);
	return shrink->values && shrink->sums ? 0 : pen_error_memory(err);
}

void pen_shrink_finish(struct pen_shrink *shrink)
{
	free(shrink->values);
	free(shrink->sums);
}

/* Part i of count of a length that begins at first. */
static double edge(uint32_t first, uint32_t length, uint32_t i, uint32_t count)
{
	return first + (double)length * i / count;
}

/* How much of the unit interval at cell is between two places. */
static double share(uint32_t cell, double from, double to)
{
	return fmin(cell + 1.0, to) - fmax(cell, from);
}

static uint32_t smaller(uint32_t a, uint32_t b)
{
	return a < b ? a : b;
}

static uint32_t larger(uint32_t a, uint32_t b)
{
	return a > b ? a : b;
}

/* Adds a row of the picture, which counts for weight, to the sums. */
static void add_row(struct pen_shrink *shrink, double weight)
{
	const struct pen_rect *region = &shrink->region, *window = &shrink->window;

	for (uint32_t i = 0; i < shrink->width; i++) {
		const double from = edge(region->x0, pen_rect_width(*region), i, shrink->width);
		const double to = edge(region->x0, pen_rect_width(*region), i + 1, shrink->width);
		const uint32_t end = smaller((uint32_t)ceil(to), window->x1);
		double *sums = shrink->sums + (size_t)i * CHANNELS;

		for (uint32_t x = larger((uint32_t)from, window->x0); x < end; x++) {
			const float *value = shrink->values + (size_t)(x - window->x0) * CHANNELS;
			const double part = weight * share(x, from, to) * (double)value[3];

			for (int c = 0; c < 3; c++)
				sums[c] += part * (double)value[c];
			sums[3] += part;
		}
	}
}

int pen_shrink_row(void *user, uint32_t y, float *ret_values, struct pen_error *err)
{
	struct pen_shrink *shrink = user;
	const struct pen_rect *region = &shrink->region;
	const double from = edge(region->y0, pen_rect_height(*region), y, shrink->height);
	const double to = edge(region->y0, pen_rect_height(*region), y + 1, shrink->height);
	const uint32_t end = smaller((uint32_t)ceil(to), shrink->window.y1);

	memset(shrink->sums, 0, (size_t)shrink->width * CHANNELS * sizeof *shrink->sums);
	for (uint32_t row = larger((uint32_t)from, shrink->window.y0); row < end; row++) {
		const int r = shrink->row(shrink->user, row, shrink->values, err);

		if (r < 0)
			return r;
		add_row(shrink, share(row, from, to));
	}
	for (uint32_t i = 0; i < shrink->width; i++, ret_values += CHANNELS) {
		const double *sums = shrink->sums + (size_t)i * CHANNELS;
		const bool is_rendered = sums[3] > 0.0;

		for (int c = 0; c < 3; c++)
			ret_values[c] = is_rendered ? (float)(sums[c] / sums[3]) : 0.0f;
		ret_values[3] = is_rendered ? 1.0f : 0.0f;
	}
	return 0;
}
