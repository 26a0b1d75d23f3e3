/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light.h"

#include "core/render/warp.h"

#include <math.h>

/* A rectangle that fills less than this is sampled by area: rounding would show otherwise. */
#define RECTANGLE_SOLID_ANGLE_MIN 1e-3f

/* So is a triangle outside of these. */
#define TRIANGLE_SOLID_ANGLE_MIN 3e-4f
#define TRIANGLE_SOLID_ANGLE_MAX 6.22f

#define TINY 1e-30f

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
}

static void triangle_init(struct pen_light *light, const struct pen_light_desc *desc)
{
	const struct pen_vec3 a = pen_vec3_load(desc->u.triangle.vertices[0]);

	light->origin = a;
	light->edge_u = pen_sub(pen_vec3_load(desc->u.triangle.vertices[1]), a);
	light->edge_v = pen_sub(pen_vec3_load(desc->u.triangle.vertices[2]), a);

	const struct pen_vec3 normal = pen_cross(light->edge_u, light->edge_v);

	light->axis = pen_normalize(normal);
	light->area = 0.5f * pen_length(normal);
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
		light->origin = pen_vec3_load(desc->u.sphere.center);
		light->radius = (float)desc->u.sphere.radius;
		light->area = 4.0f * PEN_PI * light->radius * light->radius;
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

double pen_light_power(const struct pen_light_desc *desc, double scene_radius)
{
	const double luminance =
		0.2126 * desc->color[0] + 0.7152 * desc->color[1] + 0.0722 * desc->color[2];
	struct pen_light light;

	pen_light_init(&light, desc);
	switch (desc->type) {
	case PEN_LIGHT_RECTANGLE:
	case PEN_LIGHT_TRIANGLE:
	case PEN_LIGHT_DISK:
	case PEN_LIGHT_SPHERE: return luminance * M_PI * (double)light.area;
	case PEN_LIGHT_POINT: return luminance * 4.0 * M_PI;
	case PEN_LIGHT_SPOT: return luminance * 2.0 * M_PI * (1.0 - (double)light.spot_cos);
	case PEN_LIGHT_DIRECTIONAL: return luminance * M_PI * scene_radius * scene_radius;
	}
	return 0.0;
}

/* Solid-angle density of points chosen by area, at a distance along the ray. */
PEN_LANE float area_pdf(const struct pen_light *light, float depth, float distance)
{
	return distance * distance * distance / (pen_max(fabsf(depth), TINY) * light->area);
}

/* A sample of a flat light from the vector to a point of it. */
PEN_LANE struct pen_light_sample flat_sample(
	const struct pen_light *light, struct pen_vec3 to, float depth, float solid_angle)
{
	const float distance = pen_max(pen_length(to), TINY);
	const float by_area = area_pdf(light, depth, distance);

	return (struct pen_light_sample){
		.direction = pen_scale(to, 1.0f / distance),
		.distance = distance,
		.strength = depth < 0.0f ? 1.0f : 0.0f,
		.pdf = solid_angle > 0.0f ? 1.0f / pen_max(solid_angle, TINY) : by_area,
	};
}

/* A rectangle as seen from a point: x, y and z along its edges and its normal. */
struct window {
	float x0, x1, y0, y1, z;
};

PEN_LANE struct window window_at(const struct pen_light *light, struct pen_vec3 p)
{
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const float x = pen_dot(to, light->edge_u);
	const float y = pen_dot(to, light->edge_v);

	return (struct window){
		.x0 = x,
		.x1 = x + light->length_u,
		.y0 = y,
		.y1 = y + light->length_v,
		.z = pen_dot(to, light->axis),
	};
}

/*
 * The solid angle of a triangle (Van Oosterom, Strackee 1983) from its volume with the eye and
 * the vectors to its corners. Accurate however small.
 */
PEN_LANE float triangle_solid_angle(
	float volume, struct pen_vec3 a, struct pen_vec3 b, struct pen_vec3 c)
{
	const float la = pen_length(a);
	const float lb = pen_length(b);
	const float lc = pen_length(c);
	const float cosines =
		la * lb * lc + pen_dot(a, b) * lc + pen_dot(b, c) * la + pen_dot(c, a) * lb;

	return 2.0f * pen_angle(volume, cosines);
}

/* 0 where the window is to be sampled by area. */
PEN_LANE float window_solid_angle(struct window w)
{
	const struct pen_vec3 a = {w.x0, w.y0, w.z};
	const struct pen_vec3 b = {w.x1, w.y0, w.z};
	const struct pen_vec3 c = {w.x1, w.y1, w.z};
	const struct pen_vec3 d = {w.x0, w.y1, w.z};
	const float volume = fabsf(w.z) * (w.x1 - w.x0) * (w.y1 - w.y0);
	const float solid_angle =
		triangle_solid_angle(volume, a, b, c) + triangle_solid_angle(volume, a, c, d);

	return solid_angle >= RECTANGLE_SOLID_ANGLE_MIN ? solid_angle : 0.0f;
}

/*
 * Urena et al. 2013, "An area-preserving parametrization for spherical rectangles", with arc sines:
 * the strip of the window left of x fills asin(c b1) - asin(c b0) more than that left of 0, where
 * c, b0 and b1 are the sines under which x, y0 and y1 are seen.
 */
PEN_LANE float window_x(struct window w, float solid_angle, float u)
{
	const float z2 = w.z * w.z + TINY;
	const float b0 = w.y0 / sqrtf(w.y0 * w.y0 + z2);
	const float b1 = w.y1 / sqrtf(w.y1 * w.y1 + z2);
	const float c0 = w.x0 / sqrtf(w.x0 * w.x0 + z2);
	const float strip = pen_asin(c0 * b1) - pen_asin(c0 * b0) + u * solid_angle;
	/* sin(strip) = c |b1 - b0 exp(i strip)|, by the half angle; x is z c / sqrt(1 - c^2). */
	const struct pen_sincos half = pen_sincos_turns(strip * (0.25f * PEN_INV_PI));
	const float sine = 2.0f * half.sin * half.cos;
	const float chord2 = (b1 - b0) * (b1 - b0) + 4.0f * b0 * b1 * half.sin * half.sin;
	const float x = sqrtf(z2) * sine / sqrtf(pen_max(chord2 - sine * sine, TINY));

	return pen_clamp(x, w.x0, w.x1);
}

/* Along the chosen column the sine of the elevation is uniform. */
PEN_LANE float window_y(struct window w, float x, float v)
{
	const float d2 = x * x + w.z * w.z + TINY;
	const float h0 = w.y0 / sqrtf(w.y0 * w.y0 + d2);
	const float h1 = w.y1 / sqrtf(w.y1 * w.y1 + d2);
	const float h = h0 + v * (h1 - h0);
	const float y = h * sqrtf(d2 / pen_max(1.0f - h * h, TINY));

	return pen_clamp(y, w.y0, w.y1);
}

PEN_LANE struct pen_light_sample sample_rectangle(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct window w = window_at(light, p);
	const float solid_angle = window_solid_angle(w);
	const bool by_area = solid_angle <= 0.0f;
	const float inner_x = window_x(w, solid_angle, u);
	const float inner_y = window_y(w, inner_x, v);
	const float x = by_area ? w.x0 + u * light->length_u : inner_x;
	const float y = by_area ? w.y0 + v * light->length_v : inner_y;
	const struct pen_vec3 across =
		pen_add(pen_scale(light->edge_u, x), pen_scale(light->edge_v, y));

	return flat_sample(light, pen_madd(across, w.z, light->axis), w.z, solid_angle);
}

/* The corners of a triangle as seen from a point: unit vectors, and what follows from them. */
struct corners {
	struct pen_vec3 a, b, c;
	float volume;	/* of the unit vectors' parallelepiped */
	float ab, rest; /* 1 + a.b, and b.c + c.a */
	float solid_angle;
};

PEN_LANE struct corners corners_at(const struct pen_light *light, struct pen_vec3 to)
{
	const struct pen_vec3 b = pen_add(to, light->edge_u);
	const struct pen_vec3 c = pen_add(to, light->edge_v);
	const float inv_a = 1.0f / pen_max(pen_length(to), TINY);
	const float inv_b = 1.0f / pen_max(pen_length(b), TINY);
	const float inv_c = 1.0f / pen_max(pen_length(c), TINY);
	const float volume = fabsf(pen_dot(to, light->axis)) * 2.0f * light->area;
	struct corners corners = {
		.a = pen_scale(to, inv_a),
		.b = pen_scale(b, inv_b),
		.c = pen_scale(c, inv_c),
		.volume = volume * inv_a * inv_b * inv_c,
	};

	corners.ab = 1.0f + pen_dot(corners.a, corners.b);
	corners.rest = pen_dot(corners.b, corners.c) + pen_dot(corners.c, corners.a);
	corners.solid_angle = 2.0f * pen_angle(corners.volume, corners.ab + corners.rest);
	return corners;
}

PEN_LANE bool corners_by_area(float solid_angle)
{
	return solid_angle < TRIANGLE_SOLID_ANGLE_MIN || solid_angle > TRIANGLE_SOLID_ANGLE_MAX;
}

/*
 * Arvo 1995, "Stratified sampling of spherical triangles": u chooses a point d on the side from a
 * to c such that the triangle a b d has the share u of the solid angle, v a point between b and d.
 * d = (1 - r^2, 2 r (1 + r a.c)) / (1 + 2 r a.c + r^2) in terms of a and c, where r = p / q follows
 * from the tangent of half the share's angle (Van Oosterom, Strackee 1983).
 */
PEN_LANE struct pen_vec3 corners_sample(const struct corners *corners, float u, float v)
{
	const float ac = pen_dot(corners->a, corners->c);
	const struct pen_sincos half =
		pen_sincos_turns(u * corners->solid_angle * (0.25f * PEN_INV_PI));
	const float p = half.sin * corners->ab;
	const float q = half.cos * corners->volume - half.sin * corners->rest;
	const float scale = 1.0f / (q * q + 2.0f * p * q * ac + p * p);
	const struct pen_vec3 d = pen_madd(pen_scale(corners->a, (q * q - p * p) * scale),
		2.0f * p * (q + p * ac) * scale, corners->c);
	const struct pen_vec3 gap = pen_sub(d, corners->b);
	const float drop = 0.5f * pen_dot(gap, gap); /* 1 - b.d, exact for small triangles */
	const struct pen_vec3 side = pen_madd(d, drop - 1.0f, corners->b);
	const float spread = sqrtf(v * (2.0f - v * drop) / pen_max(2.0f - drop, 1e-6f));

	return pen_normalize(pen_madd(pen_scale(corners->b, 1.0f - v * drop), spread, side));
}

PEN_LANE struct pen_light_sample sample_triangle(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const float depth = pen_dot(to, light->axis);
	const struct corners corners = corners_at(light, to);
	const bool by_area = corners_by_area(corners.solid_angle);
	const struct pen_vec3 direction = corners_sample(&corners, u, v);
	const float reach = fabsf(depth) / pen_max(fabsf(pen_dot(direction, light->axis)), 1e-12f);
	const float s = sqrtf(u);
	const struct pen_vec3 point =
		pen_madd(pen_madd(to, s * (1.0f - v), light->edge_u), s * v, light->edge_v);
	const struct pen_vec3 hit = {
		by_area ? point.x : direction.x * reach,
		by_area ? point.y : direction.y * reach,
		by_area ? point.z : direction.z * reach,
	};

	return flat_sample(light, hit, depth, by_area ? 0.0f : corners.solid_angle);
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
	const float sin2 = light->radius * light->radius / pen_max(distance2, TINY);

	return sin2 < 1.0f ? sin2 / (1.0f + pen_sqrt_clamped(1.0f - sin2)) : 0.0f;
}

PEN_LANE float cone_pdf(float cone)
{
	return 0.5f * PEN_INV_PI / pen_max(cone, TINY);
}

PEN_LANE struct pen_light_sample sample_sphere(
	const struct pen_light *light, struct pen_vec3 p, float u, float v)
{
	const struct pen_vec3 to = pen_sub(light->origin, p);
	const float distance2 = pen_max(pen_dot(to, to), TINY);
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
	const float distance2 = pen_max(pen_dot(to, to), TINY);
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
		.pdf = light->delta ? 1.0f : cone_pdf(light->cone),
	};
}

