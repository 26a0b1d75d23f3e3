/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/bsdf.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static const struct pen_vec3 up = {0.0f, 0.0f, 1.0f};

static struct pen_vec3 under_angle(double degrees)
{
	return pen_vec3(
		(float)sin(degrees * M_PI / 180.0), 0.0f, (float)cos(degrees * M_PI / 180.0));
}

/* A mirror or smooth glass in a white world is invisible: any other weight tints it. */
static void smooth_surfaces_lose_nothing(void **state)
{
	(void)state;
	for (double degrees = 0.0; degrees < 90.0; degrees += 0.5) {
		const struct pen_vec3 wo = under_angle(degrees);

		assert_true(pen_mirror_sample(up, wo).weight == 1.0f);
		for (float choice = 0.0f; choice < 1.0f; choice += 0.05f) {
			const struct pen_lobe in = pen_glass_smooth_sample(1.5f, up, wo, choice);
			const struct pen_lobe out =
				pen_glass_smooth_sample(1.0f / 1.5f, up, wo, choice);

			assert_true(in.weight == 1.0f && out.weight == 1.0f);
			assert_float_equal(pen_length(in.direction), 1.0f, 1e-6f);
			assert_float_equal(pen_length(out.direction), 1.0f, 1e-6f);
		}
	}
}

/* Reference values of the reflectance: normal, Brewster's angle, grazing, total reflection. */
static void fresnel_values(void **state)
{
	const double brewster = atan(1.5);
	const double s = sin(brewster - (0.5 * M_PI - brewster));

	(void)state;
	assert_float_equal(pen_fresnel(1.0f, 1.5f), 0.04f, 1e-7f);
	assert_float_equal(pen_fresnel(1.0f, 1.0f / 1.5f), 0.04f, 1e-7f);
	assert_float_equal(pen_fresnel((float)cos(brewster), 1.5f), (float)(0.5 * s * s), 1e-6f);
	assert_float_equal(pen_fresnel(0.0f, 1.5f), 1.0f, 1e-6f);
	assert_true(pen_fresnel(0.7f, 1.0f / 1.5f) == 1.0f);
	assert_true(pen_fresnel(0.75f, 1.0f / 1.5f) < 1.0f);
}

/* Snell's law, and the way back: light that entered leaves along the same line. */
static void refraction_follows_snell(void **state)
{
	(void)state;
	for (double degrees = 0.0; degrees < 90.0; degrees += 1.0) {
		const struct pen_vec3 wo = under_angle(degrees);
		const struct pen_vec3 wi = pen_refract(wo, up, 1.5f);
		/* Near grazing the cosine comes from a difference of squares. */
		const float tolerance = degrees < 80.0 ? 1e-5f : 1e-3f;
		const struct pen_vec3 back = pen_refract(wi, pen_neg(up), 1.0f / 1.5f);

		assert_float_equal(-wi.x * 1.5f, wo.x, 1e-6f);
		assert_true(wi.z < 0.0f && wi.y == 0.0f);
		assert_float_equal(back.x, wo.x, 1e-5f);
		assert_float_equal(back.z, wo.z, tolerance);
	}
}

/* The share of smooth glass's choices that reflect is Fresnel's term. */
static void glass_chooses_by_fresnel(void **state)
{
	enum { N = 10000 };
	const struct pen_vec3 wo = under_angle(70.0);
	int reflected = 0;

	(void)state;
	for (int i = 0; i < N; i++)
		reflected +=
			pen_glass_smooth_sample(1.5f, up, wo, ((float)i + 0.5f) / N).direction.z >
			0.0f;
	assert_float_equal((float)reflected / N, pen_fresnel(wo.z, 1.5f), 1e-4f);
}

/* f(wo, wi) = f(wi, wo): broken by any masking term that knows one direction only. */
static void glossy_is_reciprocal(void **state)
{
	(void)state;
	for (int i = 0; i < 1000; i++) {
		const struct pen_vec3 a =
			pen_warp_cosine((float)(i % 32) / 32, (float)(i / 32) / 32);
		const struct pen_vec3 b =
			pen_warp_cosine((float)(i % 29) / 29, (float)(i / 40) / 29);
		const float there = pen_glossy_eval(0.4f, up, a, b).value / b.z;
		const float back = pen_glossy_eval(0.4f, up, b, a).value / a.z;

		if (a.z > 1e-3f && b.z > 1e-3f)
			assert_float_equal(there / back, 1.0f, 1e-4f);
	}
}

