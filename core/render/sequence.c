/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/sequence.h"

#include "core/base/limits.h"

#include <assert.h>

_Static_assert(PEN_SAMPLES_MAX <= 1u << PEN_SOBOL_BITS, "an index has PEN_SOBOL_BITS bits");
_Static_assert(PEN_IMAGE_SIDE_MAX <= 1u << 16, "a pixel's key holds two halves of 32 bits");

/* The seeds of the camera's dimensions are apart from those of every group. */
#define CAMERA_SALT 0x5bd1e995u
#define GROUP_SALT  0x9e3779b9u

void pen_sampler_init(
	struct pen_sampler *sampler, const struct pen_sampling_desc *desc, uint32_t frame)
{
	uint32_t columns = 1, share = 1;

	while (columns * columns < desc->samples)
		columns++;
	while (share < desc->samples)
		share *= 2;
	*sampler = (struct pen_sampler){
		.sequence = desc->sequence,
		.key = pen_hash(pen_hash(desc->seed) + frame),
		.columns = columns,
		.rows = (desc->samples + columns - 1) / columns,
		.samples = desc->samples,
		.pattern = desc->mode == PEN_SAMPLING_INTERLEAVED ? desc->pattern : 0,
		.share = share,
		.shares = (1u << PEN_SOBOL_BITS) / share,
	};
	pen_sobol_init(&sampler->sobol);
}

static inline float owen_float(uint32_t reversed, uint32_t seed)
{
	return pen_unit_float(pen_reverse_bits(pen_owen_scramble(reversed, seed)));
}

static inline uint32_t camera_seed(uint32_t key, uint32_t dimension)
{
	return pen_hash(key + CAMERA_SALT * (dimension + 1));
}

static inline uint32_t group_seed(uint32_t key, uint32_t group)
{
	return pen_hash(key ^ GROUP_SALT * (group + 1));
}

/*
 * Where element i < count goes in a permutation drawn by seed: bijections of the smallest power of
 * two that holds count, applied again while the outcome is too large (Kensler 2013).
 */
static uint32_t permute(uint32_t i, uint32_t count, uint32_t seed)
{
	const uint32_t bits = count > 1 ? 32u - (uint32_t)__builtin_clz(count - 1) : 0;
	const uint32_t mask = (uint32_t)((1ull << bits) - 1);
	const uint32_t shift = bits / 2 + 1;

	do {
		for (uint32_t round = 0; round < 4; round++) {
			const uint32_t salt = pen_hash(seed + round);

			i = ((i + salt) * (salt >> 8 | 1u)) & mask;
			i ^= i >> shift;
		}
	} while (i >= count);
	return i;
}

/* A place within cell i of n, in [0, 1). */
static float cell_float(uint32_t i, uint32_t n, uint32_t bits)
{
	const float x = ((float)i + pen_unit_float(bits)) / (float)n;

	return x < PEN_UNIT_MAX ? x : PEN_UNIT_MAX;
}

struct pair {
	float u, v;
};

static struct pair jittered_pair(const struct pen_sampler *sampler, uint32_t seed, uint32_t index)
{
	const uint32_t cells = sampler->columns * sampler->rows;
	const uint32_t cell = permute(index % cells, cells, pen_hash(seed + index / cells));
	const uint32_t bits = pen_hash(seed ^ pen_hash(index));

	return (struct pair){
		.u = cell_float(cell % sampler->columns, sampler->columns, bits),
		.v = cell_float(cell / sampler->columns, sampler->rows, pen_hash(bits)),
	};
}

static float jittered_single(const struct pen_sampler *sampler, uint32_t seed, uint32_t index)
{
	const uint32_t cells = sampler->samples;
	const uint32_t cell = permute(index % cells, cells, pen_hash(seed + index / cells));

	return cell_float(cell, cells, pen_hash(seed ^ pen_hash(index)));
}

static inline struct pair random_pair(uint32_t seed, uint32_t index)
{
	const uint32_t bits = pen_hash(seed ^ pen_hash(index));

	return (struct pair){pen_unit_float(bits), pen_unit_float(pen_hash(bits + GROUP_SALT))};
}

static inline struct pair sobol_pair(uint32_t seed, uint32_t index)
{
	/* Shuffling by the index's leading digits keeps every aligned block of 2^m together. */
	const uint32_t shuffled =
		pen_reverse_bits(pen_owen_scramble(pen_reverse_bits(index), seed));

	return (struct pair){
		.u = owen_float(shuffled, pen_hash(seed + 1)),
		.v = owen_float(pen_sobol_second(shuffled), pen_hash(seed + 2)),
	};
}

static struct pair baseline_pair(const struct pen_sampler *sampler, uint32_t seed, uint32_t index)
{
	return sampler->sequence == PEN_SEQUENCE_JITTERED ? jittered_pair(sampler, seed, index)
							  : random_pair(seed, index);
}

/* One lane of the baselines, which need no speed. */
static void baseline_camera(const struct pen_sampler *sampler, uint32_t key, uint32_t index,
	uint32_t lane, struct pen_camera_samples *ret_samples)
{
	const struct pair film = baseline_pair(sampler, camera_seed(key, 0), index);
	const struct pair lens = baseline_pair(sampler, camera_seed(key, 1), index);
	const uint32_t seed = camera_seed(key, 2);

	ret_samples->x[lane] = film.u;
	ret_samples->y[lane] = film.v;
	ret_samples->u[lane] = lens.u;
	ret_samples->v[lane] = lens.v;
	ret_samples->time[lane] = sampler->sequence == PEN_SEQUENCE_JITTERED
					  ? jittered_single(sampler, seed, index)
					  : random_pair(seed, index).u;
}