/* Inputs and outputs of pen_light_sample. */
struct batch {
	struct pen_light_points p;
	const float *u, *v;
	struct pen_light_samples out;
};

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

		batch.out.direction_x[i] = sample.direction.x;
		batch.out.direction_y[i] = sample.direction.y;
		batch.out.direction_z[i] = sample.direction.z;
		batch.out.distance[i] = sample.distance;
		batch.out.strength[i] = sample.strength;
		batch.out.pdf[i] = sample.pdf;
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
	const float depth = distance * pen_dot(direction, light->axis);
	float solid_angle = 0.0f;

	switch (light->type) {
	case PEN_LIGHT_RECTANGLE: solid_angle = window_solid_angle(window_at(light, p)); break;
	case PEN_LIGHT_TRIANGLE:
		solid_angle = corners_at(light, to).solid_angle;
		solid_angle = corners_by_area(solid_angle) ? 0.0f : solid_angle;
		break;
	case PEN_LIGHT_DISK: break;
	case PEN_LIGHT_SPHERE: {
		const float cone = sphere_cone(light, pen_dot(to, to));

		return cone > 0.0f ? cone_pdf(cone) : 0.0f;
	}
	case PEN_LIGHT_POINT:
	case PEN_LIGHT_SPOT:
	case PEN_LIGHT_DIRECTIONAL: return 0.0f;
	}
	return solid_angle > 0.0f ? 1.0f / solid_angle : area_pdf(light, depth, distance);
}

