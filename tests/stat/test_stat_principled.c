/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/albedo.h"
#include "core/render/principled.h"

#include "directions.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

struct surface {
	struct pen_principled p;
	struct pen_vec3 n, wo;
	struct pen_principled_chances chances;
	bool follows_diffuse;
};

struct settings {
	const char *name;
	float roughness, metallic, transmission, coat, coat_roughness, eta;
	int is_solid;
};

static const struct settings all[] = {
	{"plastic", 0.5f, 0.0f, 0.0f, 0.0f, 0.0f, 1.5f, 0},
	{"smooth plastic", 0.2f, 0.0f, 0.0f, 0.0f, 0.0f, 1.5f, 0},
	{"metal", 0.6f, 1.0f, 0.0f, 0.0f, 0.0f, 1.5f, 0},
	{"half metal", 0.4f, 0.5f, 0.0f, 0.0f, 0.0f, 1.5f, 0},
	{"thin wall", 0.5f, 0.0f, 1.0f, 0.0f, 0.0f, 1.5f, 0},
	{"body of glass", 0.5f, 0.0f, 1.0f, 0.0f, 0.0f, 1.5f, 1},
	{"out of glass", 0.5f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f / 1.5f, 1},
	{"milky glass", 0.7f, 0.0f, 0.5f, 0.0f, 0.0f, 1.3f, 1},
	{"coated", 0.8f, 0.0f, 0.0f, 1.0f, 0.3f, 1.5f, 0},
	{"all at once", 0.5f, 0.3f, 0.4f, 0.6f, 0.4f, 1.5f, 1},
};

enum { ALL = sizeof all / sizeof *all };

static const double angles[] = {0.0, 45.0, 80.0};

static struct surface make(
	const struct settings *s, const struct pen_albedo *albedo, double degrees, bool diffuse)
{
	const struct pen_vec3 n = pen_normalize(pen_vec3(0.3f, -0.5f, 0.6f));
	const struct pen_basis basis = pen_basis(n);
	const double angle = degrees * M_PI / 180.0;
	const struct pen_vec3 local = {
		(float)(0.8 * sin(angle)), (float)(0.6 * sin(angle)), (float)cos(angle)};
	struct surface surface = {
		.p = {.color = {1.0f, 1.0f, 1.0f},
			.alpha = pen_max(s->roughness * s->roughness, PEN_ALPHA_MIN),
			.eta = s->eta,
			.f0 = 0.04f,
			.metallic = s->metallic,
			.transmission = s->transmission,
			.is_solid = s->is_solid,
			.coat = s->coat,
			.coat_alpha = pen_max(s->coat_roughness * s->coat_roughness, PEN_ALPHA_MIN),
			.coat_normal = n,
			.smooth_normal = n},
		.n = n,
		.wo = pen_to_world(&basis, local),
		.follows_diffuse = diffuse,
	};

	surface.p.albedo = pen_albedo_of(albedo, 0.04f, s->roughness, local.z);
	surface.chances = pen_principled_chances(&surface.p, n, surface.wo, diffuse ? 0.75f : 0.5f);
	return surface;
}

static bool sample(const void *context, float u, float v, float w, struct pen_vec3 *ret_direction)
{
	const struct surface *s = context;

	*ret_direction =
		pen_principled_sample(&s->p, &s->chances, s->n, s->wo, u, v, w, s->follows_diffuse);
	return pen_dot(*ret_direction, *ret_direction) > 0.0f;
}

static double density(const void *context, struct pen_vec3 direction)
{
	const struct surface *s = context;
	const struct pen_principled_value value =
		pen_principled_eval(&s->p, s->n, s->wo, direction);

	return (double)pen_principled_pdf(&value, &s->chances, s->follows_diffuse);
}

/* A lobe chosen more often than the density says, or a density of a lobe in the wrong hemisphere.
 */
