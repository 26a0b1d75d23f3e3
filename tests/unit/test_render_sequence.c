/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "core/render/sequence.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { SAMPLES = 256, KEYS = 64 };

static struct pen_sampler make_sampler(enum pen_sequence sequence, uint32_t samples)
{
	const struct pen_sampling_desc desc = {.samples = samples, .sequence = sequence, .seed = 7};
	struct pen_sampler sampler;

	pen_sampler_init(&sampler, &desc, 3);
	return sampler;
}

/* The camera's points of one pixel, dimension by dimension. */
static void camera_points(const struct pen_sampler *sampler, uint32_t x, uint32_t y, uint32_t first,
	float ret[5][SAMPLES])
{
	for (uint32_t i = 0; i < SAMPLES; i += 16) {
		struct pen_camera_samples block;

		pen_sampler_block(sampler, x, y, first + i, &block);
		memcpy(&ret[0][i], block.x, sizeof(block.x));
		memcpy(&ret[1][i], block.y, sizeof(block.y));
		memcpy(&ret[2][i], block.u, sizeof(block.u));
		memcpy(&ret[3][i], block.v, sizeof(block.v));
		memcpy(&ret[4][i], block.time, sizeof(block.time));
	}
}

/* Whether n points fall into each box of 2^a by 2^b exactly n / 2^(a + b) times. */
static bool fills_boxes(const float *u, const float *v, uint32_t n, uint32_t a, uint32_t b)
{
	uint32_t count[SAMPLES] = {0};

	for (uint32_t i = 0; i < n; i++) {
		const uint32_t column = (uint32_t)(u[i] * (float)(1u << a));
		const uint32_t row = (uint32_t)(v[i] * (float)(1u << b));

		count[row << a | column]++;
	}
	for (uint32_t box = 0; box < 1u << (a + b); box++)
		if (count[box] != n >> (a + b))
			return false;
	return true;
}

/* A (0, m, 2)-net: every elementary interval of 1 / n holds one of n = 2^m points. */
static bool is_net(const float *u, const float *v, uint32_t n)
{
	const uint32_t m = (uint32_t)__builtin_ctz(n);

	for (uint32_t a = 0; a <= m; a++)
		if (!fills_boxes(u, v, n, a, m - a))
			return false;
	return true;
}

/* Wrong direction numbers, a scramble that is not nested, or a hash used twice. */
static void camera_points_fill_elementary_intervals(void **state)
{
	static const uint32_t firsts[] = {0, 256, 4096, 65280};
	const struct pen_sampler sampler = make_sampler(PEN_SEQUENCE_SOBOL, SAMPLES);
	static float p[5][SAMPLES];

	(void)state;
	for (size_t f = 0; f < sizeof(firsts) / sizeof(firsts[0]); f++) {
		camera_points(&sampler, 11, 5, firsts[f], p);
		assert_true(is_net(p[0], p[1], SAMPLES));
		for (uint32_t first = 0; first < SAMPLES; first += 16)
			assert_true(is_net(&p[0][first], &p[1][first], 16));
		for (int d = 0; d < 5; d++)
			assert_true(fills_boxes(p[d], p[d], SAMPLES, 0, 8));
	}
}

/* Number of 32 boxes (halves of each of five axes) that hold exactly 256 / 32 points. */
static uint32_t even_boxes(float p[5][SAMPLES])
{
	uint32_t count[32] = {0};
	uint32_t even = 0;

	for (uint32_t i = 0; i < SAMPLES; i++) {
		uint32_t box = 0;

		for (int d = 0; d < 5; d++)
			box = box << 1 | (p[d][i] >= 0.5f);
		count[box]++;
	}
	for (uint32_t box = 0; box < 32; box++)
		even += count[box] == SAMPLES / 32;
	return even;
}

/* Padding the lens or time instead of one joint point: halves in all five axes fill unevenly. */
static void camera_points_are_joint(void **state)
{
	const struct pen_sampler sampler = make_sampler(PEN_SEQUENCE_SOBOL, SAMPLES);
	static float p[5][SAMPLES];

	(void)state;
	for (uint32_t x = 0; x < 16; x++) {
		camera_points(&sampler, x, 2 * x, 0, p);
		assert_int_equal(even_boxes(p), 32);
	}
}

