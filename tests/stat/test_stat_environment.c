/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/environment.h"

#include "directions.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

struct surroundings {
	struct pen_mipmap *mipmap;
	struct pen_environment *environment;
};

/* Noise over a dim sky, a small sun, and a black band below. */
static struct surroundings make_surroundings(
	uint32_t width, uint32_t height, float sun, double rotation)
{
	struct pen_picture picture = {
		.type = PEN_TEXEL_FLOATS,
		.width = width,
		.height = height,
		.texels = calloc(4ul * width * height, sizeof(float)),
	};
	const struct pen_background_desc desc = {.intensity = 1.5, .rotation = rotation};
	struct random_numbers numbers = {.state = 5};
	struct pen_error err = PEN_ERROR_INIT;
	struct surroundings made;
	float *texels = picture.texels;

	assert_non_null(texels);
	for (uint32_t y = 0; y < height; y++)
		for (uint32_t x = 0; x < width; x++) {
			float *texel = texels + 4 * ((size_t)y * width + x);
			const bool is_sun = y == height / 4 && x == width / 3;
			const bool is_black = y > height / 2 && y < height * 3 / 4;

			for (int c = 0; c < 3; c++)
				texel[c] = is_black ? 0.0f
						    : random_next(&numbers) + (is_sun ? sun : 0.0f);
			texel[3] = 1.0f;
		}
	assert_int_equal(pen_mipmap_create(&picture, false, &made.mipmap, &err), 0);
	assert_int_equal(pen_environment_create(made.mipmap, &desc, &made.environment, &err), 0);
	return made;
}

static void destroy_surroundings(struct surroundings *made)
{
	pen_environment_destroy(made->environment);
	pen_mipmap_destroy(made->mipmap);
}

static bool sample(const void *context, float u, float v, float w, struct pen_vec3 *ret)
{
	const struct pen_environment_sample sample = pen_environment_sample(context, u, v);

	(void)w;
	*ret = sample.direction;
	return sample.pdf > 0.0f;
}

static double density(const void *context, struct pen_vec3 direction)
{
	return (double)pen_environment_pdf(context, direction);
}

/* A density that is not that of the samples: of a row, a cell, the rotation or the poles. */
static void directions_of_an_environment(void **state)
{
	static const struct {
		const char *name;
		uint32_t width, height;
		double rotation;
	} cases[] = {
		{"small", 16, 8, 0.0}, {"odd and turned", 37, 19, 70.0}, {"one texel", 1, 1, 0.0}};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct surroundings made = make_surroundings(
			cases[i].width, cases[i].height, 10.0f, cases[i].rotation);
		const struct direction_case test = {cases[i].name, sample, density,
			made.environment, pen_vec3(0.0f, 1.0f, 0.0f)};

		assert_directions(&test);
		destroy_surroundings(&made);
	}
}

/* By midpoints of a fine grid of directions, in double but for the radiance. */
static double quadrature(const struct pen_environment *environment, struct pen_vec3 n)
{
	enum { DOWN = 1200, ACROSS = 2400 };
	double sum = 0.0;

	for (int i = 0; i < DOWN; i++) {
		const double polar = M_PI * (i + 0.5) / DOWN;

		for (int j = 0; j < ACROSS; j++) {
			const double azimuth = 2.0 * M_PI * (j + 0.5) / ACROSS;
			const struct pen_vec3 d = {(float)(sin(polar) * cos(azimuth)),
				(float)cos(polar), (float)(sin(polar) * sin(azimuth))};
			const double cosine = fmax((double)pen_dot(n, d), 0.0);

			sum += cosine * sin(polar) *
			       (double)pen_environment_radiance(environment, d, 0.0f).y;
		}
	}
	return sum * M_PI / DOWN * 2.0 * M_PI / ACROSS;
}

static double sampled(const struct pen_environment *environment, struct pen_vec3 n)
{
	enum { SIDE = 1500 };
	struct random_numbers numbers = {.state = 3};
	double sum = 0.0;

	for (int i = 0; i < SIDE * SIDE; i++) {
		const float u = ((float)(i % SIDE) + random_next(&numbers)) / SIDE;
		const float v = ((float)(i / SIDE) + random_next(&numbers)) / SIDE;
		const struct pen_environment_sample s = pen_environment_sample(
			environment, pen_min(u, 0x1.fffffep-1f), pen_min(v, 0x1.fffffep-1f));
		const float cosine = pen_max(pen_dot(n, s.direction), 0.0f);

		if (s.pdf > 0.0f)
			sum += (double)(cosine / s.pdf *
					pen_environment_radiance(environment, s.direction, 0.0f).y);
	}
	return sum / ((double)SIDE * SIDE);
}

