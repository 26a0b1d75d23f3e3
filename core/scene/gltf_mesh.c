/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_mesh.h"

#include "core/scene/gltf_accessor.h"
#include "core/scene/gltf_material.h"

#include <stdlib.h>
#include <string.h>

/* Modes as glTF numbers them. */
enum { MODE_TRIANGLES = 4, MODE_STRIP = 5, MODE_FAN = 6 };

enum { INFLUENCES_MAX = 8 }; /* JOINTS_0 and JOINTS_1 */

static int attribute(const struct pen_gltf_attributes *attributes, const char *name)
{
	for (size_t i = 0; i < attributes->count; i++)
		if (strcmp(attributes->items[i].name, name) == 0)
			return attributes->items[i].accessor;
	return -1;
}

static bool has_attribute(const struct pen_gltf_attributes *attributes, const char *name)
{
	for (size_t i = 0; i < attributes->count; i++)
		if (strcmp(attributes->items[i].name, name) == 0)
			return true;
	return false;
}

/* A primitive while it is read. */
struct primitive {
	size_t index;
	const struct pen_gltf_primitive *from;
	struct pen_object_desc *to;
};

/* An attribute of the vertices, or NULL where the primitive has none. */
static const float *vertex_numbers(struct pen_gltf_reading *r, const struct primitive *primitive,
	const struct pen_gltf_attributes *attributes, const char *name, uint32_t width)
{
	uint32_t count;

	if (!has_attribute(attributes, name))
		return NULL;
	pen_gltf_at_part(r, "primitive %zu, %s", primitive->index, name);
	return pen_gltf_accessor_floats(
		r, attribute(attributes, name), width, primitive->to->u.mesh.vertex_count, &count);
}

/* Those of the scene may be written by its owner; an asset's are shared, and nobody does. */
static float *shared(const float *numbers)
{
	union {
		const float *from;
		float *to;
	} cast = {numbers};

	return cast.to;
}

static void read_normals(struct pen_gltf_reading *r, const struct primitive *primitive)
{
	const float *normals =
		vertex_numbers(r, primitive, &primitive->from->attributes, "NORMAL", 3);

	for (uint32_t i = 0; normals && i < primitive->to->u.mesh.vertex_count; i++) {
		const float *n = normals + 3 * (size_t)i;

		if (n[0] == 0.0f && n[1] == 0.0f && n[2] == 0.0f) {
			pen_gltf_warn(r, "normals of length 0: the primitive is shown flat");
			return;
		}
	}
	primitive->to->u.mesh.normals = shared(normals);
}

/* Colours of three components get an alpha of 1. */
static void read_colors(struct pen_gltf_reading *r, const struct primitive *primitive)
{
	const struct pen_gltf_attributes *attributes = &primitive->from->attributes;
	const uint32_t count = primitive->to->u.mesh.vertex_count;
	const bool is_opaque = pen_gltf_accessor_width(r, attribute(attributes, "COLOR_0")) == 3;
	const float *colors =
		vertex_numbers(r, primitive, attributes, "COLOR_0", is_opaque ? 3 : 4);
	float *widened;

	primitive->to->u.mesh.colors = shared(colors);
	if (!colors || !is_opaque)
		return;
	widened = pen_gltf_alloc(r, count, 4 * sizeof *widened);
	primitive->to->u.mesh.colors = widened;
	for (size_t i = 0; widened && i < count; i++) {
		memcpy(widened + 4 * i, colors + 3 * i, 3 * sizeof *widened);
		widened[4 * i + 3] = 1.0f;
	}
}

static void read_vertices(struct pen_gltf_reading *r, const struct primitive *primitive)
{
	const struct pen_gltf_attributes *attributes = &primitive->from->attributes;
	struct pen_object_desc *to = primitive->to;

	pen_gltf_at_part(r, "primitive %zu, POSITION", primitive->index);
	to->u.mesh.vertices = shared(pen_gltf_accessor_floats(
		r, attribute(attributes, "POSITION"), 3, PEN_GLTF_ANY, &to->u.mesh.vertex_count));
	if (!to->u.mesh.vertices)
		return;
	read_normals(r, primitive);
	to->u.mesh.uvs = shared(vertex_numbers(r, primitive, attributes, "TEXCOORD_0", 2));
	to->u.mesh.uvs_1 = shared(vertex_numbers(r, primitive, attributes, "TEXCOORD_1", 2));
	to->u.mesh.tangents = shared(vertex_numbers(r, primitive, attributes, "TANGENT", 4));
	read_colors(r, primitive);
}

/* The corner of a triangle as a place in the order that vertices are listed in. */
static uint32_t corner(int mode, uint32_t triangle, uint32_t k)
{
	switch (mode) {
	case MODE_STRIP: /* every other one is wound the other way */
		return triangle + (k == 0 ? 0 : 1 + ((k - 1) ^ (triangle & 1)));
	case MODE_FAN: return k == 2 ? 0 : triangle + 1 + k;
	default: return 3 * triangle + k;
	}
}