/* A packet of sixteen pixels must take the very samples that packets of one pixel take. */
static void grid_and_block_agree(void **state)
{
	(void)state;
	for (enum pen_sequence sequence = PEN_SEQUENCE_SOBOL; sequence <= PEN_SEQUENCE_RANDOM;
		sequence++) {
		const struct pen_sampler sampler = make_sampler(sequence, SAMPLES);
		struct pen_camera_samples grid, block;

		pen_sampler_grid(&sampler, 40, 8, 37, &grid);
		for (uint32_t lane = 0; lane < 16; lane++) {
			pen_sampler_block(&sampler, 40 + lane % 4, 8 + lane / 4, 32, &block);
			assert_true(grid.x[lane] == block.x[5]);
			assert_true(grid.y[lane] == block.y[5]);
			assert_true(grid.u[lane] == block.u[5]);
			assert_true(grid.v[lane] == block.v[5]);
			assert_true(grid.time[lane] == block.time[5]);
		}
	}
}

static void pair_points(const struct pen_sampler *sampler, uint32_t group, uint32_t first,
	float ret_u[SAMPLES], float ret_v[SAMPLES])
{
	uint32_t key[SAMPLES];
	uint32_t index[SAMPLES];

	for (uint32_t i = 0; i < SAMPLES; i++) {
		key[i] = pen_sampler_key(sampler, 3, 9);
		index[i] = first + i;
	}
	pen_sampler_pairs(sampler, group, SAMPLES, key, index, ret_u, ret_v);
}

/* The camera points of sixteen samples of each pixel of a block are one net of 256 together. */
static void check_shares(const struct pen_sampler *sampler)
{
	float u[SAMPLES], v[SAMPLES];

	for (uint32_t i = 0; i < 16; i++) {
		struct pen_camera_samples own, same;

		pen_sampler_block(sampler, i % 4, i / 4, 0, &own);
		pen_sampler_block(sampler, 40 + i % 4, 16 + i / 4, 0, &same);
		assert_memory_equal(&own, &same, sizeof own);
		memcpy(&u[16 * i], own.x, sizeof own.x);
		memcpy(&v[16 * i], own.y, sizeof own.y);
		assert_true(is_net(own.x, own.y, 16));
	}
	assert_true(is_net(u, v, SAMPLES));
}

/* So are those of one sample, or two or four, of each, however they are asked for. */
static void check_few_shares(uint32_t samples)
{
	const struct pen_sampling_desc desc = {.mode = PEN_SAMPLING_INTERLEAVED,
		.pattern = 4,
		.samples = samples,
		.sequence = PEN_SEQUENCE_SOBOL};
	struct pen_sampler sampler;
	float u[SAMPLES], v[SAMPLES];

	pen_sampler_init(&sampler, &desc, 1);
	for (uint32_t i = 0; i < samples; i++) {
		struct pen_camera_samples grid, block;

		pen_sampler_grid(&sampler, 40, 8, i, &grid);
		memcpy(&u[16 * i], grid.x, sizeof grid.x);
		memcpy(&v[16 * i], grid.y, sizeof grid.y);
		for (uint32_t lane = 0; lane < 16; lane++) {
			pen_sampler_block(&sampler, 40 + lane % 4, 8 + lane / 4, 0, &block);
			assert_true(grid.x[lane] == block.x[i]);
			assert_true(grid.time[lane] == block.time[i]);
		}
	}
	assert_true(is_net(u, v, 16 * samples));
}

/* Interleaved sampling that repeats a pixel's pattern within the block, or another over it. */
static void interleaved_blocks_share_a_pattern(void **state)
{
	struct pen_sampling_desc desc = {.mode = PEN_SAMPLING_INTERLEAVED,
		.pattern = 4,
		.samples = 16,
		.sequence = PEN_SEQUENCE_SOBOL};
	struct pen_sampler sampler;
	struct pen_camera_samples grid, block;

	(void)state;
	pen_sampler_init(&sampler, &desc, 1);
	check_shares(&sampler);
	for (uint32_t samples = 1; samples < 16; samples *= 2)
		check_few_shares(samples);
	for (desc.sequence = PEN_SEQUENCE_SOBOL; desc.sequence <= PEN_SEQUENCE_RANDOM;
		desc.sequence++) {
		desc.pattern = 3;
		desc.samples = PEN_SAMPLES_MAX;
		pen_sampler_init(&sampler, &desc, 1);
		pen_sampler_grid(&sampler, 40, 8, 37, &grid);
		for (uint32_t lane = 0; lane < 16; lane++) {
			const uint32_t x = 40 + lane % 4, y = 8 + lane / 4;

			pen_sampler_block(&sampler, x, y, 32, &block);
			assert_true(grid.u[lane] == block.u[5]);
			pen_sampler_block(&sampler, x + 3, y + 9, 32, &block);
			assert_true(grid.u[lane] == block.u[5]);
			pen_sampler_block(&sampler, x + 1, y, 32, &block);
			assert_true(grid.u[lane] != block.u[5]);
		}
	}
}