static void directions_follow_their_density(void **state)
{
	static struct pen_albedo albedo;

	(void)state;
	pen_albedo_init(&albedo);
	for (int i = 0; i < ALL; i++) {
		for (int a = 0; a < 3; a++) {
			for (int diffuse = 0; diffuse < 2; diffuse++) {
				const struct surface s =
					make(&all[i], &albedo, angles[a], diffuse != 0);
				char name[96];
				const struct direction_case test = {name, sample, density, &s,
					all[i].transmission > 0.0f && all[i].is_solid
						? pen_normalize(pen_refract(s.wo, s.n, s.p.eta))
						: pen_reflect(s.wo, s.n)};

				snprintf(name, sizeof name, "%s at %.0f degrees%s", all[i].name,
					angles[a], diffuse ? "" : " without diffuse");
				assert_directions(&test);
			}
		}
	}
}

/* The same of what Blender 3 has, where what is below a coat keeps its chance. */
static void additive_directions_follow_their_density(void **state)
{
	static struct pen_albedo albedo;

	(void)state;
	pen_albedo_init(&albedo);
	for (int i = 0; i < ALL; i++) {
		struct surface s = make(&all[i], &albedo, 45.0, true);
		const struct direction_case test = {all[i].name, sample, density, &s,
			all[i].transmission > 0.0f && all[i].is_solid
				? pen_normalize(pen_refract(s.wo, s.n, s.p.eta))
				: pen_reflect(s.wo, s.n)};

		s.p.is_additive = 1;
		s.chances = pen_principled_chances(&s.p, s.n, s.wo, 0.75f);
		assert_directions(&test);
	}
}

/* What the surface returns of a white world, by its own samples: rounds times 4096 of them. */
static double returned(const struct surface *s, int rounds)
{
	enum { SIDE = 64 };
	struct random_numbers numbers = {.state = 9};
	double sum = 0.0;

	for (int i = 0; i < SIDE * SIDE * rounds; i++) {
		const float u = ((float)(i % SIDE) + random_next(&numbers)) / SIDE;
		const float v = ((float)(i / SIDE % SIDE) + random_next(&numbers)) / SIDE;
		struct pen_principled_value value;
		struct pen_vec3 wi;

		if (!sample(s, u, v, random_next(&numbers), &wi))
			continue;
		value = pen_principled_eval(&s->p, s->n, s->wo, wi);
		sum += (double)((value.diffuse.x + value.others.x) /
				pen_principled_pdf(&value, &s->chances, s->follows_diffuse));
	}
	return sum / (SIDE * SIDE * rounds);
}

/*
 * A white furnace never comes out brighter than it is: broken by glTF's own mix of diffuse and
 * specular near grazing, which gives both nearly everything. Nor is much lost on what is not rough.
 */
static void furnace_is_not_outshone(void **state)
{
	static const double steep[] = {0.0, 30.0, 60.0, 75.0, 85.0, 89.0};
	static struct pen_albedo albedo;

	(void)state;
	pen_albedo_init(&albedo);
	for (int i = 0; i < ALL; i++) {
		for (int a = 0; a < 6; a++) {
			const struct surface s = make(&all[i], &albedo, steep[a], true);
			const double whole = returned(&s, 16);

			if (whole > 1.01 || whole < 0.55)
				fail_msg("%s at %.0f degrees returns %.4f", all[i].name, steep[a],
					whole);
		}
	}
}

/* The same over all mixtures: broken by a lobe that takes its share from no other. */
static void mixtures_do_not_outshine_the_furnace(void **state)
{
	static const float roughnesses[] = {0.0f, 0.15f, 0.4f, 0.7f, 1.0f};
	static const double steep[] = {5.0, 50.0, 70.0, 82.0, 88.0};
	static struct pen_albedo albedo;

	(void)state;
	pen_albedo_init(&albedo);
	for (int i = 0; i < 5 * 5 * 3 * 3 * 3 * 3; i++) {
		const int side = i / 675 % 3; /* a thin wall, into a body, out of it */
		const struct settings s = {"a mixture", roughnesses[i % 5],
			0.5f * (float)(i / 25 % 3), 0.5f * (float)(i / 75 % 3),
			0.5f * (float)(i / 225 % 3), roughnesses[(i + 2) % 5],
			side == 2 ? 1.0f / 1.5f : 1.5f, side > 0};
		const struct surface surface = make(&s, &albedo, steep[i / 5 % 5], true);
		const double whole = returned(&surface, 1);

		if (whole > 1.02)
			fail_msg("roughness %.2f, metallic %.1f, transmission %.1f, coat %.1f, "
				 "side %d at %.0f degrees returns %.4f",
				(double)s.roughness, (double)s.metallic, (double)s.transmission,
				(double)s.coat, side, steep[i / 5 % 5], whole);
	}
}

