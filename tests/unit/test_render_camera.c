/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/camera.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { WIDTH = 640, HEIGHT = 360, LENS = 32 };

static const struct pen_camera_desc plain = {
	.position = {1, 2, 3},
	.look_at = {1, 2, -7},
	.up = {0, 1, 0},
	.horizontal_fov = 90,
	.focus_distance = 10,
};

struct ray {
	struct pen_vec3 origin, direction;
};

static struct ray camera_ray(
	const struct pen_camera *camera, float x, float y, float u, float v, float time)
{
	struct ray ray;
	const struct pen_camera_rays to = {&ray.origin.x, &ray.origin.y, &ray.origin.z,
		&ray.direction.x, &ray.direction.y, &ray.direction.z};

	pen_camera_generate(camera, 1, &x, &y, &u, &v, &time, &to);
	return ray;
}

static void assert_near(struct pen_vec3 a, struct pen_vec3 b, float tolerance)
{
	const float gap = pen_length(pen_sub(a, b));

	if (!(gap <= tolerance))
		fail_msg("(%g, %g, %g) is not (%g, %g, %g)", (double)a.x, (double)a.y, (double)a.z,
			(double)b.x, (double)b.y, (double)b.z);
}

static struct pen_camera make_camera(const struct pen_camera_desc *desc)
{
	struct pen_camera camera;

	assert_int_equal(pen_camera_init(&camera, desc, WIDTH, HEIGHT, NULL), 0);
	return camera;
}

/* A flipped axis, or a field of view taken for the height. */
static void pinhole_frames_the_image(void **state)
{
	const struct pen_camera camera = make_camera(&plain);
	const struct pen_vec3 eye = {1.0f, 2.0f, 3.0f};
	const struct ray centre = camera_ray(&camera, 320.0f, 180.0f, 0.1f, 0.9f, 0.0f);
	const struct ray corner = camera_ray(&camera, 0.0f, 0.0f, 0.1f, 0.9f, 0.0f);
	const struct ray right = camera_ray(&camera, 640.0f, 180.0f, 0.1f, 0.9f, 0.0f);

	(void)state;
	assert_near(centre.origin, eye, 0.0f);
	assert_near(centre.direction, pen_vec3(0.0f, 0.0f, -1.0f), 1e-6f);
	assert_near(right.direction, pen_normalize(pen_vec3(1.0f, 0.0f, -1.0f)), 1e-6f);
	assert_near(
		corner.direction, pen_normalize(pen_vec3(-1.0f, 360.0f / 640.0f, -1.0f)), 1e-6f);
}

/* Where a ray passes the plane at a distance before the camera. */
static struct pen_vec3 at_depth(const struct ray *ray, float depth)
{
	const float t = (3.0f - depth - ray->origin.z) / ray->direction.z;

	return pen_madd(ray->origin, t, ray->direction);
}

/* All points of the lens see a point of the focal plane in the same film position. */
static void focal_plane_is_sharp(void **state)
{
	struct pen_camera_desc desc = plain;
	struct pen_camera camera;
	struct pen_vec3 sharp;

	(void)state;
	desc.aperture_radius = 0.5;
	camera = make_camera(&desc);
	const struct ray first = camera_ray(&camera, 100.0f, 50.0f, 0.5f, 0.5f, 0.0f);

	sharp = at_depth(&first, 10.0f);
	for (int i = 0; i < LENS * LENS; i++) {
		const struct ray ray = camera_ray(&camera, 100.0f, 50.0f, (float)(i % LENS) / LENS,
			(float)(i / LENS) / LENS, 0.0f);

		assert_float_equal(pen_length(ray.direction), 1.0f, 1e-6f);
		assert_near(at_depth(&ray, 10.0f), sharp, 1e-5f);
	}
}

