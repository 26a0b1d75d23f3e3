/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light.h"

#include "core/render/solid_angle.h"
#include "core/render/warp.h"

#include <math.h>

/* A rectangle that fills less than this is sampled by area: rounding would show otherwise. */
#define RECTANGLE_SOLID_ANGLE_MIN 1e-3f

/* So is a triangle outside of these. */
#define TRIANGLE_SOLID_ANGLE_MIN 3e-4f
#define TRIANGLE_SOLID_ANGLE_MAX 6.22f

/* Of a point in a light's plane, or a triangle without area: its square is still a number. */
#define PDF_MAX 1e15f

static void rectangle_init(struct pen_light *light, const struct pen_light_desc *desc)
{
	const struct pen_vec3 u = pen_vec3_load(desc->u.rectangle.edge_u);
	const struct pen_vec3 v = pen_vec3_load(desc->u.rectangle.edge_v);

	light->origin = pen_vec3_load(desc->u.rectangle.corner);
	light->length_u = pen_length(u);
	light->length_v = pen_length(v);
	light->edge_u = pen_normalize(u);
	light->edge_v = pen_normalize(v);
	light->axis = pen_normalize(pen_cross(light->edge_u, light->edge_v));
	light->area = light->length_u * light->length_v;
	light->back = 1.0f;
}

PEN_LANE void set_triangle(struct pen_light *light, struct pen_vec3 corner, struct pen_vec3 edge_u,
	struct pen_vec3 edge_v)
{
	const struct pen_vec3 normal = pen_cross(edge_u, edge_v);
	const float length = pen_length(normal);

	light->origin = corner;
	light->edge_u = edge_u;
	light->edge_v = edge_v;
	light->axis = pen_scale(normal, 1.0f / length);
	light->area = 0.5f * length;
}

void pen_light_set_triangle(struct pen_light *light, struct pen_vec3 corner, struct pen_vec3 edge_u,
	struct pen_vec3 edge_v)
{
	light->type = PEN_LIGHT_TRIANGLE;
	set_triangle(light, corner, edge_u, edge_v);
}

static void set_sphere(struct pen_light *light, struct pen_vec3 center, float radius)
{
	light->origin = center;
	light->radius = radius;
	light->area = 4.0f * PEN_PI * radius * radius;
}

void pen_light_set_sphere(struct pen_light *light, struct pen_vec3 center, float radius)
{
	light->type = PEN_LIGHT_SPHERE;
	set_sphere(light, center, radius);
}

static void triangle_init(struct pen_light *light, const struct pen_light_desc *desc)
{
	const struct pen_vec3 a = pen_vec3_load(desc->u.triangle.vertices[0]);

	set_triangle(light, a, pen_sub(pen_vec3_load(desc->u.triangle.vertices[1]), a),
		pen_sub(pen_vec3_load(desc->u.triangle.vertices[2]), a));
}

static void disk_init(struct pen_light *light, const struct pen_light_desc *desc)
{
	light->origin = pen_vec3_load(desc->u.disk.center);
	light->axis = pen_vec3_load(desc->u.disk.normal);
	light->radius = (float)desc->u.disk.radius;
	light->area = PEN_PI * light->radius * light->radius;

	const struct pen_basis basis = pen_basis(light->axis);

	light->edge_u = pen_scale(basis.t, light->radius);
	light->edge_v = pen_scale(basis.b, light->radius);
}

static void spot_init(struct pen_light *light, const struct pen_light_desc *desc)
{
	const double half = desc->u.spot.cone_angle * M_PI / 360.0;

	light->origin = pen_vec3_load(desc->u.spot.position);
	light->axis = pen_vec3_load(desc->u.spot.direction);
	light->spot_cos = (float)cos(half);
	light->spot_inv_blend = (float)(1.0 / fmax(desc->u.spot.blend * (1.0 - cos(half)), 1e-9));
}

