/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/deform.h"

#include "core/base/limits.h"
#include "core/render/node.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WEIGHT_DEVIATION_MAX 1e-3
#define CORNER_DEVIATION_MAX 1e-3

static const struct pen_skin_desc *skin_of(
	const struct pen_scene *scene, const struct pen_deform_desc *deform)
{
	return deform && deform->skin != PEN_NO_INDEX ? &scene->skins[deform->skin] : NULL;
}

/* The world from a vertex at rest, by one joint. */
static struct pen_affine joint_at(const struct pen_scene *scene, const struct pen_skin_desc *skin,
	uint32_t joint, double time)
{
	const struct pen_affine world = pen_node_world(scene, skin->joints[joint], time);
	struct pen_affine bind;

	memcpy(bind.m, skin->inverse_bind[joint], sizeof bind.m);
	return pen_affine_product(&world, &bind);
}

static void weights_at(const struct pen_deform_desc *deform, double time, double *ret_weights)
{
	if (deform->weights.key_count > 0)
		pen_track_at(&deform->weights, deform->morph_count, false, time, ret_weights);
	else
		memcpy(ret_weights, deform->morph_weights,
			deform->morph_count * sizeof *ret_weights);
}

/* Whether vertices that go straight from step to step stay near the way of one joint. */
static bool joint_fits(const struct pen_scene *scene, const struct pen_skin_desc *skin,
	uint32_t joint, const struct pen_box *box, const struct pen_shutter *shutter,
	uint32_t segments)
{
	struct pen_affine a = joint_at(scene, skin, joint, shutter->open), b;

	for (uint32_t i = 1; i <= segments; i++, a = b) {
		b = joint_at(scene, skin, joint, pen_shutter_time(shutter, i, segments + 1));
		for (uint32_t k = 1; k < 4; k++) {
			const struct pen_affine world = joint_at(scene, skin, joint,
				pen_shutter_time(shutter, 4 * (i - 1) + k, 4 * segments + 1));
			struct pen_affine shown;

			for (int n = 0; n < 12; n++)
				shown.m[n / 4][n % 4] =
					a.m[n / 4][n % 4] +
					k / 4.0 * (b.m[n / 4][n % 4] - a.m[n / 4][n % 4]);
			if (!pen_box_agrees(&world, &shown, box, CORNER_DEVIATION_MAX))
				return false;
		}
	}
	return true;
}

static bool skin_fits(const struct pen_scene *scene, const struct pen_skin_desc *skin,
	const struct pen_box *box, const struct pen_shutter *shutter, uint32_t segments)
{
	for (uint32_t i = 0; i < skin->joint_count; i++)
		if (!joint_fits(scene, skin, i, box, shutter, segments))
			return false;
	return true;
}

static bool weights_fit(
	const struct pen_deform_desc *deform, const struct pen_shutter *shutter, uint32_t segments)
{
	double a[PEN_GLTF_MORPHS_MAX], b[PEN_GLTF_MORPHS_MAX], w[PEN_GLTF_MORPHS_MAX];

	weights_at(deform, shutter->open, a);
	for (uint32_t i = 1; i <= segments; i++) {
		weights_at(deform, pen_shutter_time(shutter, i, segments + 1), b);
		for (uint32_t k = 1; k < 4; k++) {
			weights_at(deform,
				pen_shutter_time(shutter, 4 * (i - 1) + k, 4 * segments + 1), w);
			for (uint32_t m = 0; m < deform->morph_count; m++)
				if (!(fabs(a[m] + k / 4.0 * (b[m] - a[m]) - w[m]) <=
					    WEIGHT_DEVIATION_MAX))
					return false;
		}
		memcpy(a, b, deform->morph_count * sizeof *a);
	}
	return true;
}

static uint32_t keys_within(const struct pen_scene *scene, const struct pen_deform_desc *deform,
	const struct pen_shutter *shutter)
{
	const struct pen_skin_desc *skin = skin_of(scene, deform);
	uint32_t most = pen_track_keys_within(&deform->weights, shutter);

	for (uint32_t i = 0; skin && i < skin->joint_count; i++) {
		const uint32_t keys = pen_node_keys_within(scene, skin->joints[i], shutter);

		most = keys > most ? keys : most;
	}
	return most;
}

