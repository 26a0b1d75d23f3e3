/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/bsdf.h"

#include "directions.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* A surface whose normal is no axis, seen under an angle. */
struct surface {
	struct pen_vec3 n, wo;
	float alpha, eta;
};

static struct surface make_surface(float alpha, float eta, double degrees)
{
	const struct pen_vec3 n = pen_normalize(pen_vec3(0.3f, -0.5f, 0.6f));
	const struct pen_basis basis = pen_basis(n);
	const struct pen_vec3 local = {(float)(0.8 * sin(degrees * M_PI / 180.0)),
		(float)(0.6 * sin(degrees * M_PI / 180.0)), (float)cos(degrees * M_PI / 180.0)};

	return (struct surface){n, pen_to_world(&basis, local), alpha, eta};
}

static bool sample_matte(
	const void *context, float u, float v, float w, struct pen_vec3 *ret_direction)
{
	const struct surface *surface = context;

	(void)w;
	*ret_direction = pen_matte_sample(surface->n, u, v).direction;
	return true;
}

static double density_matte(const void *context, struct pen_vec3 direction)
{
	const struct surface *surface = context;

	return (double)pen_matte_eval(surface->n, direction).pdf;
}

static bool sample_glossy(
	const void *context, float u, float v, float w, struct pen_vec3 *ret_direction)
{
	const struct surface *s = context;
	const struct pen_lobe lobe = pen_glossy_sample(s->alpha, s->n, s->wo, u, v);

	(void)w;
	*ret_direction = lobe.direction;
	return lobe.weight > 0.0f;
}

static double density_glossy(const void *context, struct pen_vec3 direction)
{
	const struct surface *s = context;

	return (double)pen_glossy_eval(s->alpha, s->n, s->wo, direction).pdf;
}

static bool sample_glass(
	const void *context, float u, float v, float w, struct pen_vec3 *ret_direction)
{
	const struct surface *s = context;
	const struct pen_lobe lobe = pen_glass_sample(s->alpha, s->eta, s->n, s->wo, u, v, w);

	*ret_direction = lobe.direction;
	return lobe.weight > 0.0f;
}

static double density_glass(const void *context, struct pen_vec3 direction)
{
	const struct surface *s = context;

	return (double)pen_glass_eval(s->alpha, s->eta, s->n, s->wo, direction).pdf;
}

/* A cosine warp that is off by a factor or a frame that is skewed. */
static void matte_directions(void **state)
{
	const struct surface surface = make_surface(1.0f, 1.0f, 30.0);
	const struct direction_case test = {
		"matte", sample_matte, density_matte, &surface, surface.n};

	(void)state;
	assert_directions(&test);
}

static const float roughnesses[] = {0.1f, 0.3f, 0.5f, 0.75f, 1.0f};
static const double angles[] = {0.0, 45.0, 80.0};

/* The bound of Eto and Tokuyoshi left out of the density, or an alpha squared too often. */
static void glossy_directions(void **state)
{
	(void)state;
	for (size_t r = 0; r < 5; r++) {
		for (size_t a = 0; a < 3; a++) {
			const float alpha = roughnesses[r] * roughnesses[r];
			const struct surface s = make_surface(alpha, 1.0f, angles[a]);
			char name[64];
			const struct direction_case test = {
				name, sample_glossy, density_glossy, &s, pen_reflect(s.wo, s.n)};

			snprintf(name, sizeof(name), "glossy alpha %.3f at %.0f degrees",
				(double)alpha, angles[a]);
			assert_directions(&test);
		}
	}
}

/* A wrong half vector or Jacobian of refraction, on entering and on leaving. */
static void glass_directions(void **state)
{
	static const float etas[] = {1.5f, 1.0f / 1.5f, 1.1f};

	(void)state;
	for (size_t e = 0; e < 3; e++) {
		for (size_t a = 0; a < 3; a++) {
			for (size_t r = 1; r < 5; r += 2) {
				const float alpha = roughnesses[r] * roughnesses[r];
				const struct surface s = make_surface(alpha, etas[e], angles[a]);
				const struct pen_vec3 straight = pen_refract(s.wo, s.n, s.eta);
				char name[64];
				const struct direction_case test = {name, sample_glass,
					density_glass, &s, pen_normalize(straight)};

				snprintf(name, sizeof(name),
					"glass %.2f alpha %.3f at %.0f degrees", (double)s.eta,
					(double)alpha, angles[a]);
				assert_directions(&test);
			}
		}
	}
}

/* What sample says of its direction must be what eval says: MIS weighs one by the other. */
static void samples_agree_with_eval(void **state)
{
	struct random_numbers numbers = {.state = 5};

	(void)state;
	for (int i = 0; i < 100000; i++) {
		const float alpha = 0.02f + 0.98f * random_next(&numbers);
		const float eta = random_next(&numbers) < 0.5f ? 1.45f : 1.0f / 1.45f;
		const struct surface s =
			make_surface(alpha, eta, 85.0 * (double)random_next(&numbers));
		const float u = 0.99f * random_next(&numbers);
		const float v = random_next(&numbers);
		const struct pen_lobe g = pen_glossy_sample(alpha, s.n, s.wo, u, v);
		const struct pen_lobe_value ge = pen_glossy_eval(alpha, s.n, s.wo, g.direction);
		const struct pen_lobe t =
			pen_glass_sample(alpha, eta, s.n, s.wo, u, v, random_next(&numbers));
		const struct pen_lobe_value te = pen_glass_eval(alpha, eta, s.n, s.wo, t.direction);

		if (g.weight > 1e-3f) {
			assert_float_equal(ge.pdf / g.pdf, 1.0f, 0.01f);
			assert_float_equal(ge.value / (g.pdf * g.weight), 1.0f, 0.01f);
		}
		/* At grazing refraction the half vector loses digits. */
		if (t.weight > 0.2f && t.pdf < 1e3f) {
			assert_float_equal(te.pdf / t.pdf, 1.0f, 0.05f);
			assert_float_equal(te.value / (t.pdf * t.weight), 1.0f, 0.05f);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(matte_directions),
		cmocka_unit_test(glossy_directions),
		cmocka_unit_test(glass_directions),
		cmocka_unit_test(samples_agree_with_eval),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