static void directional_init(struct pen_light *light, const struct pen_light_desc *desc)
{
	const double s = sin(desc->u.directional.angle * M_PI / 720.0); /* of a quarter */
	const double h = 2.0 * s * s;

	light->axis = pen_neg(pen_vec3_load(desc->u.directional.direction));
	light->delta = h <= 0.0;
	light->cone = (float)h;
	/* The cosine's integral over the cone is pi sin^2 = pi h (2 - h). */
	light->cone_strength = light->delta ? 1.0f : (float)(1.0 / (M_PI * h * (2.0 - h)));
	light->cone_pdf = light->delta ? 1.0f : (float)(0.5 / (M_PI * h));
	light->edge_u = pen_basis(light->axis).t;
	light->edge_v = pen_basis(light->axis).b;
}

void pen_light_init(struct pen_light *light, const struct pen_light_desc *desc)
{
	*light = (struct pen_light){.type = desc->type, .color = pen_vec3_load(desc->color)};
	switch (desc->type) {
	case PEN_LIGHT_RECTANGLE: rectangle_init(light, desc); break;
	case PEN_LIGHT_TRIANGLE: triangle_init(light, desc); break;
	case PEN_LIGHT_DISK: disk_init(light, desc); break;
	case PEN_LIGHT_SPHERE:
		set_sphere(
			light, pen_vec3_load(desc->u.sphere.center), (float)desc->u.sphere.radius);
		break;
	case PEN_LIGHT_POINT:
		light->origin = pen_vec3_load(desc->u.point.position);
		light->delta = true;
		break;
	case PEN_LIGHT_SPOT:
		spot_init(light, desc);
		light->delta = true;
		break;
	case PEN_LIGHT_DIRECTIONAL: directional_init(light, desc); break;
	}
}

/* Solid-angle density of points chosen by area, at a distance along the ray. */
PEN_LANE float area_pdf(const struct pen_light *light, float depth, float distance)
{
	return distance * distance * distance / (pen_max(fabsf(depth), PEN_TINY) * light->area);
}

/* A sample of a flat light from the vector to a point of it. */
PEN_LANE struct pen_light_sample flat_sample(
	const struct pen_light *light, struct pen_vec3 to, float depth, float solid_angle)
{
	const float distance = pen_max(pen_length(to), PEN_TINY);
	const float by_area = pen_min(area_pdf(light, depth, distance), PDF_MAX);

	return (struct pen_light_sample){
		.direction = pen_scale(to, 1.0f / distance),
		.distance = distance,
		.strength = depth < 0.0f ? 1.0f : 0.0f,
		.pdf = solid_angle > 0.0f ? 1.0f / pen_max(solid_angle, PEN_TINY) : by_area,
	};
}

PEN_LANE struct pen_window window_at(const struct pen_light *light, struct pen_vec3 p)
{
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const float x = pen_dot(to, light->edge_u);
	const float y = pen_dot(to, light->edge_v);

	return (struct pen_window){
		.x0 = x,
		.x1 = x + light->length_u,
		.y0 = y,
		.y1 = y + light->length_v,
		.z = pen_dot(to, light->axis),
	};
}

/* 0 where the rectangle is to be sampled by area. */
PEN_LANE float rectangle_solid_angle(struct pen_window w)
{
	const float solid_angle = pen_window_solid_angle(w);

	return solid_angle >= RECTANGLE_SOLID_ANGLE_MIN ? solid_angle : 0.0f;
}

PEN_LANE struct pen_light_sample sample_rectangle(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct pen_window w = window_at(light, p);
	const float solid_angle = rectangle_solid_angle(w);
	const bool by_area = solid_angle <= 0.0f;
	const struct pen_vec2 point = pen_window_sample(w, solid_angle, u, v);
	const float x = by_area ? w.x0 + u * light->length_u : point.x;
	const float y = by_area ? w.y0 + v * light->length_v : point.y;
	const struct pen_vec3 across =
		pen_add(pen_scale(light->edge_u, x), pen_scale(light->edge_v, y));
	const float depth = pen_min(w.z, light->back * w.z);

	return flat_sample(light, pen_madd(across, w.z, light->axis), depth, solid_angle);
}

PEN_LANE struct pen_corners corners_at(const struct pen_light *light, struct pen_vec3 to)
{
	const float volume = fabsf(pen_dot(to, light->axis)) * 2.0f * light->area;

	return pen_corners(to, pen_add(to, light->edge_u), pen_add(to, light->edge_v), volume);
}