/* On the sphere the distance is from the eye, so that it bends towards the camera at the edges. */
static void focal_sphere_is_sharp(void **state)
{
	struct pen_camera_desc desc = plain;
	struct pen_camera camera;

	(void)state;
	desc.aperture_radius = 0.5;
	desc.focal_surface = PEN_FOCAL_SPHERE;
	camera = make_camera(&desc);
	const struct ray middle = camera_ray(&camera, 10.0f, 20.0f, 0.5f, 0.5f, 0.0f);
	const struct pen_vec3 sharp = pen_madd(middle.origin, 10.0f, middle.direction);

	assert_near(middle.origin, pen_vec3(1.0f, 2.0f, 3.0f), 1e-6f);
	for (int i = 0; i < LENS * LENS; i++) {
		const struct ray ray = camera_ray(&camera, 10.0f, 20.0f, (float)(i % LENS) / LENS,
			(float)(i / LENS) / LENS, 0.0f);
		const struct pen_vec3 to = pen_sub(sharp, ray.origin);

		assert_near(pen_normalize(to), ray.direction, 1e-6f);
	}
}

/* Thin lens: at depth d the circle of confusion has the radius r |d - f| / f. */
static void circle_of_confusion(void **state)
{
	static const float depths[] = {2.0f, 5.0f, 20.0f, 40.0f};
	struct pen_camera_desc desc = plain;
	struct pen_camera camera;

	(void)state;
	desc.aperture_radius = 0.25;
	camera = make_camera(&desc);
	const struct ray middle = camera_ray(&camera, 320.0f, 180.0f, 0.5f, 0.5f, 0.0f);

	for (size_t d = 0; d < sizeof(depths) / sizeof(depths[0]); d++) {
		float widest = 0.0f;

		for (int i = 0; i < LENS * LENS; i++) {
			const struct ray ray = camera_ray(&camera, 320.0f, 180.0f,
				(float)(i % LENS) / LENS, (float)(i / LENS) / LENS, 0.0f);
			const struct pen_vec3 off =
				pen_sub(at_depth(&ray, depths[d]), at_depth(&middle, depths[d]));

			widest = fmaxf(widest, pen_length(off));
		}
		assert_float_equal(widest, 0.25f * fabsf(depths[d] - 10.0f) / 10.0f, 1e-4f);
	}
}

/* A polygon aperture turned or wound the wrong way, or one that is not filled evenly. */
static void blades_make_a_polygon(void **state)
{
	struct pen_camera_desc desc = plain;
	struct pen_camera camera;
	double x = 0.0, y = 0.0, squares = 0.0;

	(void)state;
	desc.aperture_radius = 2.0;
	desc.blades = 5;
	desc.blade_rotation = -306.0; /* 54: half a blade to the right of the top */
	camera = make_camera(&desc);
	const struct ray tip = camera_ray(&camera, 0.0f, 0.0f, 0.19999999f, 0.0f, 0.0f);

	assert_near(tip.origin, pen_vec3(1.0f, 4.0f, 3.0f), 1e-3f);
	for (int i = 0; i < 100 * 100; i++) {
		const struct ray ray = camera_ray(&camera, 0.0f, 0.0f,
			((float)(i % 100) + 0.5f) / 100, ((float)(i / 100) + 0.5f) / 100, 0.0f);
		const struct pen_vec3 lens = pen_sub(ray.origin, pen_vec3(1.0f, 2.0f, 3.0f));

		x += (double)lens.x;
		y += (double)lens.y;
		squares += (double)pen_dot(lens, lens);
		/* The lowest edge is horizontal, cos(36 degrees) of the radius below. */
		assert_true(lens.y >= -2.0f * 0.80902f);
	}
	assert_true(fabs(x) < 1.0 && fabs(y) < 1.0);
	/* Mean square radius of a regular pentagon: R^2 (2 + cos 72 degrees) / 6. */
	assert_true(fabs(squares / 10000 - 4.0 * (2.0 + cos(2.0 * M_PI / 5.0)) / 6.0) < 1e-3);
}

static struct pen_camera_key keys[] = {
	{.time = 1.0, .position = {0, 0, 0}, .look_at = {0, 0, -1}, .up = {0, 1, 0}},
	{.time = 2.0, .position = {4, 0, 0}, .look_at = {5, 0, 0}, .up = {0, 1, 0}},
	{.time = 4.0, .position = {4, 8, 0}, .look_at = {5, 8, 0}, .up = {0, 1, 0}},
};

