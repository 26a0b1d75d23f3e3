/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/motion.h"

#include "core/render/isa.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static const struct pen_shutter second = {0.0, 1.0};

static struct pen_pose pose_turned(double degrees)
{
	const double half = degrees * M_PI / 360.0;

	return (struct pen_pose){.rotate = {0, 0, sin(half), cos(half)}, .scale = {1, 1, 1}};
}

static struct pen_object_desc moving(struct pen_pose_key *keys, uint32_t count)
{
	return (struct pen_object_desc){.transform = pose_turned(0),
		.keys = keys,
		.key_count = count,
		.node = PEN_NO_INDEX};
}

/* Breaks when decomposing loses shear, a mirror, or the order scale, rotate, translate. */
static void test_decomposition_rebuilds_the_map(void **state)
{
	const struct pen_pose outer = {{1, -2, 3}, {0.5, 0.5, 0.5, 0.5}, {2, 0.25, 1}};
	const struct pen_pose inner = {{0, 1, 0}, {0, 0.6, 0, 0.8}, {1, 3, -1}};
	const struct pen_affine a = pen_affine_of_pose(&outer), b = pen_affine_of_pose(&inner);
	const struct pen_affine map = pen_affine_product(&a, &b);
	const struct pen_placement p = pen_affine_decompose(&map);
	struct pen_pose rigid = {.scale = {1, 1, 1}};
	const struct pen_affine triangle = {{{p.scale[0], p.skew_xy, p.skew_xz, 0},
		{0, p.scale[1], p.skew_yz, 0}, {0, 0, p.scale[2], 0}}};
	struct pen_affine rotation, again;

	(void)state;
	memcpy(rigid.translate, p.translate, sizeof rigid.translate);
	memcpy(rigid.rotate, p.rotate, sizeof rigid.rotate);
	rotation = pen_affine_of_pose(&rigid);
	again = pen_affine_product(&rotation, &triangle);
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			assert_true(fabs(again.m[i][j] - map.m[i][j]) < 1e-12);
	assert_true(pen_affine_determinant(&map) < 0 && p.scale[2] < 0);
}

/* Breaks when the step rule changes (which changes images) or ignores what the shutter misses. */
static void test_steps(void **state)
{
	struct pen_pose_key keys[] = {{0, pose_turned(0)}, {0.25, pose_turned(20)},
		{1, pose_turned(60)}, {2, pose_turned(200)}};
	struct pen_object_desc two = moving(&keys[2], 2), four = moving(keys, 4);
	const struct pen_shutter late = {1.0, 1.5}, after = {3, 4}, instant = {0.5, 0.5};

	(void)state;
	assert_int_equal(
		pen_motion_steps(NULL, &two, NULL, &second), 1); /* held before its first key */
	assert_int_equal(pen_motion_steps(NULL, &two, NULL, &late), 2); /* half of a segment */
	assert_int_equal(
		pen_motion_steps(NULL, &four, NULL, &after), 1); /* held after its last key */
	assert_int_equal(pen_motion_steps(NULL, &four, NULL, &instant), 1);
	assert_int_equal(pen_motion_steps(NULL, &four, NULL, &second), 5); /* a key at a quarter */
	keys[1].time = 0.2503;
	assert_int_equal(pen_motion_steps(NULL, &four, NULL, &second), PEN_MOTION_STEPS_MAX);
	/* 140 degrees in the shutter: three steps' worth. */
	assert_int_equal(pen_motion_steps(NULL, &two, NULL, &(struct pen_shutter){1, 2}), 4);
	/* Under a stretch no step count is exact. */
	two.transform.scale[1] = 2;
	assert_int_equal(pen_motion_steps(NULL, &two, NULL, &late), 33);
}