/* What a rough reflector returns of a white world, by its own samples. */
static double glossy_albedo(float alpha, double degrees)
{
	enum { SIDE = 500 };
	const struct pen_vec3 wo = under_angle(degrees);
	double sum = 0.0;

	for (int i = 0; i < SIDE * SIDE; i++)
		sum += (double)pen_glossy_sample(alpha, up, wo, ((float)(i % SIDE) + 0.5f) / SIDE,
			((float)(i / SIDE) + 0.5f) / SIDE)
			       .weight;
	return sum / (SIDE * SIDE);
}

/* The values that Cycles 3.4 renders, which tell separable from height-correlated masking. */
static void glossy_albedo_is_that_of_cycles(void **state)
{
	static const struct {
		float roughness;
		double degrees, albedo;
	} measured[] = {
		{1.0f, 0.0, 0.3069},
		{1.0f, 45.0, 0.3595},
		{1.0f, 75.0, 0.4875},
		{0.8f, 0.0, 0.5552},
		{0.8f, 45.0, 0.5732},
		{0.8f, 75.0, 0.6567},
		{0.5f, 0.0, 0.9158},
		{0.5f, 45.0, 0.8856},
		{0.5f, 75.0, 0.8284},
	};

	(void)state;
	for (size_t i = 0; i < sizeof(measured) / sizeof(measured[0]); i++) {
		const float alpha = measured[i].roughness * measured[i].roughness;
		const double albedo = glossy_albedo(alpha, measured[i].degrees);

		if (fabs(albedo - measured[i].albedo) > 0.0015)
			fail_msg("roughness %g at %g degrees: %.4f instead of %.4f",
				(double)measured[i].roughness, measured[i].degrees, albedo,
				measured[i].albedo);
	}
}

/* Nearly smooth lobes must tend to the mirror and to refraction, without losing light or digits. */
static void narrow_lobes_tend_to_smooth_ones(void **state)
{
	(void)state;
	for (double degrees = 0.0; degrees < 85.0; degrees += 5.0) {
		const struct pen_vec3 wo = under_angle(degrees);
		const struct pen_vec3 mirrored = pen_reflect(wo, up);

		for (int i = 0; i < 400; i++) {
			const float u = (float)(i % 20) / 20;
			const float v = (float)(i / 20) / 20;
			const struct pen_lobe lobe = pen_glossy_sample(PEN_ALPHA_MIN, up, wo, u, v);
			const struct pen_lobe_value value =
				pen_glossy_eval(PEN_ALPHA_MIN, up, wo, lobe.direction);

			assert_true(pen_length(pen_sub(lobe.direction, mirrored)) < 0.02f);
			assert_float_equal(lobe.weight, 1.0f, 1e-3f);
			/* MIS weighs with both; at alpha 1e-3 a few digits are left. */
			assert_float_equal(value.pdf / lobe.pdf, 1.0f, 0.02f);
		}
	}
}

/* Directions at and below the horizon, as interpolated normals give: finite, and no light. */
static void horizon_is_finite(void **state)
{
	static const struct pen_vec3 low[] = {{1, 0, 0}, {0.99995f, 0, -0.01f}, {0, 0, -1}};

	(void)state;
	for (size_t i = 0; i < 3; i++) {
		for (size_t j = 0; j < 3; j++) {
			const struct pen_lobe g = pen_glossy_sample(0.3f, up, low[i], 0.4f, 0.6f);
			const struct pen_lobe t =
				pen_glass_sample(0.3f, 1.5f, up, low[i], 0.4f, 0.6f, 0.5f);
			const struct pen_lobe_value ge = pen_glossy_eval(0.3f, up, low[i], low[j]);
			const struct pen_lobe_value te =
				pen_glass_eval(0.3f, 1.5f, up, low[i], low[j]);

			assert_true(
				isfinite(g.weight) && isfinite(g.pdf) && isfinite(g.direction.x));
			assert_true(
				isfinite(t.weight) && isfinite(t.pdf) && isfinite(t.direction.x));
			assert_true(ge.value == 0.0f && ge.pdf == 0.0f);
			assert_true(isfinite(te.value) && isfinite(te.pdf));
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(smooth_surfaces_lose_nothing),
		cmocka_unit_test(fresnel_values),
		cmocka_unit_test(refraction_follows_snell),
		cmocka_unit_test(glass_chooses_by_fresnel),
		cmocka_unit_test(glossy_is_reciprocal),
		cmocka_unit_test(glossy_albedo_is_that_of_cycles),
		cmocka_unit_test(narrow_lobes_tend_to_smooth_ones),
		cmocka_unit_test(horizon_is_finite),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
