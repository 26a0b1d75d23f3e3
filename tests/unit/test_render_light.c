/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light.h"

#include "core/render/light_choice.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static struct pen_light make_light(const struct pen_light_desc *desc)
{
	struct pen_light light;

	pen_light_init(&light, desc);
	return light;
}

static const struct pen_light_desc descs[] = {
	{.type = PEN_LIGHT_RECTANGLE, .u.rectangle = {{-1, 2, -1}, {2, 0, 0}, {0, 0, 2}}},
	{.type = PEN_LIGHT_TRIANGLE, .u.triangle = {{{-1, 2, -1}, {2, 2, -1}, {-1, 2, 2}}}},
	{.type = PEN_LIGHT_DISK, .u.disk = {{0, 2, 0}, {0, -1, 0}, 1}},
	{.type = PEN_LIGHT_SPHERE, .u.sphere = {{0, 2, 0}, 0.5}},
};

/* Light from behind a flat light or within a sphere, or a value that is not finite. */
static void emits_from_one_side(void **state)
{
	static const struct pen_vec3 front = {0.1f, 0.0f, 0.2f};
	/* Behind, in the light's plane beside it and within it, and at the sphere's centre. */
	static const struct pen_vec3 others[] = {
		{0.1f, 4.0f, 0.2f}, {7.0f, 2.0f, 0.0f}, {0.3f, 2.0f, 0.1f}, {0.0f, 2.0f, 0.0f}};

	(void)state;
	for (size_t d = 0; d < 4; d++) {
		const struct pen_light light = make_light(&descs[d]);

		assert_true(pen_light_sample_one(&light, front, 0.3f, 0.7f).strength == 1.0f);
		assert_true(pen_light_centre(&light, front).strength > 0.0f);
		for (size_t i = 0; i < 4; i++) {
			const struct pen_light_sample sample =
				pen_light_sample_one(&light, others[i], 0.3f, 0.7f);
			const bool sphere_shines = light.type == PEN_LIGHT_SPHERE && i < 2;

			assert_true(sample.strength == (sphere_shines ? 1.0f : 0.0f));
			assert_true(isfinite(pen_length(sample.direction)));
			assert_true(isfinite(sample.distance));
			assert_true(sample.pdf > 0.0f && isfinite(sample.pdf * sample.pdf));
		}
	}
}

/* The side that is seen to emit must be the side that is sampled. */
static void hits_emit_towards_the_front(void **state)
{
	(void)state;
	for (size_t d = 0; d < 4; d++) {
		const struct pen_light light = make_light(&descs[d]);

		assert_true(pen_light_emits(&light, pen_vec3(0, 1.5f, 0), pen_vec3(0, 1, 0)));
		assert_false(pen_light_emits(&light, pen_vec3(0, 1.5f, 0), pen_vec3(0, -1, 0)));
	}
}

/* All arrays of one light agree with one light at a time, bit for bit. */
static void many_points_are_as_one(void **state)
{
	enum { N = 48 };
	static float x[N], y[N], z[N], u[N], v[N], dx[N], dy[N], dz[N], t[N], s[N], pdf[N];

	(void)state;
	for (int i = 0; i < N; i++) {
		x[i] = (float)i / 10.0f - 2.0f;
		y[i] = -(float)(i % 5);
		z[i] = (float)(i % 7) / 3.0f;
		u[i] = (float)i / N;
		v[i] = (float)(i * 11 % N) / N;
	}
	for (size_t d = 0; d < 4; d++) {
		const struct pen_light light = make_light(&descs[d]);

		pen_light_sample(&light, N, &(struct pen_light_points){x, y, z}, u, v,
			&(struct pen_light_samples){dx, dy, dz, t, s, pdf});
		for (int i = 0; i < N; i++) {
			const struct pen_light_sample one = pen_light_sample_one(
				&light, pen_vec3(x[i], y[i], z[i]), u[i], v[i]);

			assert_true(one.direction.x == dx[i] && one.direction.y == dy[i]);
			assert_true(one.direction.z == dz[i] && one.distance == t[i]);
			assert_true(one.strength == s[i] && one.pdf == pdf[i]);
		}
	}
}