/* Light that the table cannot find: beside a bright texel, or in a level coarser than the picture.
 */
static void irradiance_by_sampling(void **state)
{
	static const struct pen_vec3 normals[] = {
		{0.0f, 1.0f, 0.0f}, {0.6f, 0.0f, -0.8f}, {0.0f, -1.0f, 0.0f}};
	static const uint32_t widths[] = {64, 75, 2100};

	(void)state;
	for (size_t i = 0; i < 3; i++) {
		struct surroundings made =
			make_surroundings(widths[i], widths[i] / 2, 500.0f, -33.0);

		for (size_t k = 0; k < 3; k++) {
			const double expected = quadrature(made.environment, normals[k]);
			const double found = sampled(made.environment, normals[k]);

			/* Of the widest the quadrature itself sees every sun texel but once. */
			if (fabs(found / expected - 1.0) > (widths[i] > 1000 ? 0.01 : 0.002))
				fail_msg("width %u, normal %zu: %g, not %g", widths[i], k, found,
					expected);
		}
		destroy_surroundings(&made);
	}
}

/* A picture turned, mirrored or upside down: its centre is +X, its right quarter +Z, its top +Y. */
static void where_the_picture_is(void **state)
{
	struct pen_picture picture = {.type = PEN_TEXEL_FLOATS,
		.width = 64,
		.height = 32,
		.texels = calloc(4ul * 64 * 32, 4)};
	struct pen_background_desc desc = {.intensity = 1.0};
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_mipmap *mipmap;
	struct pen_environment *e;
	float *texels = picture.texels;

	(void)state;
	assert_non_null(texels);
	for (uint32_t i = 0; i < 64 * 32; i++) {
		texels[4 * i] = ((float)(i % 64) + 0.5f) / 64.0f;
		texels[4 * i + 1] = ((float)(i / 64) + 0.5f) / 32.0f;
	}
	assert_int_equal(pen_mipmap_create(&picture, false, &mipmap, &err), 0);
	assert_int_equal(pen_environment_create(mipmap, &desc, &e, &err), 0);
	assert_float_equal(pen_environment_radiance(e, pen_vec3(1, 0, 0), 0).x, 0.5f, 1e-3f);
	assert_float_equal(pen_environment_radiance(e, pen_vec3(0, 0, 1), 0).x, 0.75f, 1e-3f);
	assert_float_equal(pen_environment_radiance(e, pen_vec3(0, 0, -1), 0).x, 0.25f, 1e-3f);
	assert_float_equal(pen_environment_radiance(e, pen_vec3(0, 1, 0), 0).y, 0.0f, 0.02f);
	assert_float_equal(
		pen_environment_radiance(e, pen_vec3(0.7071f, 0.7071f, 0), 0).y, 0.25f, 1e-3f);
	pen_environment_destroy(e);
	/* A quarter counter-clockwise seen from above takes the centre from +X to -Z. */
	desc.rotation = 90.0;
	assert_int_equal(pen_environment_create(mipmap, &desc, &e, &err), 0);
	assert_float_equal(pen_environment_radiance(e, pen_vec3(0, 0, -1), 0).x, 0.5f, 1e-3f);
	pen_environment_destroy(e);
	pen_mipmap_destroy(mipmap);
}

/* A wide cone that does not blur the picture, so that a mirror's view of it flickers. */
static void a_cone_sees_a_mean(void **state)
{
	struct surroundings made = make_surroundings(64, 32, 500.0f, 0.0);
	const struct pen_vec3 up = {0.0f, 1.0f, 0.0f};
	const struct pen_vec3 sun_azimuth =
		pen_environment_sample(made.environment, 0.5f, 0.5f).direction;
	const float sharp = pen_environment_radiance(made.environment, sun_azimuth, 0.0f).x;
	const float blurred = pen_environment_radiance(made.environment, sun_azimuth, 1.5f).x;

	(void)state;
	assert_true(sharp > 20.0f);
	assert_true(blurred < 0.5f * sharp && blurred > 0.0f);
	assert_true(isfinite(pen_environment_radiance(made.environment, up, 0.1f).x));
	destroy_surroundings(&made);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(where_the_picture_is),
		cmocka_unit_test(a_cone_sees_a_mean),
		cmocka_unit_test(directions_of_an_environment),
		cmocka_unit_test(irradiance_by_sampling),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
