/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/environment.h"

#include <math.h>
#include <stdlib.h>

/* What a texel counts for; what is no number, or below 0, counts for nothing. */
static double luminance_of(struct pen_texel texel)
{
	const double sum = 0.2126 * fmax((double)texel.red, 0.0) +
			   0.7152 * fmax((double)texel.green, 0.0) +
			   0.0722 * fmax((double)texel.blue, 0.0);

	return isfinite(sum) ? sum : 0.0;
}

/*
 * The mean luminance of the interpolated picture over each texel of a level: an eighth comes from
 * the neighbours on either side. So no cell is without weight that interpolation lights.
 */
static void find_weights(
	const struct pen_mipmap *mipmap, const struct pen_mip_level *level, double *weights)
{
	static const double share[3] = {0.125, 0.75, 0.125};
	const uint32_t w = level->width, h = level->height;

	for (uint32_t y = 0; y < h; y++)
		for (uint32_t x = 0; x < w; x++) {
			double *to = &weights[(size_t)y * w + x];

			*to = 0.0;
			for (uint32_t k = 0; k < 9; k++) {
				const uint32_t row = y + k / 3 < 1 ? 0 : y + k / 3 - 1;

				*to += share[k / 3] * share[k % 3] *
				       luminance_of(pen_mipmap_fetch(mipmap, level,
					       (x + w + k % 3 - 1) % w, row < h ? row : h - 1));
			}
		}
}

/*
 * Whole numbers in proportion to the weights, as running sums: at least 1 for a weight above 0.
 * What rounding leaves goes to the greatest. All 0 when the weights are.
 */
static void sum_up(const double *weights, uint32_t count, uint32_t *sums)
{
	double total = 0.0;
	uint32_t greatest = 0, used = 0;

	for (uint32_t i = 0; i < count; i++) {
		total += weights[i];
		greatest = weights[i] > weights[greatest] ? i : greatest;
	}
	sums[0] = 0;
	for (uint32_t i = 0; i < count; i++) {
		const double share = total > 0.0 ? weights[i] / total : 0.0;
		const double points = floor(share * (double)(PEN_ENVIRONMENT_SUM - count));

		sums[i + 1] = share > 0.0 ? 1 + (uint32_t)points : 0;
		used += sums[i + 1];
	}
	if (used > 0)
		sums[greatest + 1] += PEN_ENVIRONMENT_SUM - used;
	for (uint32_t i = 0; i < count; i++)
		sums[i + 1] += sums[i];
}

static void fill_table(struct pen_environment *e, const double *weights, double *row_weights)
{
	for (uint32_t row = 0; row <= e->rows; row++)
		e->row_cos[row] = (float)cos(M_PI * row / e->rows);
	for (uint32_t row = 0; row < e->rows; row++) {
		const double *from = weights + (size_t)row * e->columns;
		const double height = (double)e->row_cos[row] - (double)e->row_cos[row + 1];

		row_weights[row] = 0.0;
		for (uint32_t column = 0; column < e->columns; column++)
			row_weights[row] += from[column] * height;
		sum_up(from, e->columns, e->column_sums + (size_t)row * (e->columns + 1));
	}
	sum_up(row_weights, e->rows, e->row_sums);
}

static int create_table(
	struct pen_environment *e, const struct pen_mip_level *level, struct pen_error *err)
{
	const size_t cells = (size_t)level->width * level->height;
	double *weights = calloc(cells, sizeof *weights);
	double *row_weights = calloc(level->height, sizeof *row_weights);
	int r = 0;

	e->columns = level->width;
	e->rows = level->height;
	e->row_cos = calloc(e->rows + 1ul, sizeof *e->row_cos);
	e->row_sums = calloc(e->rows + 1ul, sizeof *e->row_sums);
	e->column_sums = calloc(cells + e->rows, sizeof *e->column_sums);
	if (!weights || !row_weights || !e->row_cos || !e->row_sums || !e->column_sums) {
		r = pen_error_memory(err);
		goto out;
	}
	find_weights(e->texture.mipmap, level, weights);
	fill_table(e, weights, row_weights);
out:
	free(weights);
	free(row_weights);
	return r;
}

int pen_environment_create(const struct pen_mipmap *mipmap, const struct pen_background_desc *desc,
	struct pen_environment **ret_environment, struct pen_error *err)
{
	const struct pen_mip_level *level = mipmap->levels;
	struct pen_environment *e = calloc(1, sizeof *e);
	int r;

	if (!e)
		return pen_error_memory(err);
	e->texture = (struct pen_texture){
		.mipmap = mipmap,
		.wrap_u = PEN_WRAP_REPEAT,
		.wrap_v = PEN_WRAP_CLAMP,
		.uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
	};
	e->intensity = (float)desc->intensity;
	e->turn = (float)(fmod(desc->rotation, 360.0) / 360.0);
	while (level->width > PEN_ENVIRONMENT_COLUMNS_MAX ||
		level->height > PEN_ENVIRONMENT_ROWS_MAX)
		level++;
	r = create_table(e, level, err);
	if (r < 0)
		pen_environment_destroy(e);
	else
		*ret_environment = e;
	return r;
}

void pen_environment_destroy(struct pen_environment *environment)
{
	if (!environment)
		return;
	free(environment->row_cos);
	free(environment->row_sums);
	free(environment->column_sums);
	free(environment);
}