/* The vertices in their order; NULL with count set: one after the other. */
static bool read_order(struct pen_gltf_reading *r, const struct primitive *primitive,
	const uint32_t **ret_order, uint32_t *ret_count)
{
	const uint32_t vertices = primitive->to->u.mesh.vertex_count;
	uint32_t *order;

	*ret_order = NULL;
	*ret_count = vertices;
	pen_gltf_at_part(r, "primitive %zu, indices", primitive->index);
	if (primitive->from->indices < 0)
		return true;
	order = pen_gltf_accessor_integers(r, primitive->from->indices, 1, PEN_GLTF_ANY, ret_count);
	for (uint32_t i = 0; order && i < *ret_count; i++) {
		if (order[i] < vertices)
			continue;
		pen_gltf_refuse(
			r, "index %u is %u, but there are %u vertices", i, order[i], vertices);
		return false;
	}
	*ret_order = order;
	return order != NULL;
}

static void read_triangles(struct pen_gltf_reading *r, const struct primitive *primitive)
{
	const int mode = primitive->from->mode;
	struct pen_object_desc *to = primitive->to;
	const uint32_t *order;
	uint32_t count, triangles;

	if (!read_order(r, primitive, &order, &count))
		return;
	if (mode == MODE_TRIANGLES && count % 3 != 0) {
		pen_gltf_refuse(r, "%u vertices make no whole number of triangles", count);
		return;
	}
	triangles = mode == MODE_TRIANGLES ? count / 3 : count > 2 ? count - 2 : 0;
	if (triangles == 0) {
		pen_gltf_warn(r, "no triangle");
		return;
	}
	to->u.mesh.indices = pen_gltf_alloc(r, triangles, 3 * sizeof *to->u.mesh.indices);
	if (!to->u.mesh.indices)
		return;
	for (uint32_t i = 0; i < 3 * triangles; i++) {
		const uint32_t at = corner(mode, i / 3, i % 3);

		to->u.mesh.indices[i] = order ? order[at] : at;
	}
	to->u.mesh.triangle_count = triangles;
}

static float *add_targets(struct pen_gltf_reading *r, const struct primitive *primitive,
	const char *name, uint32_t count)
{
	const size_t floats = 3 * (size_t)primitive->to->u.mesh.vertex_count;
	float *all = pen_gltf_alloc(r, count, floats * sizeof *all);

	for (uint32_t i = 0; all && i < count; i++) {
		const float *one =
			vertex_numbers(r, primitive, &primitive->from->targets[i], name, 3);

		if (one)
			memcpy(all + i * floats, one, floats * sizeof *all);
	}
	return all;
}

static bool targets_have(const struct pen_gltf_primitive *from, const char *name)
{
	for (size_t i = 0; i < from->target_count; i++)
		if (has_attribute(&from->targets[i], name))
			return true;
	return false;
}

static void read_morphs(struct pen_gltf_reading *r, const struct primitive *primitive,
	struct pen_deform_desc *deform)
{
	const struct pen_gltf_primitive *from = primitive->from;
	const struct pen_gltf_primitive *first = from - primitive->index;

	pen_gltf_at_part(r, "primitive %zu, targets", primitive->index);
	/* Weights, and what moves them, are the mesh's: as many for each. */
	if (from->target_count != first->target_count) {
		pen_gltf_refuse(r, "%zu morph targets, but the first primitive has %zu",
			from->target_count, first->target_count);
		return;
	}
	if (from->target_count > PEN_GLTF_MORPHS_MAX) {
		pen_gltf_refuse(r, "more than %u morph targets", PEN_GLTF_MORPHS_MAX);
		return;
	}
	deform->morph_vertices =
		add_targets(r, primitive, "POSITION", (uint32_t)from->target_count);
	if (targets_have(from, "NORMAL") && primitive->to->u.mesh.normals)
		deform->morph_normals =
			add_targets(r, primitive, "NORMAL", (uint32_t)from->target_count);
	deform->morph_count = (uint32_t)from->target_count;
}

/* Joints and weights of one set, put beside those of the other. */
static bool read_influence_set(struct pen_gltf_reading *r, const struct primitive *primitive,
	int set, uint16_t *joints, float *influences, uint32_t stride)
{
	const struct pen_gltf_attributes *attributes = &primitive->from->attributes;
	const uint32_t vertices = primitive->to->u.mesh.vertex_count;
	const char *const joint_name = set ? "JOINTS_1" : "JOINTS_0";
	const uint32_t *from;
	const float *weights;
	uint32_t count;

	pen_gltf_at_part(r, "primitive %zu, %s", primitive->index, joint_name);
	from = pen_gltf_accessor_integers(
		r, attribute(attributes, joint_name), 4, vertices, &count);
	weights = vertex_numbers(r, primitive, attributes, set ? "WEIGHTS_1" : "WEIGHTS_0", 4);
	if (!weights && from)
		pen_gltf_refuse(r, "it has joints, but no weights");
	for (size_t i = 0; from && weights && i < 4 * (size_t)vertices; i++) {
		const size_t to = i / 4 * stride + 4 * (size_t)set + i % 4;

		if (from[i] > UINT16_MAX || weights[i] < 0.0f) {
			pen_gltf_refuse(r,
				"vertex %zu: a joint beyond all skins, or a weight "
				"below 0",
				i / 4);
			return false;
		}
		joints[to] = (uint16_t)from[i];
		influences[to] = weights[i];
	}
	return from && weights;
}