/* Without coat, and where the base is not dimmed for the furnace's sake, light goes both ways. */
static void opaque_surfaces_are_reciprocal(void **state)
{
	static struct pen_albedo albedo;
	struct random_numbers numbers = {.state = 3};
	const struct pen_vec3 n = {0.0f, 0.0f, 1.0f};

	(void)state;
	pen_albedo_init(&albedo);
	for (int i = 0; i < 2000; i++) {
		const struct settings *settings = &all[i % 4];
		struct surface s = make(settings, &albedo, 0.0, true);
		const struct pen_vec3 a =
			pen_warp_cosine(random_next(&numbers), random_next(&numbers));
		const struct pen_vec3 b =
			pen_warp_cosine(random_next(&numbers), random_next(&numbers));
		struct pen_principled_value there, back;

		s.p.coat_normal = s.p.smooth_normal = n;
		s.p.albedo = 0.0f;
		if (a.z < 0.05f || b.z < 0.05f)
			continue;
		there = pen_principled_eval(&s.p, n, a, b);
		back = pen_principled_eval(&s.p, n, b, a);
		assert_float_equal((there.diffuse.x + there.others.x) / b.z /
					   ((back.diffuse.x + back.others.x) / a.z),
			1.0f, 1e-3f);
	}
}

/* Against the formulas of glTF's appendix B.3, written out for one case by hand. */
static void values_are_those_of_gltf(void **state)
{
	static struct pen_albedo albedo;
	const struct pen_vec3 n = {0.0f, 0.0f, 1.0f};
	const struct pen_vec3 l = {0.6f, 0.0f, 0.8f}, v = {-0.28f, 0.0f, 0.96f};
	struct surface s;
	struct pen_principled_value value;
	const double alpha = 0.25, base = 0.7, a2 = alpha * alpha;
	const double hx = 0.32, hz = 1.76, length = sqrt(hx * hx + hz * hz);
	const double nh = hz / length, vh = (-0.28 * hx + 0.96 * hz) / length;
	const double d = a2 / (M_PI * pow(nh * nh * (a2 - 1.0) + 1.0, 2.0));
	const double visibility = 1.0 / (0.8 + sqrt(a2 + (1.0 - a2) * 0.64)) /
				  (0.96 + sqrt(a2 + (1.0 - a2) * 0.9216));
	const double fresnel = 0.04 + 0.96 * pow(1.0 - vh, 5.0);
	const double metal = base + (1.0 - base) * pow(1.0 - vh, 5.0);
	const double dielectric = (1.0 - fresnel) * base / M_PI + fresnel * d * visibility;
	const double wanted = 0.5 * (dielectric + metal * d * visibility) * 0.8;

	(void)state;
	pen_albedo_init(&albedo);
	s = make(&all[3], &albedo, 0.0, true);
	s.p.color = pen_vec3(0.7f, 0.7f, 0.7f);
	s.p.alpha = 0.25f;
	s.p.coat_normal = s.p.smooth_normal = n;
	s.p.albedo = 0.0f;
	value = pen_principled_eval(&s.p, n, v, l);
	assert_float_equal(value.diffuse.x + value.others.x, (float)wanted, 1e-5f);
}