/* Breaks when poses are blended as matrices: a spinning point must stay on its circle. */
static void test_rotation_sweeps_arcs(void **state)
{
	struct pen_pose_key keys[] = {{0, pose_turned(0)}, {1, pose_turned(120)}};
	const struct pen_object_desc object = moving(keys, 2);

	(void)state;
	for (int i = 0; i <= 8; i++) {
		const struct pen_affine world = pen_motion_world(NULL, &object, i / 8.0);

		assert_true(fabs(world.m[0][0] - cos(i * M_PI / 12)) < 1e-12);
		assert_true(fabs(world.m[1][0] - sin(i * M_PI / 12)) < 1e-12);
	}
}

/* Breaks when flatness is measured in absolute terms: small objects are not flat. */
static void test_singular_is_relative(void **state)
{
	struct pen_pose pose = {.rotate = {0, 0, 0, 1}, .scale = {1e-6, 1e-6, 1e-6}};
	struct pen_affine map = pen_affine_of_pose(&pose);

	(void)state;
	assert_false(pen_affine_is_singular(&map));
	pose.scale[1] = 1e-20;
	map = pen_affine_of_pose(&pose);
	assert_true(pen_affine_is_singular(&map));
	pose.scale[1] = (double)NAN;
	map = pen_affine_of_pose(&pose);
	assert_true(pen_affine_is_singular(&map));
}

/* Breaks when a class stops naming one of its four parts, or a short name is refused. */
static void test_names_of_instruction_sets(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	char text[PEN_CLASS_TEXT];
	enum pen_isa isa = PEN_ISA_V2;

	(void)state;
	assert_int_equal(pen_isa_parse("v3", &isa, &err), 0);
	assert_int_equal(isa, PEN_ISA_V3);
	assert_int_equal(pen_isa_parse("x86-64-v4", &isa, &err), 0);
	assert_int_equal(isa, PEN_ISA_V4);
	assert_int_equal(pen_isa_parse("avx2", &isa, &err), PEN_EINVALID);
	assert_non_null(strstr(err.text, "x86-64-v3"));
	pen_class_format(PEN_ISA_V3, text);
	assert_non_null(strstr(text, "/x86-64-v3/embree-3."));
	assert_true(strlen(strrchr(text, '/')) == 13); /* a vendor has twelve letters */
}

/* Breaks when a chain of nodes loses its parent, or a turning parent's child goes by a chord. */
static void test_a_child_of_a_turning_node(void **state)
{
	static const float times[] = {0, 1};
	static const float turns[] = {0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f};
	struct pen_node_desc nodes[] = {
		{.parent = PEN_NO_INDEX,
			.pose = pose_turned(0),
			.rotation = {PEN_INTERPOLATION_LINEAR, 2, times, turns}},
		{.parent = 0, .pose = {{10, 0, 0}, {0, 0, 0, 1}, {1, 1, 1}}},
	};
	const struct pen_scene scene = {.nodes = nodes, .node_count = 2};
	const struct pen_object_desc object = {.type = PEN_OBJECT_SPHERE, .node = 1};
	const struct pen_box box = {{-1, -1, -1}, {1, 1, 1}};
	const struct pen_shutter instant = {0.5, 0.5};
	const struct pen_affine half = pen_motion_world(&scene, &object, 0.5);

	(void)state;
	assert_true(fabs(half.m[0][3] - 10 * sqrt(0.5)) < 1e-5);
	assert_true(fabs(half.m[1][3] - 10 * sqrt(0.5)) < 1e-5);
	assert_int_equal(pen_motion_steps(&scene, &object, &box, &instant), 1);
	/* An arc of radius 10 seen to 0.001 of 3.5: its sagitta asks for more than 12 segments. */
	assert_in_range(pen_motion_steps(&scene, &object, &box, &second), 13, 49);
	nodes[1].pose.translate[0] = 0;
	assert_int_equal(pen_motion_steps(&scene, &object, &box, &second), 3);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_decomposition_rebuilds_the_map),
		cmocka_unit_test(test_steps),
		cmocka_unit_test(test_a_child_of_a_turning_node),
		cmocka_unit_test(test_rotation_sweeps_arcs),
		cmocka_unit_test(test_singular_is_relative),
		cmocka_unit_test(test_names_of_instruction_sets),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
