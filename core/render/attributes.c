/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/attributes.h"

#include "core/render/vec.h"

#include <math.h>
#include <string.h>

static int add_array(struct pen_layout *l, struct pen_buf *pool, const float *from,
	const struct pen_model *model, uint32_t width, uint32_t *ret_offset)
{
	const uint32_t first = pen_layout_count(pool, width * sizeof *from);
	float *to;

	*ret_offset = PEN_NO_INDEX;
	if (!from)
		return 0;
	to = pen_layout_extend(l, pool, model->vertex_count, width * sizeof *from);
	if (!to)
		return PEN_ELIMIT;
	memcpy(to, from, (size_t)model->vertex_count * width * sizeof *from);
	*ret_offset = first - model->vertex_first;
	return 0;
}

/* The texture coordinates that the scene's normal maps use; NULL when there are none of either. */
static const float *mapped_uvs(const struct pen_scene *scene, const struct pen_object_desc *mesh)
{
	static const enum pen_input normals[] = {PEN_INPUT_NORMAL, PEN_INPUT_CLEARCOAT_NORMAL};

	for (uint32_t i = 0; i < scene->material_count; i++) {
		for (int k = 0; k < 2; k++) {
			const struct pen_input_desc *input =
				&scene->materials[i].inputs[normals[k]];

			if (input->texture >= scene->texture_count)
				continue;
			return input->uv_set == 1 && mesh->u.mesh.uvs_1 ? mesh->u.mesh.uvs_1
									: mesh->u.mesh.uvs;
		}
	}
	return NULL;
}

static void subtract(const float *a, const float *b, int n, double ret[3])
{
	for (int i = 0; i < n; i++)
		ret[i] = (double)a[i] - (double)b[i];
}

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double ret[3])
{
	for (int i = 0; i < 3; i++)
		ret[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* The angle of a triangle at its corner k. */
static double angle_at(const float *const p[3], int k)
{
	double a[3], b[3], normal[3];

	subtract(p[(k + 1) % 3], p[k], 3, a);
	subtract(p[(k + 2) % 3], p[k], 3, b);
	cross(a, b, normal);
	return (double)pen_angle((float)sqrt(dot(normal, normal)), (float)dot(a, b));
}

/*
 * Adds a triangle's tangent to those of its corners: in the first three the direction in which u
 * grows, in the fourth, weighted alike, whether v falls on the left of it.
 */
static void add_triangle(const struct pen_object_desc *mesh, const float *uvs,
	const uint32_t index[3], float *tangents)
{
	const float *p[3];
	double e1[3], e2[3], d1[3], d2[3], tangent[3], length, area;

	for (int k = 0; k < 3; k++)
		p[k] = mesh->u.mesh.vertices + 3 * (size_t)index[k];
	subtract(p[1], p[0], 3, e1);
	subtract(p[2], p[0], 3, e2);
	subtract(uvs + 2 * (size_t)index[1], uvs + 2 * (size_t)index[0], 2, d1);
	subtract(uvs + 2 * (size_t)index[2], uvs + 2 * (size_t)index[0], 2, d2);
	area = d1[0] * d2[1] - d2[0] * d1[1];
	for (int i = 0; i < 3; i++)
		tangent[i] = (area < 0.0 ? -1.0 : 1.0) * (e1[i] * d2[1] - e2[i] * d1[1]);
	length = sqrt(dot(tangent, tangent));
	for (int k = 0; k < 3 && length > 0.0; k++) {
		const double weight = angle_at(p, k);
		float *to = tangents + 4 * (size_t)index[k];

		for (int i = 0; i < 3; i++)
			to[i] += (float)(weight * tangent[i] / length);
		to[3] += (float)(area > 0.0 ? -weight : weight);
	}
}

static void derive_tangents(const struct pen_object_desc *mesh, const float *uvs, float *tangents)
{
	const uint32_t count = mesh->u.mesh.vertex_count;

	memset(tangents, 0, 4ul * count * sizeof *tangents);
	for (uint32_t i = 0; i < mesh->u.mesh.triangle_count; i++)
		add_triangle(mesh, uvs, mesh->u.mesh.indices + 3 * (size_t)i, tangents);
}

/* Directions within the surface are carried by the map itself; a mirror image changes the side. */
static void place_tangents(const struct pen_affine *world, uint32_t count, float *tangents)
{
	const float side = pen_affine_determinant(world) < 0.0 ? -1.0f : 1.0f;

	for (uint32_t i = 0; i < count; i++) {
		float *t = tangents + 4 * (size_t)i;
		const double from[3] = {(double)t[0], (double)t[1], (double)t[2]};
		double to[3], length;

		for (int k = 0; k < 3; k++)
			to[k] = dot(world->m[k], from);
		length = sqrt(dot(to, to));
		for (int k = 0; k < 3; k++)
			t[k] = length > 0.0 ? (float)(to[k] / length) : 0.0f;
		t[3] = t[3] < 0.0f ? -side : side;
	}
}

static int add_tangents(struct pen_layout *l, const struct pen_object_desc *mesh,
	const struct pen_affine *world, struct pen_model *model)
{
	const float *uvs = mapped_uvs(l->scene, mesh);
	const uint32_t first = pen_layout_count(&l->tangents, 4 * sizeof(float));
	float *to;

	model->tangent_offset = PEN_NO_INDEX;
	if (!uvs)
		return 0;
	to = pen_layout_extend(l, &l->tangents, model->vertex_count, 4 * sizeof *to);
	if (!to)
		return PEN_ELIMIT;
	if (mesh->u.mesh.tangents)
		memcpy(to, mesh->u.mesh.tangents, 4ul * model->vertex_count * sizeof *to);
	else
		derive_tangents(mesh, uvs, to);
	place_tangents(world, model->vertex_count, to);
	model->tangent_offset = first - model->vertex_first;
	return 0;
}

int pen_attributes_add(struct pen_layout *l, const struct pen_object_desc *mesh,
	const struct pen_affine *world, struct pen_model *model)
{
	const float *const sets[2] = {mesh->u.mesh.uvs, mesh->u.mesh.uvs_1};

	for (int i = 0; i < 2; i++)
		if (add_array(l, &l->uvs, sets[i], model, 2, &model->uv_offsets[i]) < 0)
			return PEN_ELIMIT;
	if (add_array(l, &l->colors, mesh->u.mesh.colors, model, 4, &model->color_offset) < 0)
		return PEN_ELIMIT;
	return add_tangents(l, mesh, world, model);
}