bool pen_light_emits(const struct pen_light *light, struct pen_vec3 hit, struct pen_vec3 direction)
{
	const struct pen_vec3 outwards =
		light->type == PEN_LIGHT_SPHERE ? pen_sub(hit, light->origin) : light->axis;

	return pen_dot(outwards, direction) < 0.0f;
}

struct pen_light_sample pen_light_centre(const struct pen_light *light, struct pen_vec3 p)
{
	struct pen_light_sample sample;
	struct pen_vec3 to = pen_sub(light->origin, p);
	float projected; /* the area that the centre's direction sees */

	switch (light->type) {
	case PEN_LIGHT_RECTANGLE:
		to = pen_madd(to, 0.5f * light->length_u, light->edge_u);
		to = pen_madd(to, 0.5f * light->length_v, light->edge_v);
		break;
	case PEN_LIGHT_TRIANGLE:
		to = pen_madd(to, 1.0f / 3.0f, pen_add(light->edge_u, light->edge_v));
		break;
	case PEN_LIGHT_DISK:
	case PEN_LIGHT_SPHERE: break;
	case PEN_LIGHT_POINT:
	case PEN_LIGHT_SPOT: return pen_light_sample_one(light, p, 0.5f, 0.5f);
	case PEN_LIGHT_DIRECTIONAL:
		return (struct pen_light_sample){light->axis, INFINITY, 1.0f, 1.0f};
	}

	const float distance2 = pen_max(pen_dot(to, to), TINY);

	sample.distance = sqrtf(distance2);
	sample.direction = pen_scale(to, 1.0f / sample.distance);
	sample.pdf = 1.0f;
	if (light->type == PEN_LIGHT_SPHERE) {
		projected = PEN_PI * light->radius * light->radius;
		sample.distance -= light->radius;
		projected = sample.distance > 0.0f ? projected : 0.0f;
	} else {
		projected = light->area * pen_max(-pen_dot(sample.direction, light->axis), 0.0f);
	}
	sample.strength = projected / distance2;
	return sample;
}