/* 0 where the triangle is to be sampled by area. */
PEN_LANE float corners_solid_angle(const struct pen_corners *corners)
{
	const bool useful = corners->solid_angle >= TRIANGLE_SOLID_ANGLE_MIN &&
			    corners->solid_angle <= TRIANGLE_SOLID_ANGLE_MAX;

	return useful ? corners->solid_angle : 0.0f;
}

PEN_LANE struct pen_light_sample sample_triangle(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const float depth = pen_dot(to, light->axis);
	const struct pen_corners corners = corners_at(light, to);
	const float solid_angle = corners_solid_angle(&corners);
	const bool by_area = solid_angle <= 0.0f;
	const struct pen_vec3 direction = pen_corners_sample(&corners, u, v);
	const float reach = fabsf(depth) / pen_max(fabsf(pen_dot(direction, light->axis)), 1e-12f);
	const float s = sqrtf(u);
	const struct pen_vec3 point =
		pen_madd(pen_madd(to, s * (1.0f - v), light->edge_u), s * v, light->edge_v);
	const struct pen_vec3 hit = {
		by_area ? point.x : direction.x * reach,
		by_area ? point.y : direction.y * reach,
		by_area ? point.z : direction.z * reach,
	};

	return flat_sample(light, hit, depth, solid_angle);
}

PEN_LANE struct pen_light_sample sample_disk(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct pen_vec2 d = pen_warp_disk(u, v);
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const struct pen_vec3 hit = pen_madd(pen_madd(to, d.x, light->edge_u), d.y, light->edge_v);

	return flat_sample(light, hit, pen_dot(to, light->axis), 0.0f);
}

/* 1 - cos of the half angle under which a sphere is seen; 0 from inside. */
PEN_LANE float sphere_cone(const struct pen_light *light, float distance2)
{
	const float sin2 = light->radius * light->radius / pen_max(distance2, PEN_TINY);

	return sin2 < 1.0f ? sin2 / (1.0f + pen_sqrt_clamped(1.0f - sin2)) : 0.0f;
}

/* From inside, where nothing is seen, it is finite all the same. */
PEN_LANE float cone_pdf(float cone)
{
	return pen_min(0.5f * PEN_INV_PI / pen_max(cone, PEN_TINY), PDF_MAX);
}

PEN_LANE struct pen_light_sample sample_sphere(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const float distance2 = pen_max(pen_dot(to, to), PEN_TINY);
	const float distance = sqrtf(distance2);
	const float cone = sphere_cone(light, distance2);
	const struct pen_basis basis = pen_basis(pen_scale(to, 1.0f / distance));
	const struct pen_vec3 local = pen_warp_cone(cone, u, v);
	const float offset2 = distance2 * (local.x * local.x + local.y * local.y);
	const float chord = pen_sqrt_clamped(light->radius * light->radius - offset2);

	return (struct pen_light_sample){
		.direction = pen_to_world(&basis, local),
		.distance = distance * local.z - chord,
		.strength = cone > 0.0f ? 1.0f : 0.0f,
		.pdf = cone_pdf(cone),
	};
}

PEN_LANE struct pen_light_sample sample_point(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const float distance2 = pen_max(pen_dot(to, to), PEN_TINY);
	const float distance = sqrtf(distance2);

	(void)u;
	(void)v;
	return (struct pen_light_sample){
		.direction = pen_scale(to, 1.0f / distance),
		.distance = distance,
		.strength = 1.0f / distance2,
		.pdf = 1.0f,
	};
}

PEN_LANE struct pen_light_sample sample_spot(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	struct pen_light_sample sample = sample_point(light, p, u, v);
	const float inside = -pen_dot(sample.direction, light->axis) - light->spot_cos;
	const float t = pen_clamp(inside * light->spot_inv_blend, 0.0f, 1.0f);

	sample.strength *= t * t * (3.0f - 2.0f * t);
	return sample;
}