static bool skin_moves(const struct pen_scene *scene, const struct pen_skin_desc *skin,
	const struct pen_shutter *shutter)
{
	for (uint32_t i = 0; skin && i < skin->joint_count; i++)
		if (pen_node_moves(scene, skin->joints[i], shutter))
			return true;
	return false;
}

uint32_t pen_deform_steps(const struct pen_scene *scene, const struct pen_object_desc *mesh,
	const struct pen_shutter *shutter)
{
	const struct pen_deform_desc *deform = mesh->u.mesh.deform;
	const struct pen_skin_desc *skin = skin_of(scene, deform);
	bool morphs, bends;
	struct pen_box box;
	uint32_t keys;

	if (!deform)
		return pen_motion_mesh_steps(mesh, shutter);
	morphs = deform->morph_count > 0 &&
		 pen_track_moves(&deform->weights, deform->morph_count, shutter);
	bends = skin_moves(scene, skin, shutter);
	if (!morphs && !bends)
		return 1;
	box = pen_motion_box(mesh);
	keys = keys_within(scene, deform, shutter);
	for (uint32_t k = 0; pen_segments_to_try(k) < PEN_DEFORM_STEPS_MAX; k++) {
		const uint32_t segments = pen_segments_to_try(k);

		if (segments > keys && (!morphs || weights_fit(deform, shutter, segments)) &&
			(!bends || skin_fits(scene, skin, &box, shutter, segments)))
			return segments + 1;
	}
	return PEN_DEFORM_STEPS_MAX;
}

/* Adds targets by their weights to count numbers. */
static void add_morphs(const struct pen_deform_desc *deform, const float *targets, double time,
	size_t count, float *numbers)
{
	double weights[PEN_GLTF_MORPHS_MAX];

	weights_at(deform, time, weights);
	for (uint32_t m = 0; m < deform->morph_count; m++) {
		const float *target = targets + m * count;

		for (size_t i = 0; i < count && weights[m] != 0.0; i++)
			numbers[i] += (float)(weights[m] * (double)target[i]);
	}
}

/* The sum of the normals of the triangles around each vertex, as long as they are large. */
static void sum_normals(const struct pen_object_desc *mesh, const float *vertices, float *ret_sums)
{
	memset(ret_sums, 0, 3 * (size_t)mesh->u.mesh.vertex_count * sizeof *ret_sums);
	for (size_t i = 0; i < mesh->u.mesh.triangle_count; i++) {
		const uint32_t *index = mesh->u.mesh.indices + 3 * i;
		const float *p[3];
		float u[3], v[3];

		for (int k = 0; k < 3; k++)
			p[k] = vertices + 3 * (size_t)index[k];
		for (int k = 0; k < 3; k++) {
			u[k] = p[1][k] - p[0][k];
			v[k] = p[2][k] - p[0][k];
		}
		for (int corner = 0; corner < 3; corner++)
			for (int k = 0; k < 3; k++)
				ret_sums[3 * (size_t)index[corner] + (size_t)k] +=
					u[(k + 1) % 3] * v[(k + 2) % 3] -
					u[(k + 2) % 3] * v[(k + 1) % 3];
	}
}

static bool to_unit(const float *from, double ret[3])
{
	double length = 0.0;

	for (int k = 0; k < 3; k++) {
		ret[k] = (double)from[k];
		length += ret[k] * ret[k];
	}
	length = sqrt(length);
	for (int k = 0; k < 3; k++)
		ret[k] /= length;
	return length > 0.0 && isfinite(length);
}

/*
 * Turns a vector as one unit vector turns into another on the shortest way: n - 2 (n.h) h mirrors
 * it, and two mirrors are a rotation.
 */
static void turn(const double from[3], const double to[3], float *n)
{
	double half[3], along = 0.0, across = 0.0, length = 0.0;

	for (int k = 0; k < 3; k++) {
		half[k] = from[k] + to[k];
		length += half[k] * half[k];
		along += (double)n[k] * from[k];
	}
	if (length < 1e-6)
		return;
	for (int k = 0; k < 3; k++)
		across += ((double)n[k] - 2.0 * along * from[k]) * half[k];
	for (int k = 0; k < 3; k++)
		n[k] = (float)((double)n[k] - 2.0 * along * from[k] -
			       2.0 * across * half[k] / length);
}

