/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/handful.h"

#include "core/render/kernel.h"
#include "core/render/trace.h"

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { FAN = 8, SPHERES = 8 };

/* A fan of triangles around its first vertex, nearly flat, and travelling spheres, as two shapes.
 */
struct fixture {
	float vertices[3 * (FAN + 1)];
	uint32_t indices[3 * FAN];
	struct pen_sphere spheres[2 * SPHERES];
	struct pen_model models[2];
	struct pen_shape shapes[2];
	struct pen_geometry geometry;
	struct pen_handful handful;
};

static double uniform(double low, double high)
{
	return low + (high - low) * (double)random() / 0x7fffffff;
}

static void make_fan(struct fixture *f, double shift)
{
	for (uint32_t i = 0; i <= FAN; i++) {
		const double angle = 2.0 * M_PI * i / FAN + uniform(-0.2, 0.2);
		const double radius = i == 0 ? 0.1 : uniform(2, 5);

		f->vertices[3 * i] = (float)(shift + radius * cos(angle));
		f->vertices[3 * i + 1] = (float)uniform(-0.05, 0.05);
		f->vertices[3 * i + 2] = (float)(radius * sin(angle) - shift);
	}
	for (uint32_t i = 0; i < FAN; i++) {
		f->indices[3 * i] = 0;
		f->indices[3 * i + 1] = 1 + i;
		f->indices[3 * i + 2] = 1 + (i + 1) % FAN;
	}
}

static void make_spheres(struct fixture *f)
{
	for (int i = 0; i < 2 * SPHERES; i++)
		f->spheres[i] = (struct pen_sphere){(float)uniform(-4, 4), (float)uniform(1, 4),
			(float)uniform(-4, 4), (float)uniform(0.2, 0.8)};
}

static void fixture_init(struct fixture *f, double shift)
{
	memset(f, 0, sizeof *f);
	make_fan(f, shift);
	make_spheres(f);
	f->models[0] = (struct pen_model){.type = PEN_MODEL_TRIANGLES,
		.count = FAN,
		.vertex_count = FAN + 1,
		.step_count = 1};
	f->models[1] =
		(struct pen_model){.type = PEN_MODEL_SPHERES, .count = SPHERES, .step_count = 2};
	f->shapes[1].model = 1;
	f->geometry = (struct pen_geometry){
		.vertices = f->vertices,
		.indices = f->indices,
		.spheres = f->spheres,
		.models = f->models,
		.shapes = f->shapes,
		.model_count = 2,
		.shape_count = 2,
	};
}

static void set_ray(struct pen_rays *rays, int lane, const double o[3], const double target[3])
{
	rays->origin_x[lane] = (float)o[0];
	rays->origin_y[lane] = (float)o[1];
	rays->origin_z[lane] = (float)o[2];
	rays->direction_x[lane] = (float)(target[0] - o[0]);
	rays->direction_y[lane] = (float)(target[1] - o[1]);
	rays->direction_z[lane] = (float)(target[2] - o[2]);
	rays->time[lane] = (float)uniform(0, 1);
	rays->tnear[lane] = 0.0f;
	rays->tfar[lane] = INFINITY;
}

static void clear_hits(struct pen_packet *packet)
{
	memset(&packet->hits, 0xff, sizeof packet->hits);
}

/* A point of the edge from the fan's middle to another vertex; at times the middle itself. */
static void aim_at_seam(const struct fixture *f, struct pen_rays *rays, int lane, double shift)
{
	const uint32_t spoke = 1 + (uint32_t)random() % FAN;
	const double share = lane == 0 ? 0.0 : uniform(0, 0.99);
	const double o[3] = {shift + uniform(-9, 9), uniform(5, 9), uniform(-9, 9) - shift};
	double target[3];

	for (uint32_t k = 0; k < 3; k++)
		target[k] = (1 - share) * (double)f->vertices[k] +
			    share * (double)f->vertices[3 * spoke + k];
	set_ray(rays, lane, o, target);
}

/*
 * Breaks when a ray can pass between two triangles: with edges tested by different sums in each,
 * with strict comparisons, or with the products contracted.
 */
static void test_nothing_slips_through_seams(void **state)
{
	static const double shifts[] = {0, 10, 1000};
	static struct fixture f;

	(void)state;
	for (int round = 0; round < 3000; round++) {
		const double shift = shifts[round % 3];
		struct pen_packet packet;
		struct pen_rays rays;

		fixture_init(&f, shift);
		assert_true(pen_handful_take(&f.handful, &f.geometry, 0));
		clear_hits(&packet);
		for (int i = 0; i < PEN_LANES; i++)
			aim_at_seam(&f, &packet.rays, i, shift);
		rays = packet.rays;
		pen_kernel_v2.handful_closest(&f.handful, &packet);
		assert_false(pen_kernel_v2.handful_occluded(&f.handful, &rays));
		for (int i = 0; i < PEN_LANES; i++) {
			assert_int_equal(packet.hits.geometry[i], 0);
			assert_true(fabsf(packet.rays.tfar[i] - 1.0f) < 0.01f);
			assert_true(rays.tfar[i] == -INFINITY);
		}
	}
}

