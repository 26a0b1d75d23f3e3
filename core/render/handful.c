/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/handful.h"

#include "core/render/sphere.h"
#include "core/render/warp.h"

#include <math.h>

/* A shape of more primitives than this is for a tree. */
enum { SHAPE_PRIMITIVES_MAX = 8 };

static struct pen_vec3 vertex(const float *pool, uint32_t index)
{
	return pen_vec3(
		pool[3 * (size_t)index], pool[3 * (size_t)index + 1], pool[3 * (size_t)index + 2]);
}

static struct pen_handful_triangle triangle_of(
	const struct pen_geometry *geometry, uint32_t shape, uint32_t primitive)
{
	const struct pen_model *model = &geometry->models[geometry->shapes[shape].model];
	const uint32_t *index = geometry->indices + 3 * (size_t)(model->first + primitive);
	struct pen_handful_triangle t = {
		.a = vertex(geometry->vertices, index[0]),
		.b = vertex(geometry->vertices, index[1]),
		.c = vertex(geometry->vertices, index[2]),
		.shape = shape,
		.primitive = primitive,
	};

	t.normal = pen_cross(pen_sub(t.b, t.a), pen_sub(t.c, t.a));
	return t;
}

static struct pen_handful_sphere sphere_of(
	const struct pen_geometry *geometry, uint32_t shape, uint32_t primitive)
{
	const struct pen_model *model = &geometry->models[geometry->shapes[shape].model];
	const struct pen_sphere *start = &geometry->spheres[model->first + primitive];
	const struct pen_sphere *end = start + (size_t)(model->step_count - 1) * model->count;

	return (struct pen_handful_sphere){
		.start = *start,
		.change = {end->x - start->x, end->y - start->y, end->z - start->z,
			end->radius - start->radius},
		.shape = shape,
		.primitive = primitive,
	};
}

static bool is_for_handful(const struct pen_shape *shape, const struct pen_model *model)
{
	const uint32_t steps_max = model->type == PEN_MODEL_SPHERES ? 2 : 1;

	return shape->placement_count == 0 && !shape->lets_pass && model->type != PEN_MODEL_DISK &&
	       model->count <= SHAPE_PRIMITIVES_MAX && model->step_count <= steps_max;
}

bool pen_handful_take(
	struct pen_handful *handful, const struct pen_geometry *geometry, uint32_t shape)
{
	const struct pen_model *model = &geometry->models[geometry->shapes[shape].model];
	const bool is_sphere = model->type == PEN_MODEL_SPHERES;
	uint32_t *count = is_sphere ? &handful->sphere_count : &handful->triangle_count;

	if (!is_for_handful(&geometry->shapes[shape], model) ||
		*count + model->count > PEN_HANDFUL_MAX)
		return false;
	for (uint32_t i = 0; i < model->count; i++, ++*count)
		if (is_sphere)
			handful->spheres[*count] = sphere_of(geometry, shape, i);
		else
			handful->triangles[*count] = triangle_of(geometry, shape, i);
	return true;
}

static void extend_box(float box[2][3], struct pen_vec3 center, float radius)
{
	const float c[3] = {center.x, center.y, center.z};

	for (int k = 0; k < 3; k++) {
		box[0][k] = fminf(box[0][k], c[k] - radius);
		box[1][k] = fmaxf(box[1][k], c[k] + radius);
	}
}

PEN_LANE struct pen_sphere sphere_at(const struct pen_handful_sphere *sphere, float time)
{
	return (struct pen_sphere){
		.x = sphere->start.x + time * sphere->change.x,
		.y = sphere->start.y + time * sphere->change.y,
		.z = sphere->start.z + time * sphere->change.z,
		.radius = sphere->start.radius + time * sphere->change.radius,
	};
}

void pen_handful_extend_box(const struct pen_handful *handful, float box[2][3])
{
	for (uint32_t i = 0; i < handful->triangle_count; i++) {
		extend_box(box, handful->triangles[i].a, 0.0f);
		extend_box(box, handful->triangles[i].b, 0.0f);
		extend_box(box, handful->triangles[i].c, 0.0f);
	}
	for (uint32_t i = 0; i < 2 * handful->sphere_count; i++) {
		const struct pen_sphere s = sphere_at(&handful->spheres[i / 2], (float)(i % 2));

		extend_box(box, pen_vec3(s.x, s.y, s.z), s.radius);
	}
}

/* Where sixteen rays meet one primitive. */
struct meeting {
	_Alignas(64) float distance[PEN_LANES]; /* INFINITY: they don't */
	float u[PEN_LANES];
	float v[PEN_LANES];
};

static struct pen_vec3 origin_of(const struct pen_rays *rays, int lane)
{
	return pen_vec3(rays->origin_x[lane], rays->origin_y[lane], rays->origin_z[lane]);
}

