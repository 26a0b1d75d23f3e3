/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light_tree.h"
#include "core/scene/desc.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { LIGHTS = 300 };

static float next(uint32_t *state)
{
	*state = *state * 1664525u + 1013904223u;
	return (float)(*state >> 8) * 0x1p-24f;
}

static struct pen_vec3 next_direction(uint32_t *state)
{
	struct pen_vec3 d = {
		2.0f * next(state) - 1.0f, 2.0f * next(state) - 1.0f, 2.0f * next(state) - 1.0f};

	return pen_normalize(d);
}

/* Small flat lights, every third from both sides, all in one plane where is_flat. */
static void make_hulls(struct pen_light_hull *hulls, uint32_t count, bool is_flat)
{
	uint32_t state = 7;

	for (uint32_t i = 0; i < count; i++) {
		const float at[3] = {next(&state), is_flat ? 1.0f : next(&state), next(&state)};

		hulls[i] = (struct pen_light_hull){
			.axis = is_flat ? pen_vec3(0.0f, -1.0f, 0.0f) : next_direction(&state),
			.cos_axis = 1.0f,
			.strength = 0.01f + next(&state),
			.light = count - 1 - i,
			.two_sided = i % 3 == 0,
		};
		for (int k = 0; k < 3; k++) {
			hulls[i].lower[k] = at[k] - 0.01f;
			hulls[i].upper[k] = at[k] + 0.01f;
		}
	}
}

static struct pen_vec3 center_of(const struct pen_light_hull *hull)
{
	return pen_vec3(0.5f * (hull->lower[0] + hull->upper[0]),
		0.5f * (hull->lower[1] + hull->upper[1]), 0.5f * (hull->lower[2] + hull->upper[2]));
}

/* A bound that is too narrow: a light that shines on a point must have a chance there. */
static void what_shines_has_a_chance(void **state)
{
	struct pen_light_hull hulls[LIGHTS], before[LIGHTS];
	struct pen_light_tree tree;
	uint32_t random = 3;

	(void)state;
	for (int is_flat = 0; is_flat < 2; is_flat++) {
		make_hulls(hulls, LIGHTS, is_flat != 0);
		make_hulls(before, LIGHTS, is_flat != 0);
		assert_int_equal(pen_light_tree_init(&tree, hulls, LIGHTS, LIGHTS, NULL), 0);
		for (int k = 0; k < 200; k++) {
			const struct pen_vec3 p = {3.0f * next(&random) - 1.0f,
				3.0f * next(&random) - 1.0f, 3.0f * next(&random) - 1.0f};
			const struct pen_vec3 n = next_direction(&random);
			float sum = 0.0f;

			for (uint32_t i = 0; i < LIGHTS; i++) {
				const struct pen_vec3 to = pen_sub(center_of(&before[i]), p);
				const float facing = -pen_dot(to, before[i].axis);
				const float chance =
					pen_light_tree_chance(&tree, p, n, before[i].light);

				sum += chance;
				if (pen_dot(to, n) > 0.0f && (before[i].two_sided || facing > 0.0f))
					assert_true(chance > 0.0f);
			}
			assert_true(sum < 1.0001f);
		}
		pen_light_tree_finish(&tree);
	}
}

/* A chance that is not the one with which a light is chosen: all weights would be wrong. */
static void chances_are_those_of_the_choice(void **state)
{
	enum { ROUNDS = 20000 };
	struct pen_light_hull hulls[LIGHTS];
	struct pen_light_tree tree;
	uint32_t wanted[PEN_LANES];
	float x[PEN_LANES], y[PEN_LANES], z[PEN_LANES], zero[PEN_LANES] = {0};
	float up[PEN_LANES], u[PEN_LANES], v[PEN_LANES], chance[PEN_LANES];
	const struct pen_light_receivers receivers = {x, y, z, zero, up, zero, wanted};
	uint32_t light[PEN_LANES], random = 11;
	double observed[LIGHTS] = {0}, sum = 0.0;

	(void)state;
	make_hulls(hulls, LIGHTS, false);
	assert_int_equal(pen_light_tree_init(&tree, hulls, LIGHTS, LIGHTS, NULL), 0);
	for (int i = 0; i < PEN_LANES; i++) {
		x[i] = 0.3f;
		y[i] = -0.4f;
		z[i] = 0.6f;
		up[i] = 1.0f;
		wanted[i] = 1;
	}
	for (int round = 0; round < ROUNDS; round++) {
		for (int i = 0; i < PEN_LANES; i++) {
			u[i] = next(&random);
			v[i] = next(&random);
		}
		pen_light_tree_choose(&tree, &receivers, u, v, light, chance);
		for (int i = 0; i < PEN_LANES; i++) {
			if (chance[i] == 0.0f)
				continue;
			observed[light[i]]++;
			assert_float_equal(chance[i],
				pen_light_tree_chance(&tree, pen_vec3(x[i], y[i], z[i]),
					pen_vec3(0.0f, 1.0f, 0.0f), light[i]),
				1e-5f * chance[i]);
		}
	}
	for (uint32_t i = 0; i < LIGHTS; i++) {
		const double expected =
			(double)pen_light_tree_chance(
				&tree, pen_vec3(0.3f, -0.4f, 0.6f), pen_vec3(0.0f, 1.0f, 0.0f), i) *
			ROUNDS * PEN_LANES;

		sum += observed[i];
		assert_true(fabs(observed[i] - expected) < 6.0 * sqrt(expected) + 3.0);
	}
	/* Some end where no light can shine, but few. */
	assert_true(sum > 0.8 * ROUNDS * PEN_LANES);
	pen_light_tree_finish(&tree);
}

/* Lights at one place, or none: a build that never ends, or chooses what is not there. */
static void edge_cases(void **state)
{
	struct pen_light_hull hulls[LIGHTS];
	struct pen_light_tree tree;
	float sum = 0.0f;

	(void)state;
	make_hulls(hulls, LIGHTS, true);
	for (uint32_t i = 1; i < LIGHTS; i++) {
		hulls[i] = hulls[0];
		hulls[i].light = i;
	}
	hulls[0].light = 0;
	assert_int_equal(pen_light_tree_init(&tree, hulls, LIGHTS, LIGHTS + 5, NULL), 0);
	for (uint32_t i = 0; i < LIGHTS; i++)
		sum += pen_light_tree_chance(&tree, pen_vec3(0, -2, 0), pen_vec3(0, 0, 0), i);
	assert_float_equal(sum, 1.0f, 1e-4f);
	assert_true(pen_light_tree_chance(
			    &tree, pen_vec3(0, -2, 0), pen_vec3(0, 0, 0), LIGHTS + 1) == 0.0f);
	pen_light_tree_finish(&tree);
	assert_int_equal(pen_light_tree_init(&tree, hulls, 0, 0, NULL), 0);
	pen_light_tree_finish(&tree);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_shines_has_a_chance),
		cmocka_unit_test(chances_are_those_of_the_choice),
		cmocka_unit_test(edge_cases),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