static void sobol_block(const struct pen_sobol *sobol, uint32_t key, uint32_t first, uint32_t d,
	float ret_values[16])
{
	const uint32_t seed = camera_seed(key, d);
	const uint32_t base = pen_sobol_reversed(sobol, d, first);

#pragma omp simd
	for (uint32_t lane = 0; lane < 16; lane++)
		ret_values[lane] = owen_float(base ^ sobol->sixteen[d][lane], seed);
}

void pen_sampler_block(const struct pen_sampler *sampler, uint32_t x, uint32_t y, uint32_t first,
	struct pen_camera_samples *ret_samples)
{
	const uint32_t key = pen_sampler_key(sampler, x, y);

	assert(first % 16 == 0 && first >> PEN_SOBOL_BITS == 0);
	if (sampler->sequence != PEN_SEQUENCE_SOBOL) {
		for (uint32_t lane = 0; lane < 16; lane++)
			baseline_camera(sampler, key, first + lane, lane, ret_samples);
		return;
	}
	first += pen_sampler_share(sampler, x, y);
	sobol_block(&sampler->sobol, key, first, 0, ret_samples->x);
	sobol_block(&sampler->sobol, key, first, 1, ret_samples->y);
	sobol_block(&sampler->sobol, key, first, 2, ret_samples->u);
	sobol_block(&sampler->sobol, key, first, 3, ret_samples->v);
	sobol_block(&sampler->sobol, key, first, 4, ret_samples->time);
}

/* All pixels' samples have the same index. */
static void sobol_grid(const struct pen_sobol *sobol, const uint32_t key[16], uint32_t index,
	uint32_t d, float ret_values[16])
{
	const uint32_t value = pen_sobol_reversed(sobol, d, index);

#pragma omp simd
	for (uint32_t lane = 0; lane < 16; lane++)
		ret_values[lane] = owen_float(value, camera_seed(key[lane], d));
}

/* The pixels' samples have indices of their own. */
static void interleaved_grid(const struct pen_sampler *sampler, const uint32_t key[16], uint32_t x,
	uint32_t y, uint32_t index, struct pen_camera_samples *ret_samples)
{
	float *values[PEN_SOBOL_DIMENSIONS] = {
		ret_samples->x, ret_samples->y, ret_samples->u, ret_samples->v, ret_samples->time};

	for (uint32_t d = 0; d < PEN_SOBOL_DIMENSIONS; d++)
		for (uint32_t lane = 0; lane < 16; lane++) {
			const uint32_t own =
				index + pen_sampler_share(sampler, x + lane % 4, y + lane / 4);

			values[d][lane] = owen_float(pen_sobol_reversed(&sampler->sobol, d, own),
				camera_seed(key[lane], d));
		}
}

void pen_sampler_grid(const struct pen_sampler *sampler, uint32_t x, uint32_t y, uint32_t index,
	struct pen_camera_samples *ret_samples)
{
	uint32_t key[16];

	assert(index >> PEN_SOBOL_BITS == 0);
	for (uint32_t lane = 0; lane < 16; lane++)
		key[lane] = pen_sampler_key(sampler, x + lane % 4, y + lane / 4);
	if (sampler->sequence != PEN_SEQUENCE_SOBOL) {
		for (uint32_t lane = 0; lane < 16; lane++)
			baseline_camera(sampler, key[lane], index, lane, ret_samples);
		return;
	}
	if (sampler->pattern != 0) {
		interleaved_grid(sampler, key, x, y, index, ret_samples);
		return;
	}
	sobol_grid(&sampler->sobol, key, index, 0, ret_samples->x);
	sobol_grid(&sampler->sobol, key, index, 1, ret_samples->y);
	sobol_grid(&sampler->sobol, key, index, 2, ret_samples->u);
	sobol_grid(&sampler->sobol, key, index, 3, ret_samples->v);
	sobol_grid(&sampler->sobol, key, index, 4, ret_samples->time);
}

static void sobol_pairs(uint32_t group, uint32_t n, const uint32_t *key, const uint32_t *index,
	float *restrict ret_u, float *restrict ret_v)
{
#pragma omp simd
	for (uint32_t i = 0; i < n; i++) {
		const struct pair p = sobol_pair(group_seed(key[i], group), index[i]);

		ret_u[i] = p.u;
		ret_v[i] = p.v;
	}
}

void pen_sampler_pairs(const struct pen_sampler *sampler, uint32_t group, uint32_t n,
	const uint32_t *key, const uint32_t *index, float *ret_u, float *ret_v)
{
	if (sampler->sequence == PEN_SEQUENCE_SOBOL) {
		sobol_pairs(group, n, key, index, ret_u, ret_v);
		return;
	}
	for (uint32_t i = 0; i < n; i++) {
		const struct pair p = baseline_pair(sampler, group_seed(key[i], group), index[i]);

		ret_u[i] = p.u;
		ret_v[i] = p.v;
	}
}
