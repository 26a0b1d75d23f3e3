/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light_shape.h"

static int add_light_mesh(
	struct pen_layout *l, const double (*vertices)[3], uint32_t count, uint32_t *ret_model)
{
	static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
	const struct pen_model model = {
		.type = PEN_MODEL_TRIANGLES,
		.first = pen_layout_count(&l->indices, 3 * sizeof(uint32_t)),
		.count = count - 2,
		.vertex_first = pen_layout_count(&l->vertices, 3 * sizeof(float)),
		.vertex_count = count,
		.step_count = 1,
		.normal_offset = PEN_NO_INDEX,
	};
	float *to = pen_layout_extend(l, &l->vertices, count, 3 * sizeof *to);

	if (!to)
		return PEN_ELIMIT;
	for (uint32_t i = 0; i < 3 * count; i++)
		to[i] = (float)vertices[i / 3][i % 3];
	if (pen_layout_add_indices(l, indices, model.count, model.vertex_first, false) < 0)
		return PEN_ELIMIT;
	return pen_layout_add_model(l, &model, ret_model);
}

static int add_light_rectangle(
	struct pen_layout *l, const struct pen_light_desc *light, uint32_t *ret_model)
{
	double vertices[4][3];

	for (int k = 0; k < 3; k++) {
		const double c = light->u.rectangle.corner[k];
		const double u = light->u.rectangle.edge_u[k];
		const double v = light->u.rectangle.edge_v[k];

		vertices[0][k] = c;
		vertices[1][k] = c + u;
		vertices[2][k] = c + u + v;
		vertices[3][k] = c + v;
	}
	return add_light_mesh(l, (const double(*)[3])vertices, 4, ret_model);
}

static int add_light_disk(
	struct pen_layout *l, const struct pen_light_desc *light, uint32_t *ret_model)
{
	const struct pen_model model = {
		.type = PEN_MODEL_DISK,
		.first = pen_layout_count(&l->disks, sizeof(struct pen_disk)),
		.count = 1,
		.step_count = 1,
	};
	const double *c = light->u.disk.center;
	const double *n = light->u.disk.normal;
	struct pen_disk *disk = pen_layout_extend(l, &l->disks, 1, sizeof *disk);

	if (!disk)
		return PEN_ELIMIT;
	*disk = (struct pen_disk){
		.bounds = {(float)c[0], (float)c[1], (float)c[2], (float)light->u.disk.radius},
		.normal = {(float)n[0], (float)n[1], (float)n[2]},
	};
	return pen_layout_add_model(l, &model, ret_model);
}

static int add_light_sphere(
	struct pen_layout *l, const struct pen_light_desc *light, uint32_t *ret_model)
{
	const struct pen_model model = {
		.type = PEN_MODEL_SPHERES,
		.first = pen_layout_count(&l->spheres, sizeof(struct pen_sphere)),
		.count = 1,
		.step_count = 1,
	};

	if (pen_layout_add_sphere(l, light->u.sphere.center, light->u.sphere.radius) < 0)
		return PEN_ELIMIT;
	return pen_layout_add_model(l, &model, ret_model);
}

int pen_light_shape_add(struct pen_layout *l, uint32_t index)
{
	const struct pen_light_desc *light = &l->scene->lights[index];
	struct pen_shape shape = {.surface = l->scene->material_count + index};
	int r = 0;

	switch (light->type) {
	case PEN_LIGHT_RECTANGLE: r = add_light_rectangle(l, light, &shape.model); break;
	case PEN_LIGHT_TRIANGLE:
		r = add_light_mesh(
			l, (const double(*)[3])light->u.triangle.vertices, 3, &shape.model);
		break;
	case PEN_LIGHT_DISK: r = add_light_disk(l, light, &shape.model); break;
	case PEN_LIGHT_SPHERE: r = add_light_sphere(l, light, &shape.model); break;
	case PEN_LIGHT_POINT:
	case PEN_LIGHT_SPOT:
	case PEN_LIGHT_DIRECTIONAL: return 0;
	}
	return r < 0 ? r : pen_layout_add_shape(l, &shape);
}
