/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light.h"
#include "core/render/warp.h"

#include "directions.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* A light seen from a point. */
struct view {
	struct pen_light light;
	struct pen_vec3 p;
};

static const struct pen_light_desc rectangle_desc = {
	.type = PEN_LIGHT_RECTANGLE,
	.color = {1, 1, 1},
	.u.rectangle = {{-1, 2, -0.5}, {2, 0, 0}, {0, 0, 1.5}},
};
static const struct pen_light_desc triangle_desc = {
	.type = PEN_LIGHT_TRIANGLE,
	.color = {1, 1, 1},
	.u.triangle = {{{-1, 2, -1}, {1.5, 2.2, -0.5}, {0.2, 1.8, 1.5}}},
};
static const struct pen_light_desc disk_desc = {
	.type = PEN_LIGHT_DISK,
	.color = {1, 1, 1},
	.u.disk = {{0, 2, 0}, {0, -1, 0}, 1.25},
};
static const struct pen_light_desc sphere_desc = {
	.type = PEN_LIGHT_SPHERE,
	.color = {1, 1, 1},
	.u.sphere = {{0, 2, 0}, 0.75},
};

static struct view make_view(const struct pen_light_desc *desc, float x, float y, float z)
{
	struct view view = {.p = {x, y, z}};

	pen_light_init(&view.light, desc);
	return view;
}

/* Distance along the ray to a flat light's plane, or to a sphere; negative without a hit. */
static float ray_distance(const struct view *view, struct pen_vec3 direction)
{
	const struct pen_vec3 to = pen_sub(view->light.origin, view->p);

	if (view->light.type == PEN_LIGHT_SPHERE) {
		const float along = pen_dot(to, direction);
		const struct pen_vec3 off = pen_madd(to, -along, direction);
		const float rest = view->light.radius * view->light.radius - pen_dot(off, off);

		return rest > 0.0f && along > 0.0f ? along - sqrtf(rest) : -1.0f;
	}
	return pen_dot(to, view->light.axis) / pen_dot(direction, view->light.axis);
}

/* Whether a point of a flat light's plane, as seen from the light's origin, is on the light. */
static bool is_inside(const struct pen_light *light, struct pen_vec3 q)
{
	if (light->type == PEN_LIGHT_DISK)
		return pen_length(q) <= light->radius;
	if (light->type == PEN_LIGHT_RECTANGLE) {
		const float x = pen_dot(q, light->edge_u);
		const float y = pen_dot(q, light->edge_v);

		return x >= 0.0f && y >= 0.0f && x <= light->length_u && y <= light->length_v;
	}

	const float doubled = 2.0f * light->area;
	const float a = pen_dot(pen_cross(q, light->edge_v), light->axis) / doubled;
	const float b = pen_dot(pen_cross(light->edge_u, q), light->axis) / doubled;

	return a >= 0.0f && b >= 0.0f && a + b <= 1.0f;
}

static bool sample_light(
	const void *context, float u, float v, float w, struct pen_vec3 *ret_direction)
{
	const struct view *view = context;
	const struct pen_light_sample sample = pen_light_sample_one(&view->light, view->p, u, v);

	(void)w;
	*ret_direction = sample.direction;
	return sample.strength > 0.0f;
}

static double density_light(const void *context, struct pen_vec3 direction)
{
	const struct view *view = context;
	const float distance = ray_distance(view, direction);
	const struct pen_vec3 hit =
		pen_sub(pen_madd(view->p, distance, direction), view->light.origin);

	if (distance <= 0.0f)
		return 0.0;
	if (view->light.type != PEN_LIGHT_SPHERE && !is_inside(&view->light, hit))
		return 0.0;
	return (double)pen_light_pdf(&view->light, view->p, direction, distance);
}

