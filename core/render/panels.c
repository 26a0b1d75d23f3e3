/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/panels.h"

#include "core/base/limits.h"
#include "core/render/emitters.h"
#include "core/render/vertex.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* How far points may be off a plane or a line, as a share of their coordinates. */
#define TOLERANCE 2e-6f

/* Neighbours whose normals have this cosine may be of one plane. */
#define COS_LEVEL 0.99999f

/* A corner of the mesh; those at one place are one point. */
struct corner {
	float at[3];
	uint32_t number; /* 3 * triangle + 0, 1 or 2 */
};

/* The side of a triangle that begins at a corner, by the points where it ends. */
struct side {
	uint32_t low, high, corner;
	bool is_downward; /* from high to low */
};

struct plate {
	struct pen_vec3 axis;
	float area;
};

/* A shape's triangles and what they have to do with each other. */
struct tiling {
	const struct pen_render_scene *scene;
	const struct pen_shape *shape;
	uint32_t count;
	struct corner *corners;
	uint32_t *points; /* of each corner */
	struct side *sides;
	bool *is_inner; /* of each corner's side: another triangle of its plane goes on there */
	struct plate *plates;
	uint32_t *parents; /* of each triangle, towards the first of all that hang together */
	uint32_t *order;   /* triangles that hang together one after the other */
};

/* Where a rectangle may be: a frame, and the bounds in it. */
struct frame {
	struct pen_vec3 origin, u, v, axis;
	float lower[3], upper[3]; /* along u, v and axis */
	float tolerance;
};

static const uint32_t *corners_of(const struct tiling *tiling, uint32_t triangle)
{
	const struct pen_geometry *geometry = &tiling->scene->geometry;
	const struct pen_model *model = &geometry->models[tiling->shape->model];

	return geometry->indices + 3 * (size_t)(model->first + triangle);
}

/* Where a corner is in the model, in which one point has the same bits for all its triangles. */
static struct pen_vec3 local_corner(const struct tiling *tiling, uint32_t corner)
{
	const struct pen_vec3 p = pen_vertex(tiling->scene->geometry.vertices,
		(int32_t)corners_of(tiling, corner / 3)[corner % 3]);

	return pen_add(p, pen_vec3(0.0f, 0.0f, 0.0f)); /* -0 is 0 */
}

static struct pen_vec3 world_corner(const struct tiling *tiling, uint32_t corner)
{
	const struct pen_vec3 p = local_corner(tiling, corner);
	const float(*m)[4] = tiling->shape->world;

	if (tiling->shape->placement_count == 0)
		return p;
	return pen_add(pen_linear(m, p), pen_vec3(m[0][3], m[1][3], m[2][3]));
}

static uint32_t next_corner(uint32_t corner)
{
	return corner % 3 == 2 ? corner - 2 : corner + 1;
}

static int by_place(const void *left, const void *right)
{
	const struct corner *a = left, *b = right;

	for (int k = 0; k < 3; k++)
		if (a->at[k] != b->at[k])
			return a->at[k] < b->at[k] ? -1 : 1;
	return a->number < b->number ? -1 : a->number > b->number;
}

static int by_ends(const void *left, const void *right)
{
	const struct side *a = left, *b = right;

	if (a->low != b->low)
		return a->low < b->low ? -1 : 1;
	if (a->high != b->high)
		return a->high < b->high ? -1 : 1;
	return a->corner < b->corner ? -1 : a->corner > b->corner;
}

static void find_points(struct tiling *tiling)
{
	const uint32_t count = 3 * tiling->count;
	uint32_t point = 0;

	for (uint32_t i = 0; i < count; i++) {
		const struct pen_vec3 p = local_corner(tiling, i);

		tiling->corners[i] = (struct corner){{p.x, p.y, p.z}, i};
	}
	qsort(tiling->corners, count, sizeof *tiling->corners, by_place);
	for (uint32_t i = 0; i < count; i++) {
		const float *at = tiling->corners[i].at,
			    *last = tiling->corners[i > 0 ? i - 1 : 0].at;

		if (at[0] != last[0] || at[1] != last[1] || at[2] != last[2])
			point = i;
		tiling->points[tiling->corners[i].number] = point;
	}
}