/* A delta is a cone of no width. */
PEN_LANE struct pen_light_sample sample_directional(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct pen_vec3 local = pen_warp_cone(light->cone, u, v);
	const struct pen_vec3 across =
		pen_madd(pen_scale(light->edge_u, local.x), local.y, light->edge_v);

	(void)p;
	return (struct pen_light_sample){
		.direction = pen_madd(across, local.z, light->axis),
		.distance = INFINITY,
		.strength = light->cone_strength,
		.pdf = light->cone_pdf,
	};
}

/* Inputs and outputs of pen_light_sample. */
struct batch {
	struct pen_light_points p;
	const float *u, *v;
	struct pen_light_samples out;
};

PEN_LANE void store(const struct batch *batch, uint32_t lane, struct pen_light_sample sample)
{
	batch->out.direction_x[lane] = sample.direction.x;
	batch->out.direction_y[lane] = sample.direction.y;
	batch->out.direction_z[lane] = sample.direction.z;
	batch->out.distance[lane] = sample.distance;
	batch->out.strength[lane] = sample.strength;
	batch->out.pdf[lane] = sample.pdf;
}

typedef struct pen_light_sample (*sample_function)(
	const struct pen_light *light, struct pen_vec3 p, float u, float v);

/* function is a constant where this is called and inlined into the loop. */
PEN_LANE void sample_all(
	const struct pen_light *light, uint32_t n, struct batch batch, sample_function function)
{
	const struct pen_light copy = *light;

#pragma omp simd
	for (uint32_t i = 0; i < n; i++) {
		const struct pen_vec3 p = {batch.p.x[i], batch.p.y[i], batch.p.z[i]};
		const struct pen_light_sample sample = function(&copy, p, batch.u[i], batch.v[i]);

		store(&batch, i, sample);
	}
}

void pen_light_sample(const struct pen_light *light, uint32_t n,
	const struct pen_light_points *points, const float *u, const float *v,
	const struct pen_light_samples *ret_samples)
{
	const struct batch batch = {*points, u, v, *ret_samples};

	switch (light->type) {
	case PEN_LIGHT_RECTANGLE: sample_all(light, n, batch, sample_rectangle); break;
	case PEN_LIGHT_TRIANGLE: sample_all(light, n, batch, sample_triangle); break;
	case PEN_LIGHT_DISK: sample_all(light, n, batch, sample_disk); break;
	case PEN_LIGHT_SPHERE: sample_all(light, n, batch, sample_sphere); break;
	case PEN_LIGHT_POINT: sample_all(light, n, batch, sample_point); break;
	case PEN_LIGHT_SPOT: sample_all(light, n, batch, sample_spot); break;
	case PEN_LIGHT_DIRECTIONAL: sample_all(light, n, batch, sample_directional); break;
	}
}

/* A local of the loop itself whose address is taken would keep it from vectorising. */
PEN_LANE struct pen_light_sample sample_one_triangle(
	const struct pen_light_triangles *t, uint32_t lane, struct pen_vec3 p, float u, float v)
{
	struct pen_light light;

	set_triangle(&light, pen_vec3(t->corner_x[lane], t->corner_y[lane], t->corner_z[lane]),
		pen_vec3(t->edge_ux[lane], t->edge_uy[lane], t->edge_uz[lane]),
		pen_vec3(t->edge_vx[lane], t->edge_vy[lane], t->edge_vz[lane]));
	return sample_triangle(&light, p, u, v);
}

void pen_light_sample_triangles(uint32_t n, const struct pen_light_triangles *triangles,
	const struct pen_light_points *points, const float *u, const float *v,
	const struct pen_light_samples *ret_samples)
{
	const struct batch batch = {*points, u, v, *ret_samples};
	const struct pen_light_triangles t = *triangles;

#pragma omp simd
	for (uint32_t i = 0; i < n; i++) {
		const struct pen_vec3 p = {batch.p.x[i], batch.p.y[i], batch.p.z[i]};
		const struct pen_light_sample sample =
			sample_one_triangle(&t, i, p, batch.u[i], batch.v[i]);

		store(&batch, i, sample);
	}
}