/* Linear instead of spherical interpolation turns too fast in the middle. */
static void motion_slerps_between_keys(void **state)
{
	struct pen_camera_desc desc = plain;
	struct pen_camera camera;

	(void)state;
	desc.keys = keys;
	desc.key_count = 3;
	desc.shutter_open = 1.0;
	desc.shutter_close = 4.0;
	camera = make_camera(&desc);
	for (int i = 0; i <= 100; i++) {
		const float share = (float)i / 100.0f;
		const double angle = 0.5 * M_PI * (double)share;
		const struct ray turning = camera_ray(&camera, 320, 180, 0, 0, share / 3.0f);
		const struct ray rising =
			camera_ray(&camera, 320, 180, 0, 0, (1.0f + 2.0f * share) / 3.0f);

		assert_near(turning.origin, pen_vec3(4.0f * share, 0.0f, 0.0f), 1e-5f);
		assert_near(turning.direction,
			pen_vec3((float)sin(angle), 0.0f, (float)-cos(angle)), 2e-6f);
		assert_near(rising.origin, pen_vec3(4.0f, 8.0f * share, 0.0f), 1e-5f);
		assert_near(rising.direction, pen_vec3(1.0f, 0.0f, 0.0f), 2e-6f);
	}
	pen_camera_finish(&camera);
}

/* A shutter that opens before the first key and closes after the last, or only for an instant. */
static void keys_hold_outside(void **state)
{
	struct pen_camera_desc desc = plain;
	struct pen_camera camera;

	(void)state;
	desc.keys = keys;
	desc.key_count = 2;
	desc.shutter_open = 0.0;
	desc.shutter_close = 4.0;
	camera = make_camera(&desc);
	assert_near(camera_ray(&camera, 320, 180, 0, 0, 0.1f).origin, pen_vec3(0, 0, 0), 1e-6f);
	assert_near(camera_ray(&camera, 320, 180, 0, 0, 0.375f).origin, pen_vec3(2, 0, 0), 1e-6f);
	assert_near(camera_ray(&camera, 320, 180, 0, 0, 0.9f).origin, pen_vec3(4, 0, 0), 1e-6f);
	assert_near(camera_ray(&camera, 320, 180, 0, 0, 1.0f).direction, pen_vec3(1, 0, 0), 1e-6f);
	pen_camera_finish(&camera);

	desc.shutter_open = 1.5;
	desc.shutter_close = 1.5;
	camera = make_camera(&desc);
	assert_near(camera_ray(&camera, 320, 180, 0, 0, 0.7f).origin, pen_vec3(2, 0, 0), 1e-6f);
	assert_near(camera_ray(&camera, 320, 180, 0, 0, 0.0f).direction,
		pen_normalize(pen_vec3(1, 0, -1)), 1e-6f);
	pen_camera_finish(&camera);
}

/* Any orientation must survive the way through a quaternion, half turns included. */
static void orientations_survive(void **state)
{
	struct pen_camera_desc desc = plain;

	(void)state;
	for (int i = 0; i < 1000; i++) {
		const double a = i * 2.399963;
		const double z = 1.0 - (i + 0.5) / 500.0;
		const double r = sqrt(1.0 - z * z);
		const struct pen_vec3 d = {(float)(r * cos(a)), (float)z, (float)(r * sin(a))};

		desc.look_at[0] = desc.position[0] + 5.0 * r * cos(a);
		desc.look_at[1] = desc.position[1] + 5.0 * z;
		desc.look_at[2] = desc.position[2] + 5.0 * r * sin(a);
		const struct pen_camera camera = make_camera(&desc);
		const struct pen_camera_frame *frame = &camera.frame;

		assert_near(frame->forward, d, 2e-6f);
		assert_near(pen_cross(frame->right, frame->up), pen_neg(frame->forward), 2e-6f);
		assert_true(fabsf(frame->right.y) < 2e-6f && frame->up.y > 0.0f);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pinhole_frames_the_image),
		cmocka_unit_test(focal_plane_is_sharp),
		cmocka_unit_test(focal_sphere_is_sharp),
		cmocka_unit_test(circle_of_confusion),
		cmocka_unit_test(blades_make_a_polygon),
		cmocka_unit_test(motion_slerps_between_keys),
		cmocka_unit_test(keys_hold_outside),
		cmocka_unit_test(orientations_survive),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
