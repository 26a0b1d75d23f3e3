/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/point.h"

#include "core/render/sphere.h"
#include "core/render/vec.h"
#include "core/render/vertex.h"

#include <math.h>

/*
 * A point's error as a share of the largest coordinate that went into it. Its own rounding is
 * some 2^-22; the rest is for Embree, which meets the surface again with as much.
 */
#define ERROR_SHARE 0x1p-20f

static float largest(struct pen_vec3 v)
{
	return pen_max(pen_max(fabsf(v.x), fabsf(v.y)), fabsf(v.z));
}

static struct pen_vec3 blend(
	struct pen_vec3 a, struct pen_vec3 b, struct pen_vec3 c, float u, float v)
{
	return pen_madd(pen_madd(pen_scale(a, 1.0f - u - v), u, b), v, c);
}

/* What the first pass over the lanes finds for the others. */
struct lookup {
	_Alignas(64) uint32_t route[PEN_LANES];
	int32_t primitive[PEN_LANES]; /* in its pool */
	uint32_t normal_offset[PEN_LANES];
	uint32_t routes;
	bool is_smooth;
};

static void store_point(
	struct pen_points *to, int lane, struct pen_vec3 p, struct pen_vec3 n, float error)
{
	to->x[lane] = p.x;
	to->y[lane] = p.y;
	to->z[lane] = p.z;
	to->facing_x[lane] = n.x;
	to->facing_y[lane] = n.y;
	to->facing_z[lane] = n.z;
	to->error[lane] = error;
}

PEN_LANE void store_surface(struct pen_points *to, struct lookup *lookup, int lane,
	struct pen_target target, struct pen_surface surface)
{
	lookup->route[lane] = target.route;
	lookup->normal_offset[lane] = target.normal_offset;
	to->kind[lane] = surface.kind;
	to->light[lane] = surface.light;
	to->red[lane] = surface.red;
	to->green[lane] = surface.green;
	to->blue[lane] = surface.blue;
	to->alpha[lane] = surface.alpha;
	to->eta[lane] = surface.ior;
}

/* nothing: the target of no hit. */
PEN_LANE int32_t target_of(const struct pen_hits *hits, int lane, uint32_t nothing)
{
	const uint32_t placed = hits->instance[lane];
	const uint32_t id = hits->geometry[lane];
	const uint32_t shape = placed != PEN_NO_INDEX ? placed : id;

	return (int32_t)(id == PEN_NO_INDEX ? nothing : shape);
}

/* Whether all lanes hit one shape, which is found faster: most camera packets do. */
static bool hits_one_shape(const struct pen_hits *hits)
{
	uint32_t difference = 0;

#pragma omp simd reduction(| : difference)
	for (int i = 0; i < PEN_LANES; i++)
		difference |= (hits->geometry[i] ^ hits->geometry[0]) |
			      (hits->instance[i] ^ hits->instance[0]);
	return difference == 0;
}

static void look_up_one(const struct pen_render_scene *scene, const struct pen_hits *hits,
	struct pen_points *to, struct lookup *lookup)
{
	const uint32_t nothing = scene->geometry.shape_count;
	const struct pen_target target = scene->targets[target_of(hits, 0, nothing)];
	const struct pen_surface surface = scene->surfaces[target.surface];

#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		store_surface(to, lookup, i, target, surface);
		lookup->primitive[i] = (int32_t)(target.first + hits->primitive[i]);
	}
	lookup->routes = target.route;
	lookup->is_smooth = target.normal_offset != PEN_NO_INDEX;
	to->kinds = surface.kinds;
}

static void look_up_each(const struct pen_render_scene *scene, const struct pen_hits *hits,
	struct pen_points *to, struct lookup *lookup)
{
	const struct pen_target *const targets = scene->targets;
	const struct pen_surface *const surfaces = scene->surfaces;
	const uint32_t nothing = scene->geometry.shape_count;
	uint32_t routes = 0, kinds = 0, smooth = 0;

#pragma omp simd reduction(| : routes, kinds, smooth)
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_target *target = &targets[target_of(hits, i, nothing)];
		const struct pen_surface *surface = &surfaces[(int32_t)target->surface];

