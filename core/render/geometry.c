/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/geometry.h"

#include "core/base/limits.h"
#include "core/render/layout.h"
#include "core/render/light_shape.h"
#include "core/render/mesh_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool within_bounds(const double p[3])
{
	return fabs(p[0]) <= PEN_COORDINATE_MAX && fabs(p[1]) <= PEN_COORDINATE_MAX &&
	       fabs(p[2]) <= PEN_COORDINATE_MAX;
}

/* The factor by which a similarity scales lengths; 0 for any other transform. */
static double similarity_scale(const struct pen_affine *a)
{
	double dot[3][3];

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			dot[i][j] = a->m[0][i] * a->m[0][j] + a->m[1][i] * a->m[1][j] +
				    a->m[2][i] * a->m[2][j];
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			if (fabs(dot[i][j] - (i == j ? dot[0][0] : 0.0)) > 1e-9 * dot[0][0])
				return 0.0;
	return sqrt(dot[0][0]);
}

static int add_placed_sphere(struct pen_layout *l, uint32_t index, double time)
{
	const struct pen_object_desc *object = &l->scene->objects[index];
	const struct pen_affine world = pen_motion_world(l->scene, object, time);
	const double radius = similarity_scale(&world) * object->u.sphere.radius;
	double center[3];

	pen_affine_point(&world, object->u.sphere.center, center);
	if (!within_bounds(center))
		return pen_mesh_model_error(l, index, "reaches beyond the largest coordinate");
	if (!((float)radius > 0.0f))
		return pen_mesh_model_error(l, index, "has a radius too small to see");
	return pen_layout_add_sphere(l, center, radius);
}

/* Whether a sphere's image stays a sphere whose centre moves straight from step to step. */
static bool sphere_only_travels(const struct pen_layout *l, uint32_t index, uint32_t steps)
{
	const struct pen_object_desc *object = &l->scene->objects[index];
	const double *c = object->u.sphere.center;
	const bool centred = c[0] == 0.0 && c[1] == 0.0 && c[2] == 0.0;

	for (uint32_t i = 0; i < steps; i++) {
		const struct pen_affine world =
			pen_motion_world(l->scene, object, pen_shutter_time(&l->shutter, i, steps));

		if (similarity_scale(&world) == 0.0)
			return false;
	}
	for (uint32_t i = 1; i < object->key_count && !centred; i++)
		if (memcmp(object->keys[i].pose.rotate, object->keys[0].pose.rotate,
			    sizeof object->keys[0].pose.rotate) != 0)
			return false;
	return true;
}

/* Whether an object loses its volume, or its handedness, at some step. */
static bool is_flattened(const struct pen_layout *l, uint32_t index, uint32_t steps)
{
	const struct pen_object_desc *object = &l->scene->objects[index];
	double sign = 0.0;

	for (uint32_t i = 0; i < steps; i++) {
		const struct pen_affine world =
			pen_motion_world(l->scene, object, pen_shutter_time(&l->shutter, i, steps));
		const double determinant = pen_affine_determinant(&world);

		if (pen_affine_is_singular(&world) || sign * determinant < 0.0)
			return true;
		sign = determinant < 0.0 ? -1.0 : 1.0;
	}
	return false;
}

/* The object that an object shows: itself, or what it is an instance of. */
static uint32_t original_of(const struct pen_scene *scene, uint32_t index)
{
	const struct pen_object_desc *object = &scene->objects[index];

	return object->type == PEN_OBJECT_INSTANCE ? object->u.instance.of : index;
}

static uint32_t surface_of(const struct pen_scene *scene, uint32_t index)
{
	const uint32_t own = scene->objects[index].material;

	return own != PEN_NO_INDEX ? own : scene->objects[original_of(scene, index)].material;
}

/* The model of an object in its own coordinates, made once. */
static int own_model(struct pen_layout *l, uint32_t index, uint32_t *ret_model)
{
	const struct pen_object_desc *object = &l->scene->objects[index];
	int r;

	if (l->own_models[index] == PEN_NO_INDEX && object->type == PEN_OBJECT_MESH) {
		r = pen_mesh_model_add(l, index, PEN_NO_INDEX, 1, &l->own_models[index]);
		if (r < 0)
			return r;
	} else if (l->own_models[index] == PEN_NO_INDEX) {
		const struct pen_model model = {
			.type = PEN_MODEL_SPHERES,
			.first = pen_layout_count(&l->spheres, sizeof(struct pen_sphere)),
			.count = 1,
			.step_count = 1,
		};

		r = pen_layout_add_sphere(l, object->u.sphere.center, object->u.sphere.radius);
		if (r < 0)
			return r;
		r = pen_layout_add_model(l, &model, &l->own_models[index]);
		if (r < 0)
			return r;
	}
	*ret_model = l->own_models[index];
	return 0;
}