static struct pen_vec3 direction_of(const struct pen_rays *rays, int lane)
{
	return pen_vec3(rays->direction_x[lane], rays->direction_y[lane], rays->direction_z[lane]);
}

/* Distances to a triangle's plane; false when no ray meets it on its way. */
static bool meet_plane(const struct pen_handful_triangle *triangle, const struct pen_rays *rays,
	float ret_distances[PEN_LANES])
{
	const struct pen_vec3 a = triangle->a;
	const struct pen_vec3 normal = triangle->normal;
	int32_t any = 0;

#pragma omp simd reduction(| : any)
	for (int i = 0; i < PEN_LANES; i++) {
		const float height = pen_dot(pen_sub(a, origin_of(rays, i)), normal);
		const float distance = height / pen_dot(direction_of(rays, i), normal);
		const int is_met = (distance >= rays->tnear[i]) & (distance < rays->tfar[i]);

		ret_distances[i] = is_met ? distance : INFINITY;
		any |= is_met;
	}
	return any != 0;
}

/* Two axes across each ray, in which it is the origin: found when they are first needed. */
struct frames {
	bool are_known;
	_Alignas(64) float tx[PEN_LANES];
	float ty[PEN_LANES];
	float tz[PEN_LANES];
	float bx[PEN_LANES];
	float by[PEN_LANES];
	float bz[PEN_LANES];
};

static void find_frames(struct frames *frames, const struct pen_rays *rays)
{
	frames->are_known = true;
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_basis basis = pen_basis(pen_normalize(direction_of(rays, i)));

		frames->tx[i] = basis.t.x;
		frames->ty[i] = basis.t.y;
		frames->tz[i] = basis.t.z;
		frames->bx[i] = basis.b.x;
		frames->by[i] = basis.b.y;
		frames->bz[i] = basis.b.z;
	}
}

PEN_LANE struct pen_vec2 seen_by(const struct frames *frames, int lane, struct pen_vec3 v)
{
	return (struct pen_vec2){
		pen_dot(v, pen_vec3(frames->tx[lane], frames->ty[lane], frames->tz[lane])),
		pen_dot(v, pen_vec3(frames->bx[lane], frames->by[lane], frames->bz[lane])),
	};
}

/* On which side of the line through two points the origin lies: the true sign, or 0. */
PEN_LANE float side_of(struct pen_vec2 a, struct pen_vec2 b)
{
	return a.x * b.y - a.y * b.x;
}

/*
 * In two dimensions (Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection"): where a
 * ray sees a vertex is the same in every triangle, and no edge gets a wrong sign, so that nothing
 * slips through edges or corners.
 */
static bool meet_triangle(const struct pen_handful_triangle *triangle, const struct pen_rays *rays,
	struct frames *frames, struct meeting *ret)
{
	const struct pen_handful_triangle t = *triangle;
	int32_t any = 0;

	if (!meet_plane(triangle, rays, ret->distance))
		return false;
	if (!frames->are_known)
		find_frames(frames, rays);
#pragma omp simd reduction(| : any)
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_vec3 o = origin_of(rays, i);
		const struct pen_vec2 a = seen_by(frames, i, pen_sub(t.a, o));
		const struct pen_vec2 b = seen_by(frames, i, pen_sub(t.b, o));
		const struct pen_vec2 c = seen_by(frames, i, pen_sub(t.c, o));
		const float at_a = side_of(b, c);
		const float at_b = side_of(c, a);
		const float at_c = side_of(a, b);
		const float sum = at_a + at_b + at_c;
		const float least = pen_min(pen_min(at_a, at_b), at_c);
		const float most = pen_max(pen_max(at_a, at_b), at_c);
		const int is_met = ((least >= 0.0f) | (most <= 0.0f)) & (sum != 0.0f);
		const float share = 1.0f / sum;

		ret->distance[i] = is_met ? ret->distance[i] : INFINITY;
		ret->u[i] = at_b * share;
		ret->v[i] = at_c * share;
		any |= is_met;
	}
	return any != 0;
}

/* What of sixteen rays all spheres share: 1 / direction^2. */
struct slopes {
	_Alignas(64) float inv_a[PEN_LANES];
};

static void slopes_init(struct slopes *slopes, const struct pen_rays *rays)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		slopes->inv_a[i] = 1.0f / pen_dot(direction_of(rays, i), direction_of(rays, i));
}

/* How sixteen rays pass one sphere, see struct pen_passage. */
struct passages {
	_Alignas(64) float middle[PEN_LANES];
	float gap2[PEN_LANES];
	float outside2[PEN_LANES]; /* from^2 less radius^2 */
};

/*
 * False when no ray meets the sphere: one that is outside and has the closest point behind it
 * does not. is_still is a constant where this is inlined.
 */