struct pen_light_sample pen_light_sample_one(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	switch (light->type) {
	case PEN_LIGHT_RECTANGLE: return sample_rectangle(light, p, u, v);
	case PEN_LIGHT_TRIANGLE: return sample_triangle(light, p, u, v);
	case PEN_LIGHT_DISK: return sample_disk(light, p, u, v);
	case PEN_LIGHT_SPHERE: return sample_sphere(light, p, u, v);
	case PEN_LIGHT_SPOT: return sample_spot(light, p, u, v);
	case PEN_LIGHT_DIRECTIONAL: return sample_directional(light, p, u, v);
	case PEN_LIGHT_POINT: break;
	}
	return sample_point(light, p, u, v);
}

float pen_light_pdf(
	const struct pen_light *light, struct pen_vec3 p, struct pen_vec3 direction, float distance)
{
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const float by_area = area_pdf(light, distance * pen_dot(direction, light->axis), distance);
	struct pen_corners corners;
	float solid_angle;

	switch (light->type) {
	case PEN_LIGHT_RECTANGLE:
		solid_angle = rectangle_solid_angle(window_at(light, p));
		return solid_angle > 0.0f ? 1.0f / solid_angle : by_area;
	case PEN_LIGHT_TRIANGLE:
		corners = corners_at(light, to);
		solid_angle = corners_solid_angle(&corners);
		return solid_angle > 0.0f ? 1.0f / solid_angle : by_area;
	case PEN_LIGHT_DISK: return by_area;
	case PEN_LIGHT_SPHERE:
		solid_angle = 2.0f * PEN_PI * sphere_cone(light, pen_dot(to, to));
		return solid_angle > 0.0f ? 1.0f / solid_angle : 0.0f;
	case PEN_LIGHT_POINT:
	case PEN_LIGHT_SPOT:
	case PEN_LIGHT_DIRECTIONAL: break;
	}
	return 0.0f;
}

bool pen_light_emits(const struct pen_light *light, struct pen_vec3 hit, struct pen_vec3 direction)
{
	const struct pen_vec3 outwards =
		light->type == PEN_LIGHT_SPHERE ? pen_sub(hit, light->origin) : light->axis;

	return pen_dot(outwards, direction) < 0.0f;
}

/* The vector from the light's origin to its centre. */
static struct pen_vec3 centre_offset(const struct pen_light *light)
{
	if (light->type == PEN_LIGHT_RECTANGLE)
		return pen_madd(pen_scale(light->edge_u, 0.5f * light->length_u),
			0.5f * light->length_v, light->edge_v);
	if (light->type == PEN_LIGHT_TRIANGLE)
		return pen_scale(pen_add(light->edge_u, light->edge_v), 1.0f / 3.0f);
	return pen_vec3(0.0f, 0.0f, 0.0f);
}

struct pen_light_sample pen_light_centre(const struct pen_light *light, struct pen_vec3 p)
{
	const struct pen_vec3 to = pen_add(pen_sub(light->origin, p), centre_offset(light));
	const float distance = pen_max(pen_length(to), PEN_TINY);
	struct pen_light_sample sample = {
		.direction = pen_scale(to, 1.0f / distance),
		.distance = distance,
		.pdf = 1.0f,
	};
	float facing; /* the area that this direction sees */

	switch (light->type) {
	case PEN_LIGHT_RECTANGLE:
	case PEN_LIGHT_TRIANGLE:
	case PEN_LIGHT_DISK:
		facing = light->area * pen_max(-pen_dot(sample.direction, light->axis), 0.0f);
		sample.strength = facing / (distance * distance);
		break;
	case PEN_LIGHT_SPHERE:
		facing = distance > light->radius ? 0.25f * light->area : 0.0f;
		sample.strength = facing / (distance * distance);
		sample.distance -= light->radius;
		break;
	case PEN_LIGHT_POINT:
	case PEN_LIGHT_SPOT: return pen_light_sample_one(light, p, 0.5f, 0.5f);
	case PEN_LIGHT_DIRECTIONAL:
		return (struct pen_light_sample){light->axis, INFINITY, 1.0f, 1.0f};
	}
	return sample;
}