/* Weights of sum 1; a vertex of no weight follows its first joint. */
static void normalize_influences(float *influences, uint32_t vertices, uint32_t count)
{
	for (uint32_t i = 0; i < vertices; i++, influences += count) {
		double sum = 0.0;

		for (uint32_t k = 0; k < count; k++)
			sum += (double)influences[k];
		if (!(sum > 0.0)) {
			influences[0] = 1.0f;
			sum = 1.0;
		}
		for (uint32_t k = 0; k < count; k++)
			influences[k] = (float)((double)influences[k] / sum);
	}
}

static void read_influences(struct pen_gltf_reading *r, const struct primitive *primitive,
	struct pen_deform_desc *deform)
{
	const uint32_t vertices = primitive->to->u.mesh.vertex_count;
	const uint32_t count =
		has_attribute(&primitive->from->attributes, "JOINTS_1") ? INFLUENCES_MAX : 4;
	uint16_t *joints = pen_gltf_alloc(r, vertices, count * sizeof *joints);
	float *influences = pen_gltf_alloc(r, vertices, count * sizeof *influences);

	if (!joints || !influences)
		return;
	for (int set = 0; set < (int)count / 4; set++)
		if (!read_influence_set(r, primitive, set, joints, influences, count))
			return;
	normalize_influences(influences, vertices, count);
	deform->joints = joints;
	deform->influences = influences;
	deform->influence_count = count;
}

static void read_deform(struct pen_gltf_reading *r, const struct primitive *primitive)
{
	const struct pen_gltf_primitive *from = primitive->from;
	const bool has_joints = has_attribute(&from->attributes, "JOINTS_0");
	struct pen_deform_desc *deform;

	if (!has_joints && from->target_count == 0)
		return;
	deform = pen_gltf_alloc(r, 1, sizeof *deform);
	if (!deform)
		return;
	deform->skin = PEN_NO_INDEX;
	if (from->target_count > 0)
		read_morphs(r, primitive, deform);
	if (has_joints)
		read_influences(r, primitive, deform);
	primitive->to->u.mesh.deform = deform;
}

/* Whether it becomes an object. */
static bool read_primitive(struct pen_gltf_reading *r, const struct primitive *primitive)
{
	const struct pen_gltf_primitive *from = primitive->from;
	const size_t found = r->found;

	pen_gltf_at_part(r, "primitive %zu", primitive->index);
	if (from->mode < MODE_TRIANGLES) {
		pen_gltf_warn(r, "points and lines are left out");
		return false;
	}
	if (from->mode > MODE_FAN) {
		pen_gltf_refuse(r, "%d is no mode", from->mode);
		return false;
	}
	if (!has_attribute(&from->attributes, "POSITION")) {
		pen_gltf_warn(r, "it has no POSITION and is left out");
		return false;
	}
	primitive->to->material = pen_gltf_material(r, from->material);
	read_vertices(r, primitive);
	if (!primitive->to->u.mesh.vertices)
		return false;
	read_triangles(r, primitive);
	read_deform(r, primitive);
	return r->found == found && primitive->to->u.mesh.triangle_count > 0;
}

static void read_mesh(struct pen_gltf_reading *r, size_t index, struct pen_gltf_shapes *shapes)
{
	const struct pen_gltf_mesh *mesh = &r->model->meshes[index];
	const char *name;

	pen_gltf_at(r, "mesh", index, mesh->name);
	name = mesh->name[0] ? pen_gltf_text(r, mesh->name) : NULL;
	shapes->items = pen_gltf_alloc(r, mesh->primitive_count, sizeof *shapes->items);
	for (size_t i = 0; i < mesh->primitive_count && pen_gltf_sound(r); i++) {
		struct pen_object_desc object = {.type = PEN_OBJECT_MESH,
			.name = name,
			.transform = {.rotate = {0, 0, 0, 1}, .scale = {1, 1, 1}},
			.node = PEN_NO_INDEX};
		const struct primitive primitive = {i, &mesh->primitives[i], &object};

		if (!read_primitive(r, &primitive))
			continue;
		shapes->deforms |= object.u.mesh.deform != NULL;
		shapes->items[shapes->count++] = object;
	}
}

struct pen_gltf_shapes *pen_gltf_mesh(struct pen_gltf_reading *r, int index)
{
	struct pen_gltf_shapes *shapes;
	char place[sizeof r->place];
	const size_t part = r->part;

	if (index < 0 || (size_t)index >= r->model->mesh_count) {
		pen_gltf_refuse(r, "there is no mesh %d", index);
		return NULL;
	}
	shapes = &r->asset->shapes[index];
	if (!shapes->is_read) {
		shapes->is_read = true;
		memcpy(place, r->place, sizeof place);
		read_mesh(r, (size_t)index, shapes);
		memcpy(r->place, place, sizeof place);
		r->part = part;
	}
	return shapes;
}