/* From above, close, aside, far and nearly edge-on: a warp or density that errs anywhere. */
static void light_directions(void **state)
{
	static const struct pen_light_desc *descs[] = {
		&rectangle_desc, &triangle_desc, &disk_desc, &sphere_desc};
	static const struct pen_vec3 points[] = {{0.1f, 0.0f, 0.1f}, {0.3f, 1.2f, -0.2f},
		{3.0f, 0.5f, 1.0f}, {-2.0f, -12.0f, 4.0f}, {2.5f, 1.4f, 0.3f}};

	(void)state;
	for (size_t d = 0; d < 4; d++) {
		for (size_t i = 0; i < sizeof(points) / sizeof(points[0]); i++) {
			const struct view view =
				make_view(descs[d], points[i].x, points[i].y, points[i].z);
			char name[64];
			const struct direction_case test = {name, sample_light, density_light,
				&view,
				pen_light_sample_one(&view.light, view.p, 0.5f, 0.5f).direction};

			snprintf(name, sizeof(name), "light type %d from point %zu",
				(int)descs[d]->type, i);
			assert_directions(&test);
		}
	}
}

/* The density told with a sample is the one told for a hit there, and the sample is on the light.
 */
static void samples_agree_with_pdf(void **state)
{
	static const struct pen_light_desc *descs[] = {
		&rectangle_desc, &triangle_desc, &disk_desc, &sphere_desc};
	struct random_numbers numbers = {.state = 9};

	(void)state;
	for (int i = 0; i < 200000; i++) {
		const struct view view = make_view(descs[i % 4],
			8.0f * random_next(&numbers) - 4.0f, 1.0f - 6.0f * random_next(&numbers),
			8.0f * random_next(&numbers) - 4.0f);
		const float u = random_next(&numbers);
		const float v = random_next(&numbers);
		const struct pen_light_sample sample =
			pen_light_sample_one(&view.light, view.p, u, v);
		const float pdf =
			pen_light_pdf(&view.light, view.p, sample.direction, sample.distance);

		assert_true(sample.strength == 1.0f);
		assert_float_equal(pen_length(sample.direction), 1.0f, 1e-5f);
		assert_float_equal(sample.pdf / pdf, 1.0f, 1e-3f);
		assert_true(pen_light_emits(&view.light,
			pen_madd(view.p, sample.distance, sample.direction), sample.direction));
		/* The rim of a sphere is ill-conditioned. */
		if (view.light.type != PEN_LIGHT_SPHERE || u * (1.0f - u) * v * (1.0f - v) > 1e-3f)
			assert_float_equal(ray_distance(&view, sample.direction) / sample.distance,
				1.0f, 1e-3f);
	}
}

/* Irradiance of a surface at the view's point, by a jittered grid of samples. */
static double sampled_irradiance(const struct view *view, struct pen_vec3 n)
{
	enum { SIDE = 400 };
	struct random_numbers numbers = {.state = 3};
	double sum = 0.0;

	for (int i = 0; i < SIDE * SIDE; i++) {
		const float u = ((float)(i % SIDE) + random_next(&numbers)) / SIDE;
		const float v = ((float)(i / SIDE) + random_next(&numbers)) / SIDE;
		const struct pen_light_sample sample = pen_light_sample_one(
			&view->light, view->p, pen_min(u, 0.9999999f), pen_min(v, 0.9999999f));
		const float cosine = pen_max(pen_dot(n, sample.direction), 0.0f);

		sum += (double)(sample.strength * cosine / sample.pdf);
	}
	return sum / (SIDE * SIDE);
}

/* Lambert's formula for a polygon wholly above the horizon, in double. */
static double polygon_irradiance(
	const double corners[][3], int count, const struct view *view, struct pen_vec3 n)
{
	const double p[3] = {(double)view->p.x, (double)view->p.y, (double)view->p.z};
	const double normal[3] = {(double)n.x, (double)n.y, (double)n.z};
	double sum = 0.0;

	for (int i = 0; i < count; i++) {
		double a[3], b[3], c[3];
		double dot = 0.0, cross = 0.0, up = 0.0;

		for (int k = 0; k < 3; k++) {
			a[k] = corners[i][k] - p[k];
			b[k] = corners[(i + 1) % count][k] - p[k];
		}
		for (int k = 0; k < 3; k++) {
			c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
			dot += a[k] * b[k];
			cross += c[k] * c[k];
			up += c[k] * normal[k];
		}
		sum += atan2(sqrt(cross), dot) * up / sqrt(cross);
	}
	return 0.5 * fabs(sum);
}