static void find_sides(struct tiling *tiling)
{
	const uint32_t count = 3 * tiling->count;

	for (uint32_t i = 0; i < count; i++) {
		const uint32_t from = tiling->points[i], to = tiling->points[next_corner(i)];

		tiling->sides[i] = (struct side){
			.low = from < to ? from : to,
			.high = from < to ? to : from,
			.corner = i,
			.is_downward = from > to,
		};
	}
	qsort(tiling->sides, count, sizeof *tiling->sides, by_ends);
}

static void find_plates(struct tiling *tiling, uint32_t shape)
{
	for (uint32_t i = 0; i < tiling->count; i++) {
		const struct pen_emitter emitter = {shape, i};
		struct pen_light light;

		pen_emitter_place(tiling->scene, &emitter, 0.0f, &light);
		tiling->plates[i] = (struct plate){light.axis, light.area};
		tiling->parents[i] = i;
	}
}

static uint32_t root_of(const struct tiling *tiling, uint32_t triangle)
{
	while (tiling->parents[triangle] != triangle) {
		tiling->parents[triangle] = tiling->parents[tiling->parents[triangle]];
		triangle = tiling->parents[triangle];
	}
	return triangle;
}

static void join(struct tiling *tiling, uint32_t a, uint32_t b)
{
	const uint32_t root_a = root_of(tiling, a), root_b = root_of(tiling, b);

	tiling->parents[root_a > root_b ? root_a : root_b] = root_a < root_b ? root_a : root_b;
}

/* Where just two triangles meet, one along the side and one back, and lie in one plane. */
static void join_neighbours(struct tiling *tiling)
{
	const uint32_t count = 3 * tiling->count;
	uint32_t end;

	for (uint32_t i = 0; i < count; i = end) {
		const struct side *side = &tiling->sides[i];
		uint32_t a, b;

		for (end = i + 1; end < count && tiling->sides[end].low == side->low &&
				  tiling->sides[end].high == side->high;
			end++)
			continue;
		if (end != i + 2 || side[0].is_downward == side[1].is_downward)
			continue;
		a = side[0].corner / 3;
		b = side[1].corner / 3;
		if (!(pen_dot(tiling->plates[a].axis, tiling->plates[b].axis) > COS_LEVEL))
			continue;
		join(tiling, a, b);
		tiling->is_inner[side[0].corner] = tiling->is_inner[side[1].corner] = true;
	}
}

/* By their roots, whose numbers are the least among theirs: a counting sort. */
static void sort_by_root(struct tiling *tiling, uint32_t *ends)
{
	uint32_t sum = 0;

	for (uint32_t i = 0; i < tiling->count; i++)
		ends[root_of(tiling, i)]++;
	for (uint32_t i = 0; i < tiling->count; i++) {
		const uint32_t own = ends[i];

		ends[i] = sum;
		sum += own;
	}
	for (uint32_t i = 0; i < tiling->count; i++)
		tiling->order[ends[root_of(tiling, i)]++] = i;
}

static void extend(struct frame *frame, struct pen_vec3 p)
{
	const struct pen_vec3 to = pen_sub(p, frame->origin);
	const float at[3] = {
		pen_dot(to, frame->u), pen_dot(to, frame->v), pen_dot(to, frame->axis)};
	const float most = pen_max(pen_max(fabsf(p.x), fabsf(p.y)), fabsf(p.z));

	for (int k = 0; k < 3; k++) {
		frame->lower[k] = pen_min(frame->lower[k], at[k]);
		frame->upper[k] = pen_max(frame->upper[k], at[k]);
	}
	frame->tolerance = pen_max(frame->tolerance, TOLERANCE * most);
}