struct truth {
	double distance;
	uint32_t shape, primitive;
	bool is_close_call; /* rounding may decide */
};

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void keep(struct truth *truth, double distance, uint32_t shape, uint32_t primitive)
{
	if (fabs(distance - truth->distance) < 1e-3 || fabs(distance) < 1e-3)
		truth->is_close_call = true;
	if (distance > 0 && distance < truth->distance) {
		truth->distance = distance;
		truth->shape = shape;
		truth->primitive = primitive;
	}
}

static void meet_sphere(const struct fixture *f, uint32_t i, const double o[3], const double d[3],
	double time, struct truth *truth)
{
	const struct pen_sphere *a = &f->spheres[i], *b = a + SPHERES;
	const double from[3] = {
		o[0] - (1 - time) * (double)a->x - time * (double)b->x,
		o[1] - (1 - time) * (double)a->y - time * (double)b->y,
		o[2] - (1 - time) * (double)a->z - time * (double)b->z,
	};
	const double radius = (1 - time) * (double)a->radius + time * (double)b->radius;
	const double dd = dot(d, d), half = -dot(from, d) / dd;
	const double discriminant = half * half - (dot(from, from) - radius * radius) / dd;

	if (fabs(discriminant) < 1e-4)
		truth->is_close_call = true;
	if (discriminant <= 0)
		return;
	keep(truth, half - sqrt(discriminant), 1, i);
	keep(truth, half + sqrt(discriminant), 1, i);
}