static void assert_close(const char *name, struct pen_vec3 p, double value, double exact)
{
	if (!(fabs(value / exact - 1.0) <= 0.002))
		fail_msg("%s from (%g, %g, %g): %.7g instead of %.7g", name, (double)p.x,
			(double)p.y, (double)p.z, value, exact);
}

/* From far to near and to nearly edge-on, over both ways of sampling each. */
static const struct pen_vec3 receivers[] = {{0.0f, 0.0f, 0.0f}, {0.2f, 1.9f, 0.1f},
	{4.0f, 0.0f, 2.0f}, {0.0f, -60.0f, 0.0f}, {30.0f, -20.0f, 10.0f}, {5.0f, 1.5f, 0.0f}};

/* A solid angle that loses digits shows as a wrong brightness far away or edge-on. */
static void polygon_lights_give_lamberts_irradiance(void **state)
{
	static const double rectangle[4][3] = {{-1, 2, -0.5}, {1, 2, -0.5}, {1, 2, 1}, {-1, 2, 1}};

	(void)state;
	for (size_t i = 0; i < sizeof(receivers) / sizeof(receivers[0]); i++) {
		const struct pen_vec3 p = receivers[i];
		const struct pen_vec3 up = {0.0f, 1.0f, 0.0f};
		const struct view r = make_view(&rectangle_desc, p.x, p.y, p.z);
		const struct view t = make_view(&triangle_desc, p.x, p.y < 1.8f ? p.y : 1.7f, p.z);

		assert_close("rectangle", r.p, sampled_irradiance(&r, up),
			polygon_irradiance(rectangle, 4, &r, up));
		assert_close("triangle", t.p, sampled_irradiance(&t, up),
			polygon_irradiance(triangle_desc.u.triangle.vertices, 3, &t, up));
	}
}

/* Facing a disk on its axis: pi r^2 / (r^2 + h^2). */
static void disk_light_gives_its_form_factor(void **state)
{
	(void)state;
	for (double h = 0.2; h < 100.0; h *= 2.0) {
		const struct view view = make_view(&disk_desc, 0.0f, (float)(2.0 - h), 0.0f);
		const struct pen_vec3 up = {0.0f, 1.0f, 0.0f};
		const double r2 = 1.25 * 1.25;

		assert_close(
			"disk", view.p, sampled_irradiance(&view, up), M_PI * r2 / (r2 + h * h));
	}
}

/* A sphere wholly above the horizon: pi (r / d)^2 cos. */
static void sphere_light_gives_its_form_factor(void **state)
{
	(void)state;
	for (double d = 0.8; d < 2000.0; d *= 2.0) {
		const struct view view = make_view(&sphere_desc, 0.0f, (float)(2.0 - d), 0.0f);
		const double tilt = d < 1.0 ? 0.0 : 0.3;
		const struct pen_vec3 n = {(float)sin(tilt), (float)cos(tilt), 0.0f};
		const double ratio = 0.75 / d;

		assert_close("sphere", view.p, sampled_irradiance(&view, n),
			M_PI * ratio * ratio * cos(tilt));
	}
}

/* A directional light gives a facing surface its irradiance, whatever its angle. */
static void directional_light_gives_its_irradiance(void **state)
{
	static const double degrees[] = {0.0, 0.01, 0.53, 10.0, 120.0, 180.0};

	(void)state;
	for (size_t i = 0; i < sizeof(degrees) / sizeof(degrees[0]); i++) {
		const struct pen_light_desc desc = {
			.type = PEN_LIGHT_DIRECTIONAL,
			.color = {1, 1, 1},
			.u.directional = {{0, -0.6, -0.8}, degrees[i]},
		};
		const struct view view = make_view(&desc, 1.0f, 2.0f, 3.0f);

		assert_close("directional", view.p,
			sampled_irradiance(&view, pen_vec3(0.0f, 0.6f, 0.8f)), 1.0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(light_directions),
		cmocka_unit_test(samples_agree_with_pdf),
		cmocka_unit_test(polygon_lights_give_lamberts_irradiance),
		cmocka_unit_test(disk_light_gives_its_form_factor),
		cmocka_unit_test(sphere_light_gives_its_form_factor),
		cmocka_unit_test(directional_light_gives_its_irradiance),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