		store_surface(to, lookup, i, *target, *surface);
		lookup->primitive[i] = (int32_t)(target->first + hits->primitive[i]);
		routes |= target->route;
		kinds |= surface->kinds;
		smooth |= ~target->normal_offset;
	}
	lookup->routes = routes;
	lookup->is_smooth = smooth != 0;
	to->kinds = kinds;
}

/* The vertices of the triangles that lanes hit, in their pool; some triangle's in other lanes. */
struct corners {
	_Alignas(64) int32_t a[PEN_LANES];
	int32_t b[PEN_LANES];
	int32_t c[PEN_LANES];
};

static void find_corners(
	const struct pen_geometry *geometry, const struct lookup *lookup, struct corners *ret)
{
	const int32_t *const indices = (const int32_t *)geometry->indices;

#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const int wanted = lookup->route[i] == PEN_ROUTE_TRIANGLE;
		const int32_t first = 3 * (lookup->primitive[i] & -wanted);

		ret->a[i] = indices[first];
		ret->b[i] = indices[first + 1];
		ret->c[i] = indices[first + 2];
	}
}

/* Where a lane's point is, its unit geometric normal and its error, if it is wanted. */
PEN_LANE void set_place(
	struct pen_points *to, int i, int wanted, struct pen_vec3 p, struct pen_vec3 n, float error)
{
	to->x[i] = pen_pick(wanted, p.x, to->x[i]);
	to->y[i] = pen_pick(wanted, p.y, to->y[i]);
	to->z[i] = pen_pick(wanted, p.z, to->z[i]);
	to->facing_x[i] = pen_pick(wanted, n.x, to->facing_x[i]);
	to->facing_y[i] = pen_pick(wanted, n.y, to->facing_y[i]);
	to->facing_z[i] = pen_pick(wanted, n.z, to->facing_z[i]);
	to->error[i] = pen_pick(wanted, error, to->error[i]);
}

static void find_triangles(const struct pen_geometry *geometry, const struct pen_hits *hits,
	const struct lookup *lookup, struct pen_points *to)
{
	const float *const pool = geometry->vertices;
	struct corners corners;

	find_corners(geometry, lookup, &corners);
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const int wanted = lookup->route[i] == PEN_ROUTE_TRIANGLE;
		const struct pen_vec3 a = pen_vertex(pool, corners.a[i]);
		const struct pen_vec3 b = pen_vertex(pool, corners.b[i]);
		const struct pen_vec3 c = pen_vertex(pool, corners.c[i]);
		const struct pen_vec3 p = blend(a, b, c, hits->u[i], hits->v[i]);
		const struct pen_vec3 n = pen_normalize(pen_cross(pen_sub(b, a), pen_sub(c, a)));
		const float reach = pen_max(pen_max(largest(a), largest(b)), largest(c));

		set_place(to, i, wanted, p, n, ERROR_SHARE * reach);
	}
}

static void find_spheres(const struct pen_geometry *geometry, const struct pen_rays *rays,
	const struct lookup *lookup, struct pen_points *to)
{
	const struct pen_sphere *const spheres = geometry->spheres;

#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const int wanted = lookup->route[i] == PEN_ROUTE_SPHERE;
		const struct pen_sphere *sphere = &spheres[lookup->primitive[i] & -wanted];
		const struct pen_vec3 center = {sphere->x, sphere->y, sphere->z};
		const float radius = sphere->radius;
		const struct pen_vec3 n = pen_normalize(pen_vec3(
			rays->origin_x[i] - center.x + rays->tfar[i] * rays->direction_x[i],
			rays->origin_y[i] - center.y + rays->tfar[i] * rays->direction_y[i],
			rays->origin_z[i] - center.z + rays->tfar[i] * rays->direction_z[i]));
		const struct pen_vec3 p = pen_madd(center, radius, n);
		const float error = ERROR_SHARE * (largest(center) + radius);

		set_place(to, i, wanted, p, n, error);
	}
}

/* Where the spheres are that lanes hit, at their times; some sphere in other lanes. */
struct travelled {
	_Alignas(64) float x[PEN_LANES];
	float y[PEN_LANES];
	float z[PEN_LANES];
	float radius[PEN_LANES];
};