/* Against Burley's diffuse lobe and Blender's sum of it with the others, by hand. */
static void additive_values_are_those_of_blender(void **state)
{
	static struct pen_albedo albedo;
	const struct pen_vec3 n = {0.0f, 0.0f, 1.0f};
	const struct pen_vec3 l = {0.6f, 0.0f, 0.8f}, v = {-0.28f, 0.0f, 0.96f};
	struct surface s;
	struct pen_principled_value value;
	const double alpha = 0.25, base = 0.7, a2 = alpha * alpha;
	const double hx = 0.32, hz = 1.76, length = sqrt(hx * hx + hz * hz);
	const double nh = hz / length, vh = (-0.28 * hx + 0.96 * hz) / length;
	const double d = a2 / (M_PI * pow(nh * nh * (a2 - 1.0) + 1.0, 2.0));
	const double visibility = 1.0 / (0.8 + sqrt(a2 + (1.0 - a2) * 0.64)) /
				  (0.96 + sqrt(a2 + (1.0 - a2) * 0.9216));
	const double g = sqrt(1.25 + vh * vh),
		     parallel = (vh * (g + vh) - 1.0) / (vh * (g - vh) + 1.0);
	const double fresnel = 0.5 * pow((g - vh) / (g + vh), 2.0) * (1.0 + parallel * parallel);
	const double metal = base + (1.0 - base) * (fresnel - 0.04) / 0.96;
	const double rise = 2.0 * 0.5 * vh * vh - 0.5;
	const double burley = (1.0 + rise * pow(0.2, 5.0)) * (1.0 + rise * pow(0.04, 5.0));
	const double wanted =
		0.5 * (base / M_PI * burley + (fresnel + metal) * d * visibility) * 0.8;

	(void)state;
	pen_albedo_init(&albedo);
	s = make(&all[3], &albedo, 0.0, true);
	s.p.is_additive = 1;
	s.p.color = pen_vec3(0.7f, 0.7f, 0.7f);
	s.p.alpha = 0.25f;
	s.p.coat_normal = s.p.smooth_normal = n;
	value = pen_principled_eval(&s.p, n, v, l);
	assert_float_equal(value.diffuse.x + value.others.x, (float)wanted, 1e-5f);
}

/* Light that a normal map lets in below the surface, or that ends on its terminator at once. */
static void bent_surfaces_fade_at_the_terminator(void **state)
{
	static struct pen_albedo albedo;
	struct surface s;
	float before = 0.0f;

	(void)state;
	pen_albedo_init(&albedo);
	s = make(&all[0], &albedo, 0.0, true);
	s.p.smooth_normal = s.p.coat_normal = pen_vec3(0.0f, 0.0f, 1.0f);
	s.n = pen_vec3(0.6f, 0.0f, 0.8f);
	for (int degrees = -20; degrees <= 40; degrees++) {
		const double angle = degrees * M_PI / 180.0;
		const struct pen_vec3 wi = {(float)cos(angle), 0.0f, (float)sin(angle)};
		const double g = sin(angle) / (0.8 * (double)pen_dot(s.n, wi));
		const double wanted = g <= 0.0 ? 0.0 : g >= 1.0 ? 1.0 : g + g * g - g * g * g;
		const float found = pen_terminator(s.p.smooth_normal, s.n, wi);
		const float lit =
			pen_principled_eval(&s.p, s.n, pen_vec3(0.0f, 0.0f, 1.0f), wi).diffuse.x;

		assert_float_equal(found, (float)wanted, 1e-5f);
		assert_true(lit >= 0.0f && lit - before < 0.02f);
		before = lit;
	}
	assert_true(before > 0.1f);
	assert_float_equal(pen_terminator(s.n, s.n, pen_vec3(0.0f, 0.1f, 0.9f)), 1.0f, 1e-5f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(directions_follow_their_density),
		cmocka_unit_test(furnace_is_not_outshone),
		cmocka_unit_test(mixtures_do_not_outshine_the_furnace),
		cmocka_unit_test(opaque_surfaces_are_reciprocal),
		cmocka_unit_test(values_are_those_of_gltf),
		cmocka_unit_test(additive_values_are_those_of_blender),
		cmocka_unit_test(additive_directions_follow_their_density),
		cmocka_unit_test(bent_surfaces_fade_at_the_terminator),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