/* An index shuffle that does not keep aligned blocks of 2^m together breaks the nets. */
static void pairs_fill_elementary_intervals(void **state)
{
	const struct pen_sampler sampler = make_sampler(PEN_SEQUENCE_SOBOL, SAMPLES);
	float u[SAMPLES], v[SAMPLES];

	(void)state;
	for (uint32_t group = 0; group < 40; group++) {
		pair_points(&sampler, group, 256 * group, u, v);
		assert_true(is_net(u, v, SAMPLES));
		for (uint32_t first = 0; first < SAMPLES; first += 16)
			assert_true(is_net(&u[first], &v[first], 16));
	}
}

/* Jittered: a grid that misses a cell, or a value of 1. */
static void jittered_fills_cells(void **state)
{
	const struct pen_sampler sampler = make_sampler(PEN_SEQUENCE_JITTERED, SAMPLES);
	static float p[5][SAMPLES];
	float u[SAMPLES], v[SAMPLES];

	(void)state;
	camera_points(&sampler, 1, 2, 0, p);
	pair_points(&sampler, 5, 0, u, v);
	assert_true(fills_boxes(p[0], p[1], SAMPLES, 4, 4));
	assert_true(fills_boxes(p[2], p[3], SAMPLES, 4, 4));
	assert_true(fills_boxes(p[4], p[4], SAMPLES, 0, 8));
	assert_true(fills_boxes(u, v, SAMPLES, 4, 4));
}

/* Sample counts that are no square: each cell at most once, all values in [0, 1). */
static void jittered_takes_any_count(void **state)
{
	(void)state;
	for (uint32_t samples = 1; samples <= SAMPLES; samples++) {
		const struct pen_sampler sampler = make_sampler(PEN_SEQUENCE_JITTERED, samples);
		uint32_t count[2 * SAMPLES] = {0};
		float u[SAMPLES], v[SAMPLES];

		assert_true(sampler.columns * sampler.rows >= samples);
		pair_points(&sampler, 1, 0, u, v);
		for (uint32_t i = 0; i < samples; i++) {
			const uint32_t column = (uint32_t)(u[i] * (float)sampler.columns);
			const uint32_t row = (uint32_t)(v[i] * (float)sampler.rows);

			assert_true(u[i] >= 0.0f && u[i] < 1.0f && v[i] >= 0.0f && v[i] < 1.0f);
			assert_true(count[row * sampler.columns + column]++ == 0);
		}
	}
}

/* Correlation of two runs of samples, times the square root of their number. */
static double correlation(const float *a, const float *b, uint32_t n)
{
	double sum = 0.0;

	for (uint32_t i = 0; i < n; i++)
		sum += ((double)a[i] - 0.5) * ((double)b[i] - 0.5);
	return 12.0 * sum / sqrt(n);
}

/* Neighbouring pixels, frames, seeds or groups that share a pattern show as structure. */
static void keys_and_groups_are_independent(void **state)
{
	const struct pen_sampler sampler = make_sampler(PEN_SEQUENCE_SOBOL, SAMPLES);
	static float u[KEYS * KEYS], right[KEYS * KEYS], below[KEYS * KEYS], group[KEYS * KEYS];
	struct pen_camera_samples samples;

	(void)state;
	for (uint32_t i = 0; i < KEYS * KEYS; i++) {
		const uint32_t x = i % KEYS;
		const uint32_t y = i / KEYS;
		const uint32_t key = pen_sampler_key(&sampler, x, y);
		const uint32_t zero = 0;
		float unused;

		pen_sampler_grid(&sampler, x, y, 0, &samples);
		u[i] = samples.x[0];
		right[i] = samples.x[1];
		below[i] = samples.x[4];
		pen_sampler_pairs(&sampler, 0, 1, &key, &zero, &group[i], &unused);
	}
	assert_true(fabs(correlation(u, right, KEYS * KEYS)) < 4.0);
	assert_true(fabs(correlation(u, below, KEYS * KEYS)) < 4.0);
	assert_true(fabs(correlation(u, group, KEYS * KEYS)) < 4.0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(camera_points_fill_elementary_intervals),
		cmocka_unit_test(camera_points_are_joint),
		cmocka_unit_test(grid_and_block_agree),
		cmocka_unit_test(interleaved_blocks_share_a_pattern),
		cmocka_unit_test(pairs_fill_elementary_intervals),
		cmocka_unit_test(jittered_fills_cells),
		cmocka_unit_test(jittered_takes_any_count),
		cmocka_unit_test(keys_and_groups_are_independent),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