static int add_placements(
	struct pen_layout *l, uint32_t index, uint32_t steps, struct pen_shape *shape)
{
	const struct pen_object_desc *object = &l->scene->objects[index];
	struct pen_placement *to;
	struct pen_affine world = pen_motion_world(l->scene, object, l->shutter.open);

	shape->placement_first = pen_layout_count(&l->placements, sizeof *to);
	shape->placement_count = steps;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			shape->world[i][j] = (float)world.m[i][j];
	to = pen_layout_extend(l, &l->placements, steps, sizeof *to);
	if (!to)
		return PEN_ELIMIT;
	for (uint32_t i = 0; i < steps; i++) {
		double cosine = 0.0;

		world = pen_motion_world(l->scene, object, pen_shutter_time(&l->shutter, i, steps));
		if (!within_bounds((double[3]){world.m[0][3], world.m[1][3], world.m[2][3]}))
			return pen_mesh_model_error(
				l, index, "reaches beyond the largest coordinate");
		to[i] = pen_affine_decompose(&world);
		for (int k = 0; k < 4 && i > 0; k++)
			cosine += to[i].rotate[k] * to[i - 1].rotate[k];
		for (int k = 0; k < 4 && cosine < 0.0; k++)
			to[i].rotate[k] = -to[i].rotate[k];
	}
	return 0;
}

/* What cannot stand in world coordinates once and for all. */
static int add_instance(struct pen_layout *l, uint32_t index, uint32_t steps)
{
	struct pen_shape shape = {.surface = surface_of(l->scene, index)};
	int r = own_model(l, original_of(l->scene, index), &shape.model);

	if (r == 0)
		r = add_placements(l, index, steps, &shape);
	if (r == 0)
		r = pen_layout_add_shape(l, &shape);
	return r;
}

static int add_travelling_sphere(struct pen_layout *l, uint32_t index, uint32_t steps)
{
	const struct pen_model model = {
		.type = PEN_MODEL_SPHERES,
		.first = pen_layout_count(&l->spheres, sizeof(struct pen_sphere)),
		.count = 1,
		.step_count = steps,
	};
	struct pen_shape shape = {.surface = l->scene->objects[index].material};

	for (uint32_t i = 0; i < steps; i++) {
		const int r = add_placed_sphere(l, index, pen_shutter_time(&l->shutter, i, steps));

		if (r < 0)
			return r;
	}
	if (pen_layout_add_model(l, &model, &shape.model) < 0)
		return PEN_ELIMIT;
	return pen_layout_add_shape(l, &shape);
}

/* A mesh in world coordinates: one that stands still, or that no placement can show. */
static int add_world_mesh(struct pen_layout *l, uint32_t index, uint32_t steps)
{
	struct pen_shape shape = {.surface = surface_of(l->scene, index)};
	const int r =
		pen_mesh_model_add(l, original_of(l->scene, index), index, steps, &shape.model);

	return r < 0 ? r : pen_layout_add_shape(l, &shape);
}

/* What holds an object's original; found once. */
static const struct pen_box *box_of(struct pen_layout *l, uint32_t original)
{
	static const struct pen_box unknown;
	struct pen_box *box = &l->boxes[original];

	if (memcmp(box, &unknown, sizeof unknown) == 0)
		*box = pen_motion_box(&l->scene->objects[original]);
	return box;
}

/* Adds an object, unless it is a sphere at rest: those are left to add_static_spheres. */
static int add_object(struct pen_layout *l, uint32_t index, bool *ret_left)
{
	const struct pen_object_desc *object = &l->scene->objects[index];
	const struct pen_box *box =
		object->node != PEN_NO_INDEX ? box_of(l, original_of(l->scene, index)) : NULL;
	const uint32_t steps = pen_motion_steps(l->scene, object, box, &l->shutter);

	if (is_flattened(l, index, steps)) {
		if (object->node != PEN_NO_INDEX)
			return add_world_mesh(l, index, steps);
		return pen_mesh_model_error(l, index,
			"is flattened by its transform at some time; make every scale non-zero "
			"and of one sign");
	}
	if (object->type == PEN_OBJECT_SPHERE && sphere_only_travels(l, index, steps)) {
		*ret_left = steps == 1;
		return steps == 1 ? 0 : add_travelling_sphere(l, index, steps);
	}
	if (object->type == PEN_OBJECT_MESH && steps == 1 &&
		(l->part != PEN_GEOMETRY_FRAME || !pen_motion_mesh_is_rigid(object)))
		return add_world_mesh(l, index, 1);
	return add_instance(l, index, steps);
}