static void travel(const struct pen_render_scene *scene, const struct pen_packet *packet,
	const struct lookup *lookup, struct travelled *ret)
{
	const struct pen_geometry *geometry = &scene->geometry;

	for (int i = 0; i < PEN_LANES; i++) {
		const int wanted = lookup->route[i] == PEN_ROUTE_TRAVELLER;
		const uint32_t shape = packet->hits.geometry[i] & (uint32_t)-wanted;
		const struct pen_model *model = &geometry->models[geometry->shapes[shape].model];
		struct pen_sphere at = {.radius = 1.0f};

		if (wanted) {
			const struct pen_spheres spheres = {
				geometry->spheres + model->first, model->count, model->step_count};

			at = pen_sphere_at(
				&spheres, (int32_t)packet->hits.primitive[i], packet->rays.time[i]);
		}
		ret->x[i] = at.x;
		ret->y[i] = at.y;
		ret->z[i] = at.z;
		ret->radius[i] = at.radius;
	}
}

static void find_travellers(const struct pen_render_scene *scene, const struct pen_packet *packet,
	const struct lookup *lookup, struct pen_points *to)
{
	const struct pen_rays *rays = &packet->rays;
	struct travelled spheres;

	travel(scene, packet, lookup, &spheres);
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const int wanted = lookup->route[i] == PEN_ROUTE_TRAVELLER;
		const struct pen_vec3 center = {spheres.x[i], spheres.y[i], spheres.z[i]};
		const struct pen_vec3 towards = {
			rays->origin_x[i] + rays->tfar[i] * rays->direction_x[i],
			rays->origin_y[i] + rays->tfar[i] * rays->direction_y[i],
			rays->origin_z[i] + rays->tfar[i] * rays->direction_z[i]};
		const struct pen_vec3 n = pen_normalize(pen_sub(towards, center));
		const struct pen_vec3 p = pen_madd(center, spheres.radius[i], n);
		const float error = ERROR_SHARE * (largest(center) + spheres.radius[i]);

		set_place(to, i, wanted, p, n, error);
	}
}

/* A point in its shape's coordinates. */
struct own_point {
	struct pen_vec3 p, n;	/* n unit, outwards */
	struct pen_vec3 smooth; /* unit shading normal */
	float reach;		/* largest coordinate that went into it */
};

static struct own_point triangle_point(const struct pen_geometry *geometry,
	const struct pen_model *model, const struct pen_packet *packet, int lane)
{
	const uint32_t *index =
		geometry->indices + 3 * (size_t)(model->first + packet->hits.primitive[lane]);
	const float time = packet->rays.time[lane];
	const float u = packet->hits.u[lane], v = packet->hits.v[lane];
	const struct pen_vec3 a = pen_vertex_at(geometry->vertices, model, index[0], time);
	const struct pen_vec3 b = pen_vertex_at(geometry->vertices, model, index[1], time);
	const struct pen_vec3 c = pen_vertex_at(geometry->vertices, model, index[2], time);
	struct own_point point = {
		.p = blend(a, b, c, u, v),
		.n = pen_normalize(pen_cross(pen_sub(b, a), pen_sub(c, a))),
		.reach = pen_max(pen_max(largest(a), largest(b)), largest(c)),
	};

	point.smooth = point.n;
	if (model->normal_offset != PEN_NO_INDEX) {
		const float *pool = geometry->normals;
		const uint32_t shift = model->normal_offset;

		point.smooth =
			pen_normalize(blend(pen_vertex_at(pool, model, index[0] + shift, time),
				pen_vertex_at(pool, model, index[1] + shift, time),
				pen_vertex_at(pool, model, index[2] + shift, time), u, v));
	}
	return point;
}

/* towards: from the origin of own coordinates to about the hit, which is then projected. */
static struct own_point sphere_point(const struct pen_sphere *sphere, struct pen_vec3 towards)
{
	const struct pen_vec3 center = {sphere->x, sphere->y, sphere->z};
	const struct pen_vec3 n = pen_normalize(pen_sub(towards, center));

	return (struct own_point){
		.p = pen_madd(center, sphere->radius, n),
		.n = n,
		.smooth = n,
		.reach = largest(center) + sphere->radius,
	};
}

static struct own_point disk_point(const struct pen_disk *disk, struct pen_vec3 towards)
{
	const struct pen_vec3 center = {disk->bounds.x, disk->bounds.y, disk->bounds.z};
	const struct pen_vec3 n = {disk->normal[0], disk->normal[1], disk->normal[2]};
	const float height = pen_dot(pen_sub(towards, center), n);

