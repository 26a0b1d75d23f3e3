/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_VERTEX_H
#define PEN_RENDER_VERTEX_H

#include "core/render/geometry.h"
#include "core/render/sphere.h"
#include "core/render/vec.h"

#include <stdint.h>

/* Reading the pools of a geometry, and placements of shapes, one lane at a time. */

PEN_LANE struct pen_vec3 pen_vertex(const float *pool, int32_t index)
{
	return pen_vec3(pool[3 * index], pool[3 * index + 1], pool[3 * index + 2]);
}

/* From a pool of vertices or normals, which has an entry for each vertex of each step. */
static inline struct pen_vec3 pen_vertex_at(
	const float *pool, const struct pen_model *model, uint32_t index, float time)
{
	float rest;

	if (model->step_count == 1)
		return pen_vertex(pool, (int32_t)index);
	index += (uint32_t)pen_step_of(time, model->step_count, &rest) * model->vertex_count;
	return pen_madd(pen_scale(pen_vertex(pool, (int32_t)index), 1.0f - rest), rest,
		pen_vertex(pool, (int32_t)(index + model->vertex_count)));
}

/* A direction by the linear part of a map. */
static inline struct pen_vec3 pen_linear(const float m[3][4], struct pen_vec3 v)
{
	return pen_vec3(m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
		m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
		m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z);
}

/* The inverse of the linear part of a map applied to a direction, by Cramer's rule. */
static inline struct pen_vec3 pen_linear_inverse(const float m[3][4], struct pen_vec3 d)
{
	const struct pen_vec3 a = {m[0][0], m[1][0], m[2][0]};
	const struct pen_vec3 b = {m[0][1], m[1][1], m[2][1]};
	const struct pen_vec3 c = {m[0][2], m[1][2], m[2][2]};
	const float inverse = 1.0f / pen_dot(a, pen_cross(b, c));

	return pen_vec3(pen_dot(d, pen_cross(b, c)) * inverse,
		pen_dot(d, pen_cross(c, a)) * inverse, pen_dot(d, pen_cross(a, b)) * inverse);
}

#endif