PEN_LANE bool pass_sphere(const struct pen_handful_sphere *sphere, bool is_still,
	const struct pen_rays *rays, const struct slopes *slopes, struct passages *ret)
{
	const struct pen_handful_sphere s = *sphere;
	int32_t any = 0;

#pragma omp simd reduction(| : any)
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_sphere at = is_still ? s.start : sphere_at(&s, rays->time[i]);
		const struct pen_passage p = pen_sphere_passage_by(
			at, origin_of(rays, i), direction_of(rays, i), slopes->inv_a[i]);
		const float outside2 = pen_dot(p.from, p.from) - at.radius * at.radius;

		ret->middle[i] = p.middle;
		ret->gap2[i] = p.gap2;
		ret->outside2[i] = outside2;
		any |= (p.gap2 >= 0.0f) & ((p.middle >= 0.0f) | (outside2 <= 0.0f));
	}
	return any != 0;
}

static bool meet_sphere(const struct pen_handful_sphere *sphere, const struct pen_rays *rays,
	const struct slopes *slopes, float ret_distances[PEN_LANES])
{
	const struct pen_sphere *change = &sphere->change;
	const bool is_still =
		change->x == 0 && change->y == 0 && change->z == 0 && change->radius == 0;
	struct passages passages;

	if (!(is_still ? pass_sphere(sphere, true, rays, slopes, &passages)
		       : pass_sphere(sphere, false, rays, slopes, &passages)))
		return false;
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		ret_distances[i] = pen_sphere_root(passages.gap2[i], passages.middle[i],
			passages.outside2[i], slopes->inv_a[i], rays->tnear[i]);
	return true;
}

static void keep_closer_sphere(const float distances[PEN_LANES], uint32_t shape, uint32_t primitive,
	struct pen_packet *packet)
{
	struct pen_rays *rays = &packet->rays;
	struct pen_hits *hits = &packet->hits;

#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const int is_closer = distances[i] < rays->tfar[i];

		rays->tfar[i] = pen_pick(is_closer, distances[i], rays->tfar[i]);
		hits->primitive[i] = pen_pick_bits(is_closer, primitive, hits->primitive[i]);
		hits->geometry[i] = pen_pick_bits(is_closer, shape, hits->geometry[i]);
	}
}

static void keep_closer(
	const struct meeting *from, uint32_t shape, uint32_t primitive, struct pen_packet *packet)
{
	struct pen_hits *hits = &packet->hits;

#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const int is_closer = from->distance[i] < packet->rays.tfar[i];

		hits->u[i] = pen_pick(is_closer, from->u[i], hits->u[i]);
		hits->v[i] = pen_pick(is_closer, from->v[i], hits->v[i]);
	}
	keep_closer_sphere(from->distance, shape, primitive, packet);
}

void pen_handful_closest(const struct pen_handful *handful, struct pen_packet *packet)
{
	struct meeting meeting;
	struct slopes slopes;
	struct frames frames;

	frames.are_known = false;
	for (uint32_t k = 0; k < handful->triangle_count; k++) {
		const struct pen_handful_triangle *t = &handful->triangles[k];

		if (meet_triangle(t, &packet->rays, &frames, &meeting))
			keep_closer(&meeting, t->shape, t->primitive, packet);
	}
	if (handful->sphere_count > 0)
		slopes_init(&slopes, &packet->rays);
	for (uint32_t k = 0; k < handful->sphere_count; k++) {
		const struct pen_handful_sphere *s = &handful->spheres[k];

		if (meet_sphere(s, &packet->rays, &slopes, meeting.distance))
			keep_closer_sphere(meeting.distance, s->shape, s->primitive, packet);
	}
}

/* Ends the rays that meet something on their way; returns whether any are left. */
static bool end_met(const float distances[PEN_LANES], struct pen_rays *rays)
{
	int32_t left = 0;

#pragma omp simd reduction(| : left)
	for (int i = 0; i < PEN_LANES; i++) {
		const int is_met = distances[i] < rays->tfar[i];

		rays->tfar[i] = is_met ? -INFINITY : rays->tfar[i];
		left |= rays->tfar[i] >= rays->tnear[i];
	}
	return left != 0;
}

bool pen_handful_occluded(const struct pen_handful *handful, struct pen_rays *rays)
{
	struct meeting meeting;
	struct slopes slopes;
	struct frames frames;

	frames.are_known = false;
	if (handful->sphere_count > 0)
		slopes_init(&slopes, rays);
	for (uint32_t k = 0; k < handful->sphere_count; k++)
		if (meet_sphere(&handful->spheres[k], rays, &slopes, meeting.distance) &&
			!end_met(meeting.distance, rays))
			return false;
	for (uint32_t k = 0; k < handful->triangle_count; k++)
		if (meet_triangle(&handful->triangles[k], rays, &frames, &meeting) &&
			!end_met(meeting.distance, rays))
			return false;
	return true;
}