/* One shape for all of a material: spheres are the material's own, in the order of the scene. */
static int add_static_spheres(struct pen_layout *l, const uint32_t *objects, uint32_t count)
{
	const struct pen_model model = {
		.type = PEN_MODEL_SPHERES,
		.first = pen_layout_count(&l->spheres, sizeof(struct pen_sphere)),
		.count = count,
		.step_count = 1,
	};
	struct pen_shape shape = {.surface = l->scene->objects[objects[0]].material};

	for (uint32_t i = 0; i < count; i++) {
		const int r = add_placed_sphere(l, objects[i], l->shutter.open);

		if (r < 0)
			return r;
	}
	if (pen_layout_add_model(l, &model, &shape.model) < 0)
		return PEN_ELIMIT;
	return pen_layout_add_shape(l, &shape);
}

struct resting {
	uint32_t material, object;
};

static int compare_resting(const void *a, const void *b)
{
	const struct resting *x = a, *y = b;

	if (x->material != y->material)
		return x->material < y->material ? -1 : 1;
	return x->object < y->object ? -1 : x->object > y->object;
}

/* Makes the model of something that moves but keeps its form, for all frames. */
static int share_model(struct pen_layout *l, uint32_t index)
{
	const struct pen_object_desc *object = &l->scene->objects[index];
	const uint32_t of = object->type == PEN_OBJECT_INSTANCE ? object->u.instance.of : index;
	uint32_t model;

	if (l->scene->objects[of].type != PEN_OBJECT_MESH ||
		!pen_motion_mesh_is_rigid(&l->scene->objects[of]))
		return 0;
	return own_model(l, of, &model);
}

/* Adds what of an object belongs to the part that is being laid out. */
static int add_part(struct pen_layout *l, uint32_t index, bool *ret_left)
{
	const bool rests = pen_motion_rests(l->scene, &l->scene->objects[index]);

	if (l->part == PEN_GEOMETRY_ALL || rests == (l->part == PEN_GEOMETRY_SHARED))
		return add_object(l, index, ret_left);
	return l->part == PEN_GEOMETRY_SHARED ? share_model(l, index) : 0;
}

static int add_objects(struct pen_layout *l)
{
	const uint32_t count = l->scene->object_count;
	struct resting *resting = calloc(count + 1, sizeof *resting);
	uint32_t *objects = calloc(count + 1, sizeof *objects);
	uint32_t resting_count = 0;
	int r = resting && objects ? 0 : pen_error_memory(l->err);

	for (uint32_t i = 0; i < count && r == 0; i++) {
		bool left = false;

		if (!l->scene->objects[i].visible)
			continue;
		r = add_part(l, i, &left);
		if (left)
			resting[resting_count++] =
				(struct resting){l->scene->objects[i].material, i};
	}
	if (resting)
		qsort(resting, resting_count, sizeof *resting, compare_resting);
	for (uint32_t i = 0, end; i < resting_count && r == 0; i = end) {
		for (end = i; end < resting_count && resting[end].material == resting[i].material;
			end++)
			objects[end - i] = resting[end].object;
		r = add_static_spheres(l, objects, end - i);
	}
	free(objects);
	free(resting);
	return r;
}

static bool light_is_in_part(const struct pen_layout *l, const struct pen_light_desc *light)
{
	const bool rests = light->node == PEN_NO_INDEX;

	return l->part == PEN_GEOMETRY_ALL || rests == (l->part == PEN_GEOMETRY_SHARED);
}

int pen_geometry_add(struct pen_layout *l, enum pen_geometry_part part)
{
	int r;

	l->part = part;
	r = add_objects(l);
	for (uint32_t i = 0; i < l->scene->light_count && r == 0; i++)
		if (l->scene->lights[i].visible && light_is_in_part(l, &l->scene->lights[i]))
			r = pen_light_shape_add(l, i);
	/* Embree reads the last vertex as four floats. */
	if (r == 0 && !pen_layout_extend(l, &l->vertices, 1, 3 * sizeof(float)))
		r = PEN_ELIMIT;
	return r;
}

int pen_geometry_init(struct pen_geometry *geometry, const struct pen_scene *scene, uint32_t frame,
	struct pen_error *err)
{
	struct pen_layout l;
	int r = pen_layout_init(&l, scene, frame, err);

	if (r == 0)
		r = pen_geometry_add(&l, PEN_GEOMETRY_ALL);
	if (r == 0)
		pen_layout_take(&l, geometry);
	pen_layout_finish(&l);
	return r;
}

void pen_geometry_finish(struct pen_geometry *geometry)
{
	free(geometry->vertices);
	free(geometry->normals);
	free(geometry->uvs);
	free(geometry->colors);
	free(geometry->tangents);
	free(geometry->indices);
	free(geometry->spheres);
	free(geometry->disks);
	free(geometry->placements);
	free(geometry->models);
	free(geometry->shapes);
}
