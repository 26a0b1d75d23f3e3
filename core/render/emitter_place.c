/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/emitters.h"

#include "core/render/trace.h"
#include "core/render/vertex.h"

#include <stddef.h>

/* By the map; a mirrored triangle keeps its front. */
static void move(
	const float m[3][4], struct pen_vec3 *corner, struct pen_vec3 *u, struct pen_vec3 *v)
{
	const struct pen_vec3 x = {m[0][0], m[1][0], m[2][0]};
	const struct pen_vec3 y = {m[0][1], m[1][1], m[2][1]};
	const struct pen_vec3 z = {m[0][2], m[1][2], m[2][2]};
	const struct pen_vec3 moved_u = pen_linear(m, *u), moved_v = pen_linear(m, *v);
	const bool is_mirrored = pen_dot(x, pen_cross(y, z)) < 0.0f;

	*corner = pen_add(pen_linear(m, *corner), pen_vec3(m[0][3], m[1][3], m[2][3]));
	*u = is_mirrored ? moved_v : moved_u;
	*v = is_mirrored ? moved_u : moved_v;
}

void pen_emitter_place(const struct pen_render_scene *scene, const struct pen_emitter *emitter,
	float time, struct pen_light *ret_light)
{
	const struct pen_geometry *geometry = &scene->geometry;
	const struct pen_shape *shape = &geometry->shapes[emitter->shape];
	const struct pen_model *model = &geometry->models[shape->model];
	const struct pen_spheres spheres = {
		geometry->spheres + model->first, model->count, model->step_count};
	const uint32_t *index;
	struct pen_vec3 a, u, v;
	float moving[3][4];

	if (model->type == PEN_MODEL_SPHERES) {
		const struct pen_sphere s =
			pen_sphere_at(&spheres, (int32_t)emitter->primitive, time);

		pen_light_set_sphere(ret_light, pen_vec3(s.x, s.y, s.z), s.radius);
		return;
	}
	index = geometry->indices + 3 * (size_t)(model->first + emitter->primitive);
	a = pen_vertex_at(geometry->vertices, model, index[0], time);
	u = pen_sub(pen_vertex_at(geometry->vertices, model, index[1], time), a);
	v = pen_sub(pen_vertex_at(geometry->vertices, model, index[2], time), a);
	if (shape->placement_count == 1) {
		move(shape->world, &a, &u, &v);
	} else if (shape->placement_count > 1) {
		pen_trace_placement(scene->trace, emitter->shape, time, moving);
		move((const float(*)[4])moving, &a, &u, &v);
	}
	pen_light_set_triangle(ret_light, a, u, v);
}