/* Turns the normals at rest as the triangles around them turned. */
static int turn_normals(const struct pen_object_desc *mesh, const float *vertices, float *normals,
	struct pen_error *err)
{
	const size_t count = mesh->u.mesh.vertex_count;
	float *sums = malloc(6 * (count + 1) * sizeof *sums);

	if (!sums)
		return pen_error_memory(err);
	sum_normals(mesh, mesh->u.mesh.vertices, sums);
	sum_normals(mesh, vertices, sums + 3 * count);
	for (size_t i = 0; i < count; i++) {
		double from[3], to[3];

		if (to_unit(sums + 3 * i, from) && to_unit(sums + 3 * (count + i), to))
			turn(from, to, normals + 3 * i);
	}
	free(sums);
	return 0;
}

/* One vertex's share of its joints. */
static struct pen_affine blend(const struct pen_affine *joints, const uint16_t *which,
	const float *influences, uint32_t count)
{
	struct pen_affine sum = {{{0}}};

	for (uint32_t k = 0; k < count; k++) {
		const struct pen_affine *joint = &joints[which[k]];

		for (int n = 0; n < 12 && influences[k] > 0.0f; n++)
			sum.m[n / 4][n % 4] += (double)influences[k] * joint->m[n / 4][n % 4];
	}
	return sum;
}

static int apply_skin(const struct pen_scene *scene, const struct pen_skin_desc *skin,
	const struct pen_object_desc *mesh, double time, float *vertices, float *normals,
	struct pen_error *err)
{
	const struct pen_deform_desc *deform = mesh->u.mesh.deform;
	const uint32_t influences = deform->influence_count;
	struct pen_affine *joints = malloc(skin->joint_count * sizeof *joints);

	if (!joints)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < skin->joint_count; i++)
		joints[i] = joint_at(scene, skin, i, time);
	for (size_t i = 0; i < mesh->u.mesh.vertex_count; i++) {
		const struct pen_affine map = blend(joints, deform->joints + i * influences,
			deform->influences + i * influences, influences);
		float *v = vertices + 3 * i;
		const double p[3] = {(double)v[0], (double)v[1], (double)v[2]};
		double q[3];

		pen_affine_point(&map, p, q);
		for (int k = 0; k < 3; k++)
			v[k] = (float)q[k];
		if (normals) {
			const float n[3] = {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]};

			pen_affine_normal(&map, n, normals + 3 * i);
		}
	}
	free(joints);
	return 0;
}

int pen_deform_at(const struct pen_scene *scene, const struct pen_object_desc *mesh, double time,
	float *ret_vertices, float *ret_normals, struct pen_error *err)
{
	const struct pen_deform_desc *deform = mesh->u.mesh.deform;
	const size_t floats = 3 * (size_t)mesh->u.mesh.vertex_count;
	const struct pen_skin_desc *skin = skin_of(scene, deform);
	const bool morphs = deform && deform->morph_count > 0;
	int r = 0;

	pen_motion_mesh_vertices(mesh, time, ret_vertices);
	if (morphs)
		add_morphs(deform, deform->morph_vertices, time, floats, ret_vertices);
	if (ret_normals) {
		memcpy(ret_normals, mesh->u.mesh.normals, floats * sizeof *ret_normals);
		if (morphs && deform->morph_normals)
			add_morphs(deform, deform->morph_normals, time, floats, ret_normals);
		else if (morphs || mesh->u.mesh.key_count > 1)
			r = turn_normals(mesh, ret_vertices, ret_normals, err);
	}
	if (r == 0 && skin)
		r = apply_skin(scene, skin, mesh, time, ret_vertices, ret_normals, err);
	return r;
}

bool pen_deform_is_mirrored(
	const struct pen_scene *scene, const struct pen_object_desc *mesh, double time)
{
	const struct pen_skin_desc *skin = skin_of(scene, mesh->u.mesh.deform);
	struct pen_affine first;

	if (!skin)
		return false;
	first = joint_at(scene, skin, 0, time);
	return pen_affine_determinant(&first) < 0.0;
}