	return (struct own_point){
		.p = pen_madd(towards, -height, n),
		.n = n,
		.smooth = n,
		.reach = largest(center) + disk->bounds.radius,
	};
}

/* The inverse of an affine map applied to a point. */
static struct pen_vec3 to_own(const float m[3][4], struct pen_vec3 p)
{
	return pen_linear_inverse(m, pen_vec3(p.x - m[0][3], p.y - m[1][3], p.z - m[2][3]));
}

static struct pen_vec3 to_world(const float m[3][4], struct pen_vec3 p)
{
	return pen_vec3(m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z + m[0][3],
		m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z + m[1][3],
		m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z + m[2][3]);
}

/* By the inverse transpose: cofactors, with the determinant's sign. */
static struct pen_vec3 normal_to_world(const float m[3][4], struct pen_vec3 n)
{
	const struct pen_vec3 a = {m[0][0], m[1][0], m[2][0]};
	const struct pen_vec3 b = {m[0][1], m[1][1], m[2][1]};
	const struct pen_vec3 c = {m[0][2], m[1][2], m[2][2]};
	const struct pen_vec3 x = pen_cross(b, c), y = pen_cross(c, a), z = pen_cross(a, b);
	const struct pen_vec3 sum = pen_madd(pen_madd(pen_scale(x, n.x), n.y, y), n.z, z);

	return pen_normalize(pen_scale(sum, copysignf(1.0f, pen_dot(a, x))));
}

/* How much the map can stretch a length, at most. */
static float stretch_of(const float m[3][4])
{
	float sum = 0.0f;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			sum += m[i][j] * m[i][j];
	return sqrtf(sum);
}

static struct own_point own_point_of(const struct pen_geometry *geometry,
	const struct pen_model *model, const struct pen_packet *packet, int lane,
	struct pen_vec3 towards)
{
	const struct pen_spheres spheres = {
		geometry->spheres + model->first, model->count, model->step_count};
	struct pen_sphere sphere;

	switch (model->type) {
	case PEN_MODEL_TRIANGLES: return triangle_point(geometry, model, packet, lane);
	case PEN_MODEL_DISK: return disk_point(&geometry->disks[model->first], towards);
	case PEN_MODEL_SPHERES: break;
	}
	sphere = pen_sphere_at(
		&spheres, (int32_t)packet->hits.primitive[lane], packet->rays.time[lane]);
	return sphere_point(&sphere, towards);
}

static void find_slowly(const struct pen_render_scene *scene, const struct pen_packet *packet,
	int lane, struct pen_points *to)
{
	const struct pen_geometry *geometry = &scene->geometry;
	const struct pen_rays *rays = &packet->rays;
	const uint32_t placed = packet->hits.instance[lane];
	const uint32_t id = placed != PEN_NO_INDEX ? placed : packet->hits.geometry[lane];
	const struct pen_shape *shape = &geometry->shapes[id];
	const struct pen_model *model = &geometry->models[shape->model];
	const struct pen_vec3 origin = {
		rays->origin_x[lane], rays->origin_y[lane], rays->origin_z[lane]};
	const struct pen_vec3 direction = {
		rays->direction_x[lane], rays->direction_y[lane], rays->direction_z[lane]};
	const struct pen_vec3 towards = pen_madd(origin, rays->tfar[lane], direction);
	struct own_point point;
	float moving[3][4];
	const float(*world)[4] = shape->world;
	float error;

	if (shape->placement_count == 0) {
		point = own_point_of(geometry, model, packet, lane, towards);
		error = ERROR_SHARE * point.reach;
	} else {
		if (shape->placement_count > 1) {
			pen_trace_placement(scene->trace, id, rays->time[lane], moving);
			world = (const float(*)[4])moving;
		}
		point = own_point_of(geometry, model, packet, lane, to_own(world, towards));
		point.p = to_world(world, point.p);
		point.n = normal_to_world(world, point.n);
		point.smooth = normal_to_world(world, point.smooth);
		error = 2.0f * ERROR_SHARE *
			(stretch_of(world) * point.reach + largest(point.p) +
				largest(pen_vec3(world[0][3], world[1][3], world[2][3])));
	}
	store_point(to, lane, point.p, point.n, error);
	to->normal_x[lane] = point.smooth.x;
	to->normal_y[lane] = point.smooth.y;
	to->normal_z[lane] = point.smooth.z;
}

