/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SEQUENCE_H
#define PEN_RENDER_SEQUENCE_H

#include "core/render/sobol.h"
#include "core/scene/desc.h"

#include <stdint.h>

/*
 * Where sample values come from: a value is a function of (seed, frame, pixel, sample index,
 * dimension), so that any sample can be taken by anyone in any order.
 *
 * sobol:    the five camera dimensions are one 5-D Owen-scrambled Sobol point, scrambled anew for
 *           each pixel; every later pair of dimensions is a 2-D Owen-scrambled Sobol point under a
 *           shuffled index.
 * jittered: a sample per cell of a grid of at least `samples` cells, for the pixel, for the lens,
 *           for time and for every later pair, the cells visited in orders of their own.
 * random:   independent values.
 */
struct pen_sampler {
	enum pen_sequence sequence;
	uint32_t key;
	uint32_t columns, rows; /* of the jittered grid */
	uint32_t samples;
	uint32_t pattern; /* side of the block of interleaved sampling; 0: every pixel its own */
	uint32_t share;	  /* indices of each of its pixels, a power of two */
	uint32_t shares;  /* that one pattern has; a power of two */
	struct pen_sobol sobol;
};

void pen_sampler_init(
	struct pen_sampler *sampler, const struct pen_sampling_desc *desc, uint32_t frame);

/*
 * What separates the pixels; x and y below 2^16. Different pixels have different keys, but for
 * interleaved sampling (Keller, Heidrich 2001): there the pixels of a square block of `pattern`
 * pixels have a pattern of their own each, and all blocks have the same. Of sobol's these are
 * shares of one pattern: the pixels have one key, and each has its own aligned range of indices,
 * as long as `samples` asks for, so that they are stratified among themselves, too.
 */
static inline uint32_t pen_sampler_key(const struct pen_sampler *sampler, uint32_t x, uint32_t y)
{
	const uint32_t side = sampler->pattern;

	if (side == 0)
		return pen_hash(sampler->key ^ (y << 16 | x));
	if (sampler->sequence != PEN_SEQUENCE_SOBOL)
		return pen_hash(sampler->key ^ (y % side << 16 | x % side));
	return pen_hash(sampler->key ^ (y % side * side + x % side) / sampler->shares);
}

/* The index of the pixel's first sample. */
static inline uint32_t pen_sampler_share(const struct pen_sampler *sampler, uint32_t x, uint32_t y)
{
	const uint32_t side = sampler->pattern;

	if (side == 0 || sampler->sequence != PEN_SEQUENCE_SOBOL)
		return 0;
	return (y % side * side + x % side) % sampler->shares * sampler->share;
}

/* The camera's five dimensions of sixteen samples, all in [0, 1). */
struct pen_camera_samples {
	_Alignas(64) float x[16];
	_Alignas(64) float y[16]; /* filter */
	_Alignas(64) float u[16];
	_Alignas(64) float v[16]; /* lens */
	_Alignas(64) float time[16];
};

/* Samples [first, first + 16) of pixel (x, y); first is a multiple of 16 below 2^16. */
void pen_sampler_block(const struct pen_sampler *sampler, uint32_t x, uint32_t y, uint32_t first,
	struct pen_camera_samples *ret_samples);

/* Sample index (below 2^16) of the pixels x + lane % 4, y + lane / 4. */
void pen_sampler_grid(const struct pen_sampler *sampler, uint32_t x, uint32_t y, uint32_t index,
	struct pen_camera_samples *ret_samples);

/*
 * The plan of dimensions behind the camera's: a group is a pair of them. Each scattering event has
 * PEN_SLOT_COUNT groups; depth counts the events of a path from 0.
 */
enum pen_slot {
	PEN_SLOT_LIGHT = 0, /* + light: a point on each of up to eight */
	PEN_SLOT_LIGHT_CHOICE = 8,
	PEN_SLOT_LOBE,	      /* a direction */
	PEN_SLOT_LOBE_CHOICE, /* reflection or refraction */
	PEN_SLOT_BACKGROUND,
	PEN_SLOT_ROULETTE,
	PEN_SLOT_CHOSEN_LIGHT, /* a point on it */
	PEN_SLOT_COUNT = 16
};

static inline uint32_t pen_sample_group(uint32_t depth, uint32_t slot)
{
	return depth * PEN_SLOT_COUNT + slot;
}

/* The pair of one group, in [0, 1), of n samples: keys by pen_sampler_key, indices below 2^16. */
void pen_sampler_pairs(const struct pen_sampler *sampler, uint32_t group, uint32_t n,
	const uint32_t *key, const uint32_t *index, float *ret_u, float *ret_v);

#endif
