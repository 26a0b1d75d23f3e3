/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/texture.h"

#include "directions.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

enum { SIDE = 256, SQUARE = 8 };

/* Black and white squares, repeated. */
static struct pen_texture checkerboard(void)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_picture picture = {
		.type = PEN_TEXEL_BYTES,
		.width = SIDE,
		.height = SIDE,
		.texels = malloc(4ul * SIDE * SIDE),
	};
	struct pen_mipmap *mipmap = NULL;
	uint8_t *texels = picture.texels;

	assert_non_null(texels);
	for (int i = 0; i < SIDE * SIDE; i++) {
		const bool white = (i % SIDE / SQUARE + i / SIDE / SQUARE) % 2 == 0;

		for (int c = 0; c < 4; c++)
			texels[4 * i + c] = white || c == 3 ? 255 : 0;
	}
	assert_int_equal(pen_mipmap_create(&picture, false, &mipmap, &err), 0);
	return (struct pen_texture){.mipmap = mipmap, .uv = {{1, 0, 0}, {0, 1, 0}}};
}

static void release(const struct pen_texture *texture)
{
	pen_mipmap_destroy((struct pen_mipmap *)(uintptr_t)texture->mipmap);
}

/* The mean over the parallelogram of a footprint, of the squares themselves. */
static double brute_mean(const struct pen_footprint *f)
{
	enum { STEPS = 200 };
	double sum = 0.0;

	for (int i = 0; i < STEPS * STEPS; i++) {
		const double a = (i % STEPS + 0.5) / STEPS - 0.5,
			     b = (i / STEPS + 0.5) / STEPS - 0.5;
		const double x =
			((double)f->center.x + a * (double)f->major.x + b * (double)f->minor.x) *
			SIDE / SQUARE;
		const double y =
			((double)f->center.y + a * (double)f->major.y + b * (double)f->minor.y) *
			SIDE / SQUARE;

		sum += ((long)floor(x) + (long)floor(y)) % 2 == 0;
	}
	return sum / (STEPS * STEPS);
}

static struct pen_footprint footprint_of(struct random_numbers *numbers, float texels, float ratio)
{
	const double angle = 2.0 * M_PI * (double)random_next(numbers);
	const float c = (float)cos(angle) * texels / SIDE, s = (float)sin(angle) * texels / SIDE;

	return (struct pen_footprint){
		.center = {random_next(numbers), random_next(numbers)},
		.major = {c * ratio, s * ratio},
		.minor = {-s, c},
	};
}

/*
 * Footprints much wider than a square see grey, whatever their shape: a level chosen by the shorter
 * axis alone, or without averages, sees black or white there.
 */
static void far_squares_do_not_alias(void **state)
{
	const struct pen_texture texture = checkerboard();
	struct random_numbers numbers = {.state = 1};

	(void)state;
	for (int i = 0; i < 2000; i++) {
		const float ratio = 1.0f + 15.0f * random_next(&numbers);
		const struct pen_footprint f = footprint_of(
			&numbers, 4.0f * SQUARE * (1.0f + random_next(&numbers)), ratio);

		assert_float_equal(pen_texture_mean(&texture, &f).red, 0.5f, 0.08f);
	}
	release(&texture);
}

/*
 * Of all sizes: on average the filter neither adds nor takes light, and it is near the mean that
 * it stands for, nearer than a filter of the longer axis in all directions would be.
 */
static void means_are_near_the_truth(void **state)
{
	enum { COUNT = 600 };
	const struct pen_texture texture = checkerboard();
	struct random_numbers numbers = {.state = 2};
	double square = 0.0, bias = 0.0, blurred = 0.0;

	(void)state;
	for (int i = 0; i < COUNT; i++) {
		const float texels = 0.5f * exp2f(6.0f * random_next(&numbers));
		const float ratio = 1.0f + 7.0f * random_next(&numbers);
		const struct pen_footprint f = footprint_of(&numbers, texels, ratio);
		const struct pen_footprint round = {
			.center = f.center, .major = f.major, .minor = {-f.major.y, f.major.x}};
		const double truth = brute_mean(&f);
		const double error = (double)pen_texture_mean(&texture, &f).red - truth;
		const double other = (double)pen_texture_mean(&texture, &round).red - truth;

		square += error * error;
		blurred += other * other;
		bias += error;
	}
	assert_true(fabs(bias / COUNT) < 0.01);
	assert_true(sqrt(square / COUNT) < 0.1);
	assert_true(square < 0.7 * blurred);
	release(&texture);
}

/* Texel centres give their texels, and wraps continue as they say. */
static void points_are_texels(void **state)
{
	struct pen_texture texture = checkerboard();
	struct pen_footprint f = {.center = {0.5f / SIDE, 0.5f / SIDE}};

	(void)state;
	assert_float_equal(pen_texture_mean(&texture, &f).red, 1.0f, 1e-6f);
	f.center.x = (SQUARE + 0.5f) / SIDE;
	assert_float_equal(pen_texture_mean(&texture, &f).red, 0.0f, 1e-6f);
	f.center.x = 1.0f + (SQUARE + 0.5f) / SIDE;
	assert_float_equal(pen_texture_mean(&texture, &f).red, 0.0f, 1e-4f);
	texture.wrap_u = PEN_WRAP_CLAMP;
	assert_float_equal(pen_texture_mean(&texture, &f).red, 0.0f, 1e-6f);
	f.center.x = -3.0f;
	assert_float_equal(pen_texture_mean(&texture, &f).red, 1.0f, 1e-6f);
	texture.wrap_u = PEN_WRAP_MIRROR;
	f.center.x = -(SQUARE + 0.5f) / SIDE;
	assert_float_equal(pen_texture_mean(&texture, &f).red, 0.0f, 1e-4f);
	release(&texture);
}

/* Coordinates far out, infinite and not numbers stay within the picture (under ASan). */
static void wild_coordinates_are_harmless(void **state)
{
	static const float wild[] = {0.0f, 1e30f, -1e30f, INFINITY, -INFINITY, NAN, 1e-38f};
	struct pen_texture texture = checkerboard();

	(void)state;
	for (int i = 0; i < 7 * 7 * 7 * 3; i++) {
		const struct pen_footprint f = {
			.center = {wild[i % 7], wild[i / 7 % 7]},
			.major = {wild[i / 49 % 7], wild[i % 7]},
			.minor = {wild[i / 7 % 7], wild[i / 49 % 7]},
		};
		float red;

		texture.wrap_u = texture.wrap_v = (enum pen_wrap)(i / 343);
		red = pen_texture_mean(&texture, &f).red;
		assert_true(red >= 0.0f && red <= 1.001f);
	}
	release(&texture);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(far_squares_do_not_alias),
		cmocka_unit_test(means_are_near_the_truth),
		cmocka_unit_test(points_are_texels),
		cmocka_unit_test(wild_coordinates_are_harmless),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
