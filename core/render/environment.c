/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/environment.h"

#include <math.h>

/* Where a direction is in the picture; v in [0, 1], u is to be repeated. */
static struct pen_vec2 place_of(const struct pen_environment *environment, struct pen_vec3 d)
{
	const float azimuth = copysignf(pen_angle(fabsf(d.z), d.x), d.z) * (0.5f * PEN_INV_PI);

	return (struct pen_vec2){
		.x = 0.5f + azimuth + environment->turn,
		.y = pen_angle(sqrtf(d.x * d.x + d.z * d.z), d.y) * PEN_INV_PI,
	};
}

/* The part of a whole that a share in [0, 1] is in. */
static uint32_t part_of(float share, uint32_t count)
{
	const uint32_t part = (uint32_t)(pen_clamp(share, 0.0f, 1.0f) * (float)count);

	return part < count ? part : count - 1;
}

/* The last place whose sum is not above k, which is below the last sum. */
static uint32_t find(const uint32_t *sums, uint32_t count, uint32_t k)
{
	uint32_t low = 0, high = count;

	while (high - low > 1) {
		const uint32_t middle = low + (high - low) / 2;

		if (sums[middle] <= k)
			low = middle;
		else
			high = middle;
	}
	return low;
}

/* A place within a cell that a number was found in. */
static float within(const uint32_t *sums, uint32_t cell, uint32_t k)
{
	return ((float)(k - sums[cell]) + 0.5f) / (float)(sums[cell + 1] - sums[cell]);
}

static float cell_pdf(const struct pen_environment *e, uint32_t row, uint32_t column)
{
	const uint32_t *columns = e->column_sums + (size_t)row * (e->columns + 1);
	const float chance = (float)(e->row_sums[row + 1] - e->row_sums[row]) *
			     (float)(columns[column + 1] - columns[column]) *
			     (1.0f / (float)PEN_ENVIRONMENT_SUM / (float)PEN_ENVIRONMENT_SUM);
	const float height = e->row_cos[row] - e->row_cos[row + 1];

	return chance * (float)e->columns * 0.5f * PEN_INV_PI / height;
}

struct pen_environment_sample pen_environment_sample(
	const struct pen_environment *e, float u, float v)
{
	const uint32_t i = (uint32_t)(u * (float)PEN_ENVIRONMENT_SUM);
	const uint32_t j = (uint32_t)(v * (float)PEN_ENVIRONMENT_SUM);
	const uint32_t row = find(e->row_sums, e->rows, j);
	const uint32_t *columns = e->column_sums + (size_t)row * (e->columns + 1);
	const uint32_t column = find(columns, e->columns, i);
	const float across = ((float)column + within(columns, column, i)) / (float)e->columns;
	const float down = within(e->row_sums, row, j);
	const float y = e->row_cos[row] + down * (e->row_cos[row + 1] - e->row_cos[row]);
	const float r = pen_sqrt_clamped(1.0f - y * y);
	const struct pen_sincos at = pen_sincos_turns(across - 0.5f - e->turn);

	if (e->row_sums[e->rows] == 0)
		return (struct pen_environment_sample){.direction = {0.0f, 1.0f, 0.0f}};
	return (struct pen_environment_sample){
		.direction = {r * at.cos, y, r * at.sin},
		.pdf = cell_pdf(e, row, column),
	};
}

float pen_environment_pdf(const struct pen_environment *environment, struct pen_vec3 direction)
{
	const struct pen_vec2 at = place_of(environment, direction);

	return cell_pdf(environment, part_of(at.y, environment->rows),
		part_of(at.x - floorf(at.x), environment->columns));
}

struct pen_vec3 pen_environment_radiance(
	const struct pen_environment *environment, struct pen_vec3 direction, float width)
{
	const float r = sqrtf(direction.x * direction.x + direction.z * direction.z);
	const float turns = width * (0.5f * PEN_INV_PI);
	const struct pen_footprint footprint = {
		.center = place_of(environment, direction),
		.major = {turns / pen_max(r, 1e-3f), 0.0f},
		.minor = {0.0f, 2.0f * turns},
	};
	const struct pen_texel mean = pen_texture_mean(&environment->texture, &footprint);

	return pen_scale(pen_vec3(mean.red, mean.green, mean.blue), environment->intensity);
}
