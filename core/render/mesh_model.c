/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/mesh_model.h"

#include "core/base/limits.h"
#include "core/render/attributes.h"
#include "core/render/deform.h"

#include <math.h>

static const struct pen_affine identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

int pen_mesh_model_error(const struct pen_layout *l, uint32_t object, const char *fault)
{
	const char *name = l->scene->objects[object].name;

	return pen_error_set(l->err, PEN_EINVALID, "object %u (%.100s) %s", object,
		name ? name : "without a name", fault);
}

/* A mesh on its way into the pools. */
struct source {
	const struct pen_object_desc *mesh;
	uint32_t index;
	uint32_t placed; /* PEN_NO_INDEX: nobody */
};

static struct pen_affine placement_at(
	const struct pen_layout *l, const struct source *source, double time)
{
	if (source->placed == PEN_NO_INDEX)
		return identity;
	return pen_motion_world(l->scene, &l->scene->objects[source->placed], time);
}

static int transform(const struct pen_layout *l, const struct source *source,
	const struct pen_affine *world, float *vertices, float *normals)
{
	for (size_t i = 0; i < source->mesh->u.mesh.vertex_count; i++) {
		float *v = vertices + 3 * i;
		const double p[3] = {(double)v[0], (double)v[1], (double)v[2]};
		double q[3];

		pen_affine_point(world, p, q);
		for (int k = 0; k < 3; k++) {
			if (!(fabs(q[k]) <= PEN_COORDINATE_MAX))
				return pen_mesh_model_error(
					l, source->index, "reaches beyond the largest coordinate");
			v[k] = (float)q[k];
		}
		if (normals) {
			const float n[3] = {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]};

			pen_affine_normal(world, n, normals + 3 * i);
		}
	}
	return 0;
}

static int add_step(struct pen_layout *l, const struct source *source, double time)
{
	const uint32_t count = source->mesh->u.mesh.vertex_count;
	const struct pen_affine world = placement_at(l, source, time);
	float *vertices = pen_layout_extend(l, &l->vertices, count, 3 * sizeof *vertices);
	float *normals = NULL;
	int r;

	if (vertices && source->mesh->u.mesh.normals)
		normals = pen_layout_extend(l, &l->normals, count, 3 * sizeof *normals);
	if (!vertices || (source->mesh->u.mesh.normals && !normals))
		return PEN_ELIMIT;
	r = pen_deform_at(l->scene, source->mesh, time, vertices, normals, l->err);
	return r < 0 ? r : transform(l, source, &world, vertices, normals);
}

/* A skin takes the vertices to the world, and so the tangents are found there. */
static int add_attributes(
	struct pen_layout *l, const struct source *source, struct pen_model *model)
{
	const struct pen_deform_desc *deform = source->mesh->u.mesh.deform;
	const struct pen_affine world = placement_at(l, source, l->shutter.open);
	struct pen_object_desc bent = *source->mesh;

	if (!deform || deform->skin == PEN_NO_INDEX)
		return pen_attributes_add(l, source->mesh, &world, model);
	bent.u.mesh.vertices = (float *)(void *)l->vertices.data + 3 * (size_t)model->vertex_first;
	bent.u.mesh.tangents = NULL;
	return pen_attributes_add(l, &bent, &world, model);
}

int pen_mesh_model_add(
	struct pen_layout *l, uint32_t mesh, uint32_t placed, uint32_t steps, uint32_t *ret_model)
{
	const struct source source = {&l->scene->objects[mesh], mesh, placed};
	const uint32_t own_steps = pen_deform_steps(l->scene, source.mesh, &l->shutter);
	const struct pen_affine world = placement_at(l, &source, l->shutter.open);
	const bool is_mirrored = (pen_affine_determinant(&world) < 0.0) !=
				 pen_deform_is_mirrored(l->scene, source.mesh, l->shutter.open);
	struct pen_model model = {
		.type = PEN_MODEL_TRIANGLES,
		.first = pen_layout_count(&l->indices, 3 * sizeof(uint32_t)),
		.count = source.mesh->u.mesh.triangle_count,
		.vertex_first = pen_layout_count(&l->vertices, 3 * sizeof(float)),
		.vertex_count = source.mesh->u.mesh.vertex_count,
		.step_count = steps > own_steps ? steps : own_steps,
		.normal_offset = PEN_NO_INDEX,
	};

	if (source.mesh->u.mesh.normals)
		model.normal_offset =
			pen_layout_count(&l->normals, 3 * sizeof(float)) - model.vertex_first;
	for (uint32_t step = 0; step < model.step_count; step++) {
		const int r =
			add_step(l, &source, pen_shutter_time(&l->shutter, step, model.step_count));

		if (r < 0)
			return r;
	}
	if (pen_layout_add_indices(l, source.mesh->u.mesh.indices, model.count, model.vertex_first,
		    is_mirrored) < 0 ||
		add_attributes(l, &source, &model) < 0)
		return PEN_ELIMIT;
	return pen_layout_add_model(l, &model, ret_model);
}
