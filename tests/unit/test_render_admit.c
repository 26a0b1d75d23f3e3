/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/admit.h"

#include "core/render/kernel.h"
#include "core/render/vec.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static double uniform(double low, double high)
{
	return low + (high - low) * (double)random() / 0x7fffffff;
}

static void park_all(struct pen_rays *rays)
{
	memset(rays, 0, sizeof *rays);
	for (int i = 0; i < PEN_LANES; i++) {
		rays->direction_z[i] = 1.0f;
		rays->tnear[i] = 1.0f;
	}
}

static void set_ray(struct pen_rays *rays, int lane, const double origin[3],
	const double direction[3], double far)
{
	rays->origin_x[lane] = (float)origin[0];
	rays->origin_y[lane] = (float)origin[1];
	rays->origin_z[lane] = (float)origin[2];
	rays->direction_x[lane] = (float)direction[0];
	rays->direction_y[lane] = (float)direction[1];
	rays->direction_z[lane] = (float)direction[2];
	rays->tnear[lane] = 0.0f;
	rays->tfar[lane] = (float)far;
}

/* A box, and a point of it: within, or on a wall, an edge or a corner. */
static void draw_box(float lower[3], float upper[3], double ret_point[3])
{
	const double place = pow(10.0, uniform(-3.0, 4.0)), size = pow(10.0, uniform(-3.0, 3.0));

	for (int k = 0; k < 3; k++) {
		const double from = uniform(-place, place);
		const int where = (int)uniform(0.0, 3.0);

		lower[k] = (float)from;
		upper[k] = (float)(from + size * uniform(0.0, 1.0));
		ret_point[k] = where == 0   ? (double)lower[k]
			       : where == 1 ? (double)upper[k]
					    : uniform((double)lower[k], (double)upper[k]);
	}
}

/* Breaks when a ray that Embree could find something for is not asked about. */
static void test_no_ray_to_the_box_is_missed(void **state)
{
	(void)state;
	for (int round = 0; round < 200000; round++) {
		const double reach = pow(10.0, uniform(-2.0, 6.0));
		float lower[3], upper[3];
		double point[3], origin[3], direction[3];
		struct pen_admit_box box;
		struct pen_rays rays;

		draw_box(lower, upper, point);
		pen_admit_box_init(&box, lower, upper);
		for (int k = 0; k < 3; k++)
			origin[k] = random() % 4 == 0 ? point[k] : uniform(-reach, reach);
		for (int k = 0; k < 3; k++)
			direction[k] = point[k] - (double)(float)origin[k];
		park_all(&rays);
		/* No longer than to the point itself. */
		set_ray(&rays, round % PEN_LANES, origin, direction, 1.0);
		assert_true(pen_kernel_v2.admit_box_met(&box, &rays));
		assert_true(pen_admit_box_met(&box, &rays));
	}
}

/* Breaks when the box spares Embree nothing: rays beside it, away from it, and too short. */
static void test_other_rays_do_not_meet_it(void **state)
{
	const float lower[3] = {-1.0f, -1.0f, -1.0f}, upper[3] = {1.0f, 1.0f, 1.0f};
	struct pen_admit_box box;
	struct pen_rays rays;

	(void)state;
	pen_admit_box_init(&box, lower, upper);
	park_all(&rays);
	assert_false(pen_kernel_v2.admit_box_met(&box, &rays));
	set_ray(&rays, 3, (double[]){1.01, 0, -5}, (double[]){0, 0, 1}, HUGE_VAL);
	set_ray(&rays, 4, (double[]){0, 0, -5}, (double[]){0, 0, -1}, HUGE_VAL);
	set_ray(&rays, 5, (double[]){0, 0, -5}, (double[]){0, 0, 1}, 3.9);
	set_ray(&rays, 6, (double[]){0, 5, 0}, (double[]){1, -0.5, 0}, HUGE_VAL);
	assert_false(pen_kernel_v2.admit_box_met(&box, &rays));
	set_ray(&rays, 5, (double[]){0, 0, -5}, (double[]){0, 0, 1}, 4.1);
	assert_true(pen_kernel_v2.admit_box_met(&box, &rays));
}

/* Breaks when a box of no thickness, or without bounds, loses rays. */
static void test_odd_boxes(void **state)
{
	const float flat[3] = {2.0f, 2.0f, 2.0f};
	const float low[3] = {-HUGE_VAL, -INFINITY, -INFINITY};
	const float high[3] = {HUGE_VAL, INFINITY, INFINITY};
	struct pen_admit_box box;
	struct pen_rays rays;

	(void)state;
	park_all(&rays);
	set_ray(&rays, 0, (double[]){2, 2, 0}, (double[]){0, 0, 1}, HUGE_VAL);
	pen_admit_box_init(&box, flat, flat);
	assert_true(pen_kernel_v2.admit_box_met(&box, &rays));
	pen_admit_box_init(&box, low, high);
	assert_true(pen_kernel_v2.admit_box_met(&box, &rays));
}

/* Breaks when a value that Embree aborts at reaches it, or a parked lane counts as dropped. */
static void test_what_embree_must_not_see(void **state)
{
	static const double bad[] = {(double)NAN, (double)HUGE_VAL, -(double)INFINITY, 2e18};
	int32_t valid[PEN_LANES] __attribute__((aligned(64)));
	struct pen_rays rays;

	(void)state;
	for (int k = 0; k < 4 * 6; k++) {
		double values[6] = {0, 0, 0, 0, 0, 1};

		values[k / 4] = bad[k % 4];
		park_all(&rays);
		set_ray(&rays, 7, values, values + 3, HUGE_VAL);
		set_ray(&rays, 8, (double[]){1, 2, 3}, (double[]){0, 1, 0}, HUGE_VAL);
		assert_int_equal(pen_kernel_v2.admit_rays(&rays, valid), 1);
		for (int i = 0; i < PEN_LANES; i++) {
			assert_int_equal(valid[i], i == 8 ? -1 : 0);
			assert_true(i == 8 || rays.tnear[i] > rays.tfar[i]);
			assert_true(isfinite(rays.origin_x[i]) && isfinite(rays.direction_z[i]));
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_no_ray_to_the_box_is_missed),
		cmocka_unit_test(test_other_rays_do_not_meet_it),
		cmocka_unit_test(test_odd_boxes),
		cmocka_unit_test(test_what_embree_must_not_see),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