/* The spot's documented falloff: full within, nothing outside, a half in the cosine's middle. */
static void spot_fades_as_documented(void **state)
{
	const struct pen_light_desc desc = {
		.type = PEN_LIGHT_SPOT,
		.u.spot = {{0, 5, 0}, {0, -1, 0}, 60.0, 0.5},
	};
	const struct pen_light light = make_light(&desc);
	const double edge = cos(M_PI / 6.0);
	const double middle = edge + 0.25 * (1.0 - edge);
	const double inner = edge + 0.5001 * (1.0 - edge);
	const double cosines[] = {1.0, inner, middle, edge - 1e-4, 0.0};
	const float strengths[] = {1.0f, 1.0f, 0.5f, 0.0f, 0.0f};

	(void)state;
	for (size_t i = 0; i < 5; i++) {
		const double sine = sqrt(1.0 - cosines[i] * cosines[i]);
		const struct pen_vec3 p = {
			(float)(2.0 * sine), (float)(5.0 - 2.0 * cosines[i]), 0.0f};
		const struct pen_light_sample sample = pen_light_sample_one(&light, p, 0.5f, 0.5f);

		assert_float_equal(sample.strength, strengths[i] / 4.0f, 1e-5f);
		assert_float_equal(sample.distance, 2.0f, 1e-5f);
		assert_true(sample.pdf == 1.0f);
	}
}

/* A sharp spot divides by its blend of 0. */
static void spot_without_blend_is_sharp(void **state)
{
	const struct pen_light_desc desc = {
		.type = PEN_LIGHT_SPOT,
		.u.spot = {{0, 1, 0}, {0, -1, 0}, 90.0, 0.0},
	};
	const struct pen_light light = make_light(&desc);

	(void)state;
	assert_float_equal(pen_light_sample_one(&light, pen_vec3(0.999f, 0, 0), 0, 0).strength,
		0.5005f, 1e-4f);
	assert_true(pen_light_sample_one(&light, pen_vec3(1.001f, 0, 0), 0, 0).strength == 0.0f);
}

/* Far from a light its centre stands for the whole: both estimates of irradiance meet. */
static void centre_stands_for_the_light(void **state)
{
	const struct pen_vec3 p = {3.0f, -80.0f, 2.0f};

	(void)state;
	for (size_t d = 0; d < 4; d++) {
		const struct pen_light light = make_light(&descs[d]);
		const struct pen_light_sample centre = pen_light_centre(&light, p);
		const struct pen_light_sample sample = pen_light_sample_one(&light, p, 0.5f, 0.5f);

		assert_float_equal(centre.strength * sample.pdf, 1.0f, 0.01f);
		assert_float_equal(centre.distance / sample.distance, 1.0f, 0.02f);
		assert_true(pen_dot(centre.direction, sample.direction) > 0.999f);
	}
}

/* An alias table that loses a light's share: count what columns give each light. */
static void choice_follows_power(void **state)
{
	enum { COUNT = 13, V = 4096 };
	double powers[COUNT], share[COUNT] = {0}, sum = 0.0;
	struct pen_light_choice choice;

	(void)state;
	for (int i = 0; i < COUNT; i++) {
		powers[i] = i == 4 ? 0.0 : 1.0 + (i * i) % 7;
		sum += powers[i];
	}
	assert_int_equal(pen_light_choice_init(&choice, powers, COUNT, NULL), 0);
	for (int column = 0; column < COUNT; column++) {
		for (int v = 0; v < V; v++) {
			const uint32_t light = pen_light_choose(
				&choice, ((float)column + 0.5f) / COUNT, ((float)v + 0.5f) / V);

			share[light] += 1.0 / (COUNT * V);
		}
	}
	for (int i = 0; i < COUNT; i++) {
		assert_float_equal((float)share[i], choice.chance[i], 1e-3f);
		assert_float_equal((float)(powers[i] / sum), choice.chance[i], 1e-6f);
	}
	assert_true(share[4] == 0.0);
	pen_light_choice_finish(&choice);
}

/* Without any power every light must still be found. */
static void choice_without_power_is_even(void **state)
{
	const double powers[4] = {0};
	struct pen_light_choice choice;

	(void)state;
	assert_int_equal(pen_light_choice_init(&choice, powers, 4, NULL), 0);
	for (uint32_t i = 0; i < 4; i++) {
		assert_true(choice.chance[i] == 0.25f);
		assert_int_equal(pen_light_choose(&choice, ((float)i + 0.5f) / 4, 0.9f), i);
	}
	pen_light_choice_finish(&choice);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(emits_from_one_side),
		cmocka_unit_test(hits_emit_towards_the_front),
		cmocka_unit_test(many_points_are_as_one),
		cmocka_unit_test(spot_fades_as_documented),
		cmocka_unit_test(spot_without_blend_is_sharp),
		cmocka_unit_test(centre_stands_for_the_light),
		cmocka_unit_test(choice_follows_power),
		cmocka_unit_test(choice_without_power_is_even),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