static void copy_normals(struct pen_points *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		to->normal_x[i] = to->facing_x[i];
		to->normal_y[i] = to->facing_y[i];
		to->normal_z[i] = to->facing_z[i];
	}
}

static void find_smooth_normals(const struct pen_geometry *geometry, const struct pen_hits *hits,
	const struct lookup *lookup, struct pen_points *to)
{
	const float *const pool = geometry->normals;
	struct corners corners;

	find_corners(geometry, lookup, &corners);
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const int wanted = (lookup->normal_offset[i] != PEN_NO_INDEX) &
				   (lookup->route[i] == PEN_ROUTE_TRIANGLE);
		const int32_t shift = (int32_t)lookup->normal_offset[i];
		const struct pen_vec3 a = pen_vertex(pool, (corners.a[i] + shift) & -wanted);
		const struct pen_vec3 b = pen_vertex(pool, (corners.b[i] + shift) & -wanted);
		const struct pen_vec3 c = pen_vertex(pool, (corners.c[i] + shift) & -wanted);
		const struct pen_vec3 n = pen_normalize(blend(a, b, c, hits->u[i], hits->v[i]));

		to->normal_x[i] = pen_pick(wanted, n.x, to->normal_x[i]);
		to->normal_y[i] = pen_pick(wanted, n.y, to->normal_y[i]);
		to->normal_z[i] = pen_pick(wanted, n.z, to->normal_z[i]);
	}
}

/*
 * Turns both normals to the ray's side. A shading normal that the ray sees from behind, or that is
 * no number, gives way to the geometric one.
 */
static void face_rays(const struct pen_rays *rays, struct pen_points *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_vec3 d = {
			rays->direction_x[i], rays->direction_y[i], rays->direction_z[i]};
		const struct pen_vec3 g = {to->facing_x[i], to->facing_y[i], to->facing_z[i]};
		const struct pen_vec3 s = {to->normal_x[i], to->normal_y[i], to->normal_z[i]};
		const int behind = pen_dot(d, g) > 0.0f;
		const float side = behind ? -1.0f : 1.0f;
		const struct pen_vec3 facing = pen_scale(g, side);
		const float turn = pen_dot(s, facing) < 0.0f ? -1.0f : 1.0f;
		const struct pen_vec3 turned = pen_scale(s, turn);
		const int seen = pen_dot(turned, d) < 0.0f;
		const float eta = to->eta[i];

		to->facing_x[i] = facing.x;
		to->facing_y[i] = facing.y;
		to->facing_z[i] = facing.z;
		to->normal_x[i] = seen ? turned.x : facing.x;
		to->normal_y[i] = seen ? turned.y : facing.y;
		to->normal_z[i] = seen ? turned.z : facing.z;
		to->eta[i] = behind ? 1.0f / eta : eta;
		to->backside[i] = behind ? UINT32_MAX : 0;
	}
}

void pen_points_find(const struct pen_render_scene *scene, const struct pen_packet *packet,
	struct pen_points *ret_points)
{
	const struct pen_geometry *geometry = &scene->geometry;
	struct lookup lookup;

	if (hits_one_shape(&packet->hits))
		look_up_one(scene, &packet->hits, ret_points, &lookup);
	else
		look_up_each(scene, &packet->hits, ret_points, &lookup);
	if (lookup.routes & PEN_ROUTE_NONE)
		for (int i = 0; i < PEN_LANES; i++)
			store_point(ret_points, i, pen_vec3(0, 0, 0), pen_vec3(0, 0, 1), 0);
	if (lookup.routes & PEN_ROUTE_TRIANGLE)
		find_triangles(geometry, &packet->hits, &lookup, ret_points);
	if (lookup.routes & PEN_ROUTE_SPHERE)
		find_spheres(geometry, &packet->rays, &lookup, ret_points);
	if (lookup.routes & PEN_ROUTE_TRAVELLER)
		find_travellers(scene, packet, &lookup, ret_points);
	copy_normals(ret_points);
	if (lookup.is_smooth)
		find_smooth_normals(geometry, &packet->hits, &lookup, ret_points);
	for (int i = 0; i < PEN_LANES && (lookup.routes & PEN_ROUTE_SLOW) != 0; i++)
		if (lookup.route[i] == PEN_ROUTE_SLOW)
			find_slowly(scene, packet, i, ret_points);
	face_rays(&packet->rays, ret_points);
}