/* Along the longest side of the border, which of a rectangle is a part of an edge. */
static bool find_frame(
	const struct tiling *tiling, const uint32_t *triangles, uint32_t count, struct frame *ret)
{
	const struct plate *largest = &tiling->plates[triangles[0]];
	struct frame frame = {.origin = {0.0f, 0.0f, 0.0f}};
	float longest = 0.0f;

	for (uint32_t i = 0; i < 3 * count; i++) {
		const uint32_t corner = 3 * triangles[i / 3] + i % 3;
		const struct pen_vec3 from = world_corner(tiling, corner);
		const struct pen_vec3 along =
			pen_sub(world_corner(tiling, next_corner(corner)), from);
		const float length = pen_length(along);

		if (tiling->plates[triangles[i / 3]].area > largest->area)
			largest = &tiling->plates[triangles[i / 3]];
		if (tiling->is_inner[corner] || !(length > longest))
			continue;
		longest = length;
		frame.origin = from;
		frame.u = along;
	}
	if (!(longest > 0.0f))
		return false;
	frame.axis = largest->axis;
	frame.u = pen_normalize(pen_madd(frame.u, -pen_dot(frame.u, frame.axis), frame.axis));
	frame.v = pen_cross(frame.axis, frame.u);
	for (uint32_t i = 0; i < 3 * count; i++)
		extend(&frame, world_corner(tiling, 3 * triangles[i / 3] + i % 3));
	*ret = frame;
	return true;
}

static bool is_on(float a, float b, float line, float tolerance)
{
	return fabsf(a - line) <= tolerance && fabsf(b - line) <= tolerance;
}

/* Whether the side that begins at a corner lies on one of the four edges. */
static bool is_on_edge(const struct tiling *tiling, const struct frame *frame, uint32_t corner)
{
	const struct pen_vec3 from = pen_sub(world_corner(tiling, corner), frame->origin);
	const struct pen_vec3 to =
		pen_sub(world_corner(tiling, next_corner(corner)), frame->origin);
	const float x[2] = {pen_dot(from, frame->u), pen_dot(to, frame->u)};
	const float y[2] = {pen_dot(from, frame->v), pen_dot(to, frame->v)};
	const float near = frame->tolerance;

	return is_on(x[0], x[1], frame->lower[0], near) ||
	       is_on(x[0], x[1], frame->upper[0], near) ||
	       is_on(y[0], y[1], frame->lower[1], near) || is_on(y[0], y[1], frame->upper[1], near);
}

/*
 * Triangles of one orientation cover a point of their plane as often as their sides wind about it,
 * and inner sides cancel. So if the others lie on a rectangle's edges all its points are covered
 * equally often: once, if the areas agree.
 */
static bool is_tiled(const struct tiling *tiling, const uint32_t *triangles, uint32_t count,
	const struct frame *frame)
{
	const float width = frame->upper[0] - frame->lower[0];
	const float height = frame->upper[1] - frame->lower[1];
	double area = 0.0;

	if (frame->upper[2] > frame->tolerance || frame->lower[2] < -frame->tolerance ||
		!(pen_min(width, height) > 100.0f * frame->tolerance))
		return false;
	for (uint32_t i = 0; i < count; i++) {
		const struct plate *plate = &tiling->plates[triangles[i]];

		if (!(pen_dot(plate->axis, frame->axis) > COS_LEVEL))
			return false;
		area += (double)plate->area;
	}
	if (!(fabs(area - (double)(width * height)) <= 1e-3 * area))
		return false;
	for (uint32_t i = 0; i < 3 * count; i++) {
		const uint32_t corner = 3 * triangles[i / 3] + i % 3;

		if (!tiling->is_inner[corner] && !is_on_edge(tiling, frame, corner))
			return false;
	}
	return true;
}

static struct pen_light light_of(const struct pen_material *material, const struct frame *frame)
{
	const float width = frame->upper[0] - frame->lower[0];
	const float height = frame->upper[1] - frame->lower[1];

	return (struct pen_light){
		.type = PEN_LIGHT_RECTANGLE,
		.back = material->is_one_sided ? 1.0f : -1.0f,
		.color = {material->emission[0], material->emission[1], material->emission[2]},
		.origin = pen_madd(pen_madd(frame->origin, frame->lower[0], frame->u),
			frame->lower[1], frame->v),
		.axis = frame->axis,
		.edge_u = frame->u,
		.edge_v = frame->v,
		.length_u = width,
		.length_v = height,
		.area = width * height,
	};
}