static void cross(const double a[3], const double b[3], double ret[3])
{
	for (int i = 0; i < 3; i++)
		ret[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static void meet_triangle(const struct fixture *f, uint32_t i, const double o[3], const double d[3],
	struct truth *truth)
{
	double ab[3], ac[3], from[3], p[3], q[3], u, v, determinant;

	for (uint32_t k = 0; k < 3; k++) {
		const double a = (double)f->vertices[k];

		ab[k] = (double)f->vertices[3 * f->indices[3 * i + 1] + k] - a;
		ac[k] = (double)f->vertices[3 * f->indices[3 * i + 2] + k] - a;
		from[k] = o[k] - a;
	}
	cross(d, ac, p);
	cross(from, ab, q);
	determinant = dot(ab, p);
	u = dot(from, p) / determinant;
	v = dot(d, q) / determinant;
	if (fabs(u) < 1e-3 || fabs(v) < 1e-3 || fabs(1 - u - v) < 1e-3 || fabs(determinant) < 1e-2)
		truth->is_close_call = true;
	if (u > 0 && v > 0 && u + v < 1)
		keep(truth, dot(ac, q) / determinant, 0, i);
}

static struct truth find_truth(const struct fixture *f, const struct pen_rays *rays, int lane)
{
	const double o[3] = {(double)rays->origin_x[lane], (double)rays->origin_y[lane],
		(double)rays->origin_z[lane]};
	const double d[3] = {(double)rays->direction_x[lane], (double)rays->direction_y[lane],
		(double)rays->direction_z[lane]};
	struct truth truth = {.distance = (double)INFINITY, .shape = UINT32_MAX};

	for (uint32_t i = 0; i < FAN; i++)
		meet_triangle(f, i, o, d, &truth);
	for (uint32_t i = 0; i < SPHERES; i++)
		meet_sphere(f, i, o, d, (double)rays->time[lane], &truth);
	return truth;
}

static void check_occlusion(
	const struct fixture *f, const struct pen_rays *rays, const struct truth truths[PEN_LANES])
{
	struct pen_rays before = *rays, beyond = *rays;

	for (int i = 0; i < PEN_LANES; i++) {
		before.tfar[i] = (float)(truths[i].distance * 0.999);
		beyond.tfar[i] = (float)(truths[i].distance * 1.001);
	}
	pen_kernel_v2.handful_occluded(&f->handful, &before);
	pen_kernel_v2.handful_occluded(&f->handful, &beyond);
	for (int i = 0; i < PEN_LANES; i++) {
		if (truths[i].is_close_call)
			continue;
		assert_true(before.tfar[i] >= 0.0f);
		assert_int_equal(beyond.tfar[i] < 0.0f, truths[i].shape != UINT32_MAX);
	}
}

/* Breaks when a primitive, the order of hits, inside and outside, or the time is mistaken. */
static void test_hits_are_the_true_ones(void **state)
{
	static struct fixture f;
	int checked = 0;

	(void)state;
	for (int round = 0; round < 2000; round++) {
		struct truth truths[PEN_LANES];
		struct pen_packet packet;
		struct pen_rays rays;

		fixture_init(&f, 0);
		assert_true(pen_handful_take(&f.handful, &f.geometry, 0));
		assert_true(pen_handful_take(&f.handful, &f.geometry, 1));
		clear_hits(&packet);
		for (int i = 0; i < PEN_LANES; i++)
			set_ray(&packet.rays, i,
				(double[3]){uniform(-5, 5), uniform(0.5, 5), uniform(-5, 5)},
				(double[3]){uniform(-4, 4), uniform(-1, 4), uniform(-4, 4)});
		rays = packet.rays;
		pen_kernel_v2.handful_closest(&f.handful, &packet);
		for (int i = 0; i < PEN_LANES; i++) {
			truths[i] = find_truth(&f, &rays, i);
			if (truths[i].is_close_call)
				continue;
			checked++;
			assert_int_equal(packet.hits.geometry[i], truths[i].shape);
			if (truths[i].shape == UINT32_MAX)
				continue;
			assert_int_equal(packet.hits.primitive[i], truths[i].primitive);
			assert_true(fabs((double)packet.rays.tfar[i] - truths[i].distance) < 1e-3);
		}
		check_occlusion(&f, &rays, truths);
	}
	assert_true(checked > 20000);
}

/* Breaks when a parked lane comes back with a hit: it would be shaded. */
static void test_parked_lanes_stay_parked(void **state)
{
	static struct fixture f;
	struct pen_packet packet;

	(void)state;
	fixture_init(&f, 0);
	assert_true(pen_handful_take(&f.handful, &f.geometry, 0));
	clear_hits(&packet);
	for (int i = 0; i < PEN_LANES; i++) {
		aim_at_seam(&f, &packet.rays, i, 0);
		packet.rays.tnear[i] = 1.0f;
		packet.rays.tfar[i] = 0.0f;
	}
	pen_kernel_v2.handful_closest(&f.handful, &packet);
	pen_kernel_v2.handful_occluded(&f.handful, &packet.rays);
	for (int i = 0; i < PEN_LANES; i++) {
		assert_int_equal(packet.hits.geometry[i], PEN_NO_INDEX);
		assert_true(packet.rays.tfar[i] == 0.0f);
	}
}

/* Breaks when a shape is taken that the kernel cannot test, or more than there is room for. */
static void test_takes_what_it_can_test(void **state)
{
	static struct fixture f;

	(void)state;
	fixture_init(&f, 0);
	f.shapes[0].placement_count = 1;
	assert_false(pen_handful_take(&f.handful, &f.geometry, 0));
	f.shapes[0].placement_count = 0;
	f.models[0].step_count = 2;
	assert_false(pen_handful_take(&f.handful, &f.geometry, 0));
	f.models[0].step_count = 1;
	f.models[1].step_count = 3;
	assert_false(pen_handful_take(&f.handful, &f.geometry, 1));
	assert_int_equal(f.handful.triangle_count + f.handful.sphere_count, 0);
	assert_true(pen_handful_take(&f.handful, &f.geometry, 0));
	assert_true(pen_handful_take(&f.handful, &f.geometry, 0));
	assert_false(pen_handful_take(&f.handful, &f.geometry, 0));
	assert_int_equal(f.handful.triangle_count, PEN_HANDFUL_MAX);
}

static int count_threads(void)
{
	DIR *directory = opendir("/proc/self/task");
	int count = 0;

	assert_non_null(directory);
	while (readdir(directory))
		count++;
	(void)closedir(directory);
	return count;
}

/* Breaks when Embree's threads, which look out for work between the forks that follow, are started
 * for a scene that needs no tree, or when its size is asked of the tree alone. */
static void test_alone_it_starts_no_threads(void **state)
{
	static struct fixture f;
	struct pen_trace *trace = NULL;
	const int before = count_threads();

	(void)state;
	fixture_init(&f, 0);
	assert_int_equal(
		pen_trace_create(&f.geometry, PEN_ISA_V2, &pen_kernel_v2, &trace, NULL), 0);
	assert_int_equal(count_threads(), before);
	assert_true(pen_trace_radius(trace) > 1.0 && pen_trace_radius(trace) < 20.0);
	pen_trace_destroy(trace);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_nothing_slips_through_seams),
		cmocka_unit_test(test_hits_are_the_true_ones),
		cmocka_unit_test(test_parked_lanes_stay_parked),
		cmocka_unit_test(test_takes_what_it_can_test),
		cmocka_unit_test(test_alone_it_starts_no_threads),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