static int append(struct pen_panels *panels, struct pen_light light, struct pen_error *err)
{
	struct pen_light *items = panels->items;

	if (panels->count == panels->capacity) {
		panels->capacity = panels->capacity > 0 ? 2 * panels->capacity : 16;
		items = realloc(items, panels->capacity * sizeof *items);
		if (!items)
			return pen_error_memory(err);
		panels->items = items;
	}
	items[panels->count++] = light;
	return 0;
}

static int add_rectangles(struct tiling *tiling, struct pen_panels *panels, uint32_t first,
	uint32_t *numbers, struct pen_error *err)
{
	const struct pen_material *material = &tiling->scene->materials[tiling->shape->surface];
	uint32_t end;
	int r = 0;

	for (uint32_t i = 0; i < tiling->count && r == 0; i = end) {
		const uint32_t *triangles = tiling->order + i;
		const uint32_t root = root_of(tiling, *triangles);
		struct frame frame;

		for (end = i + 1;
			end < tiling->count && root_of(tiling, tiling->order[end]) == root; end++)
			continue;
		if (end == i + 1 || !find_frame(tiling, triangles, end - i, &frame) ||
			!is_tiled(tiling, triangles, end - i, &frame))
			continue;
		for (uint32_t k = i; k < end; k++)
			numbers[tiling->order[k]] = first + panels->count;
		r = append(panels, light_of(material, &frame), err);
	}
	return r;
}

static bool shines_evenly(const struct pen_material *material)
{
	return !material->inputs[PEN_INPUT_EMISSION].mipmap &&
	       material->alpha_mode == PEN_ALPHA_OPAQUE &&
	       (material->clearcoat <= 0.0f || material->is_additive);
}

static void tiling_finish(struct tiling *tiling)
{
	free(tiling->corners);
	free(tiling->points);
	free(tiling->sides);
	free(tiling->is_inner);
	free(tiling->plates);
	free(tiling->parents);
	free(tiling->order);
}

int pen_panels_find(struct pen_panels *panels, const struct pen_render_scene *scene, uint32_t shape,
	uint32_t first, uint32_t *numbers, struct pen_error *err)
{
	const struct pen_shape *placed = &scene->geometry.shapes[shape];
	const struct pen_model *model = &scene->geometry.models[placed->model];
	const size_t count = model->count;
	struct tiling tiling = {.scene = scene, .shape = placed, .count = model->count};
	uint32_t *ends = NULL;
	int r = 0;

	if (model->type != PEN_MODEL_TRIANGLES || model->step_count > 1 ||
		placed->placement_count > 1 || count < 2 ||
		!shines_evenly(&scene->materials[placed->surface]))
		return 0;
	panels->seen += count;
	if (panels->seen > PEN_PANEL_TRIANGLES_MAX)
		return 0;
	tiling.corners = malloc(3 * count * sizeof *tiling.corners);
	tiling.points = malloc(3 * count * sizeof *tiling.points);
	tiling.sides = malloc(3 * count * sizeof *tiling.sides);
	tiling.is_inner = calloc(3 * count, sizeof *tiling.is_inner);
	tiling.plates = malloc(count * sizeof *tiling.plates);
	tiling.parents = malloc(count * sizeof *tiling.parents);
	tiling.order = malloc(count * sizeof *tiling.order);
	ends = calloc(count, sizeof *ends);
	if (!tiling.corners || !tiling.points || !tiling.sides || !tiling.is_inner ||
		!tiling.plates || !tiling.parents || !tiling.order || !ends) {
		r = pen_error_memory(err);
		goto out;
	}
	find_plates(&tiling, shape);
	find_points(&tiling);
	find_sides(&tiling);
	join_neighbours(&tiling);
	sort_by_root(&tiling, ends);
	r = add_rectangles(&tiling, panels, first, numbers, err);
out:
	free(ends);
	tiling_finish(&tiling);
	return r;
}

void pen_panels_finish(struct pen_panels *panels)
{
	free(panels->items);
	*panels = (struct pen_panels){.count = 0};
}
