/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_place.h"

#include "core/scene/gltf_accessor.h"
#include "core/scene/gltf_mesh.h"

#include <math.h>
#include <string.h>

/* By which Blender turns watts into lumens, and glTF's photometric units back into ours. */
#define LUMENS_PER_WATT 683.0

/* A copy while it is made. */
struct copy {
	const struct pen_object_desc *object;
	uint32_t *nodes; /* of the scene, one a node of the asset; PEN_NO_INDEX: not shown */
	uint32_t *skins; /* the same */
};

void pen_gltf_place_count(struct pen_gltf_reading *r)
{
	for (uint32_t i = 0; i < r->asset->order_count; i++) {
		const size_t index = r->asset->order[i];
		const struct pen_gltf_node *node = &r->model->nodes[index];
		struct pen_gltf_shapes *shapes;

		if (node->mesh < 0)
			continue;
		pen_gltf_at(r, "node", index, node->name);
		shapes = pen_gltf_mesh(r, node->mesh);
		if (shapes)
			shapes->uses++;
	}
}

static bool is_identity(const struct pen_pose *pose)
{
	static const struct pen_pose identity = {.rotate = {0, 0, 0, 1}, .scale = {1, 1, 1}};

	for (int i = 0; i < 4; i++)
		if (pose->rotate[i] != identity.rotate[i])
			return false;
	for (int i = 0; i < 3; i++)
		if (pose->translate[i] != 0.0 || pose->scale[i] != 1.0)
			return false;
	return true;
}

static uint32_t add_node(struct pen_gltf_reading *r, const struct pen_node_desc *node)
{
	return pen_gltf_add(r, &r->nodes, node, sizeof *node, PEN_NODES_MAX);
}

/* One channel of an object's keys as a track. */
static struct pen_track track_of(struct pen_gltf_reading *r, const struct pen_object_desc *object,
	const float *times, size_t offset, uint32_t width)
{
	struct pen_track track = {.interpolation = PEN_INTERPOLATION_LINEAR, .times = times};
	float *values = pen_gltf_alloc(r, object->key_count, width * sizeof *values);

	for (uint32_t i = 0; values && i < object->key_count; i++) {
		double from[4];

		memcpy(from, (const char *)&object->keys[i].pose + offset, width * sizeof *from);
		for (uint32_t k = 0; k < width; k++)
			values[i * width + k] = (float)from[k];
	}
	track.values = values;
	track.key_count = values ? object->key_count : 0;
	return track;
}

static struct pen_node_desc node_of_keys(
	struct pen_gltf_reading *r, const struct pen_object_desc *object)
{
	struct pen_node_desc node = {.parent = PEN_NO_INDEX, .pose = object->keys[0].pose};
	float *times = pen_gltf_alloc(r, object->key_count, sizeof *times);

	for (uint32_t i = 0; times && i < object->key_count; i++)
		times[i] = (float)object->keys[i].time;
	if (!times)
		return node;
	node.translation = track_of(r, object, times, offsetof(struct pen_pose, translate), 3);
	node.rotation = track_of(r, object, times, offsetof(struct pen_pose, rotate), 4);
	node.scale = track_of(r, object, times, offsetof(struct pen_pose, scale), 3);
	return node;
}

/* The object's own transform and keys; PEN_NO_INDEX where they change nothing. */
static uint32_t add_root(struct pen_gltf_reading *r, const struct pen_object_desc *object)
{
	uint32_t parent = PEN_NO_INDEX;

	if (!is_identity(&object->transform)) {
		const struct pen_node_desc node = {
			.parent = PEN_NO_INDEX, .pose = object->transform};

		parent = add_node(r, &node);
	}
	if (object->key_count > 0) {
		struct pen_node_desc node = node_of_keys(r, object);

		node.parent = parent;
		parent = add_node(r, &node);
	}
	return parent;
}

static void add_nodes(struct pen_gltf_reading *r, struct copy *copy)
{
	const uint32_t root = add_root(r, copy->object);

	memset(copy->nodes, 0xff, r->model->node_count * sizeof *copy->nodes);
	for (uint32_t i = 0; i < r->asset->order_count && pen_gltf_sound(r); i++) {
		const uint32_t index = r->asset->order[i];
		struct pen_node_desc node = r->asset->nodes[index];

		node.parent = node.parent == PEN_NO_INDEX ? root : copy->nodes[node.parent];
		copy->nodes[index] = add_node(r, &node);
	}
}

static const double (
	*read_inverse_bind(struct pen_gltf_reading *r, const struct pen_gltf_skin *skin))[3][4]
{
	double(*to)[3][4] = pen_gltf_alloc(r, skin->joints.count, sizeof *to);
	const float *from = NULL;
	uint32_t count;

	if (skin->inverse_bind >= 0) {
		from = pen_gltf_accessor_floats(r, skin->inverse_bind, 16, PEN_GLTF_ANY, &count);
		if (!from)
			return NULL;
		if (count < skin->joints.count) {
			pen_gltf_refuse(r, "%zu joints, but %u inverse bind matrices",
				skin->joints.count, count);
			return NULL;
		}
	}
	for (size_t k = 0; to && k < skin->joints.count; k++)
		for (size_t i = 0; i < 3; i++)
			for (size_t j = 0; j < 4; j++)
				to[k][i][j] =
					from ? (double)from[16 * k + 4 * j + i] : (double)(i == j);
	return (const double(*)[3][4])to;
}

static uint32_t add_skin(struct pen_gltf_reading *r, const struct copy *copy, size_t index)
{
	const struct pen_gltf_skin *from = &r->model->skins[index];
	uint32_t *joints = pen_gltf_alloc(r, from->joints.count, sizeof *joints);
	struct pen_skin_desc skin = {.joints = joints};

	pen_gltf_at(r, "skin", index, from->name);
	if (from->joints.count == 0 || from->joints.count > UINT16_MAX) {
		pen_gltf_refuse(r, "it must have from 1 to %u joints", UINT16_MAX);
		return PEN_NO_INDEX;
	}
	for (size_t i = 0; joints && i < from->joints.count; i++) {
		const int joint = from->joints.items[i];

		if (joint < 0 || (size_t)joint >= r->model->node_count ||
			copy->nodes[joint] == PEN_NO_INDEX) {
			pen_gltf_refuse(r, "its joint %d is no node of the scene", joint);
			return PEN_NO_INDEX;
		}
		joints[i] = copy->nodes[joint];
	}
	skin.joint_count = (uint32_t)from->joints.count;
	skin.inverse_bind = read_inverse_bind(r, from);
	if (!skin.inverse_bind)
		return PEN_NO_INDEX;
	return pen_gltf_add(r, &r->skins, &skin, sizeof skin, PEN_NODES_MAX);
}

static uint32_t find_skin(struct pen_gltf_reading *r, const struct copy *copy, int index)
{
	if ((size_t)index >= r->model->skin_count) {
		pen_gltf_refuse(r, "there is no skin %d", index);
		return PEN_NO_INDEX;
	}
	if (copy->skins[index] == PEN_NO_INDEX)
		copy->skins[index] = add_skin(r, copy, (size_t)index);
	return copy->skins[index];
}

/* Joints of a vertex that pull are joints of the skin. */
static bool joints_fit(const struct pen_deform_desc *deform, uint32_t vertices, uint32_t joints)
{
	for (size_t i = 0; i < (size_t)vertices * deform->influence_count; i++)
		if (deform->joints[i] >= joints)
			return false;
	return true;
}

/* The weights that hold without a track: the node's, else the mesh's, else 0. */
static const double *find_weights(
	struct pen_gltf_reading *r, const struct pen_gltf_node *node, uint32_t count)
{
	const struct pen_gltf_numbers *own = &node->weights;
	const struct pen_gltf_numbers *from =
		own->count > 0 ? own : &r->model->meshes[node->mesh].weights;
	double *weights = pen_gltf_alloc(r, count, sizeof *weights);

	if (from->count > 0 && from->count != count) {
		pen_gltf_refuse(r, "it has %zu weights for %u morph targets", from->count, count);
		return NULL;
	}
	for (uint32_t i = 0; weights && i < from->count; i++) {
		weights[i] = from->items[i];
		if (!(fabs(weights[i]) <= PEN_SCALE_MAX)) {
			pen_gltf_refuse(r, "a weight beyond %g", PEN_SCALE_MAX);
			return NULL;
		}
	}
	return weights;
}

/* Gives a mesh that deforms what its node says of that. */
static bool set_deform(struct pen_gltf_reading *r, const struct copy *copy, size_t index,
	struct pen_object_desc *object)
{
	const struct pen_gltf_node *node = &r->model->nodes[index];
	struct pen_deform_desc *deform = pen_gltf_alloc(r, 1, sizeof *deform);

	if (!deform)
		return false;
	*deform = *object->u.mesh.deform;
	object->u.mesh.deform = deform;
	if (deform->morph_count > 0) {
		deform->morph_weights = find_weights(r, node, deform->morph_count);
		deform->weights = r->asset->weights[index];
		if (!deform->morph_weights)
			return false;
	}
	if (deform->influence_count == 0 || node->skin < 0)
		return true;
	deform->skin = find_skin(r, copy, node->skin);
	if (deform->skin == PEN_NO_INDEX)
		return false;
	if (!joints_fit(deform, object->u.mesh.vertex_count,
		    (uint32_t)r->model->skins[node->skin].joints.count)) {
		pen_gltf_refuse(r, "a vertex of its mesh %d follows a joint that its skin has not",
			node->mesh);
		return false;
	}
	object->node = PEN_NO_INDEX;
	return true;
}

static uint32_t add_object(struct pen_gltf_reading *r, const struct pen_object_desc *object)
{
	return pen_gltf_add(r, &r->objects, object, sizeof *object, PEN_OBJECTS_MAX);
}

static void add_originals(struct pen_gltf_reading *r, struct pen_gltf_shapes *shapes)
{
	shapes->first = (uint32_t)(r->objects.size / sizeof(struct pen_object_desc));
	for (uint32_t i = 0; i < shapes->count && pen_gltf_sound(r); i++)
		(void)add_object(r, &shapes->items[i]);
}

static void add_instances(struct pen_gltf_reading *r, const struct copy *copy, size_t index,
	struct pen_gltf_shapes *shapes)
{
	struct pen_object_desc instance = {
		.type = PEN_OBJECT_INSTANCE,
		.material = copy->object->material,
		.visible = true,
		.transform = {.rotate = {0, 0, 0, 1}, .scale = {1, 1, 1}},
		.node = copy->nodes[index],
	};

	if (shapes->first == PEN_NO_INDEX)
		add_originals(r, shapes);
	for (uint32_t i = 0; i < shapes->count && pen_gltf_sound(r); i++) {
		instance.u.instance.of = shapes->first + i;
		(void)add_object(r, &instance);
	}
}

static void add_mesh(struct pen_gltf_reading *r, const struct copy *copy, size_t index)
{
	const struct pen_gltf_node *node = &r->model->nodes[index];
	struct pen_gltf_shapes *shapes = pen_gltf_mesh(r, node->mesh);

	if (!shapes)
		return;
	if (!shapes->deforms && shapes->uses > 1) {
		add_instances(r, copy, index, shapes);
		return;
	}
	for (uint32_t i = 0; i < shapes->count && pen_gltf_sound(r); i++) {
		struct pen_object_desc object = shapes->items[i];

		object.visible = true;
		object.node = copy->nodes[index];
		if (copy->object->material != PEN_NO_INDEX)
			object.material = copy->object->material;
		pen_gltf_at(r, "node", index, node->name);
		if (object.u.mesh.deform && !set_deform(r, copy, index, &object))
			continue;
		(void)add_object(r, &object);
	}
}

static bool set_spot(
	struct pen_gltf_reading *r, const struct pen_gltf_light *from, struct pen_light_desc *light)
{
	if (!(from->outer_cone > 0.0 && from->outer_cone <= M_PI / 2 + 1e-6 &&
		    from->inner_cone >= 0.0 && from->inner_cone <= from->outer_cone)) {
		pen_gltf_refuse(r, "its cones must be 0 <= inner <= outer <= pi/2");
		return false;
	}
	light->u.spot.cone_angle = fmin(from->outer_cone * 360.0 / M_PI, 180.0);
	light->u.spot.blend = 1.0 - from->inner_cone / from->outer_cone;
	light->u.spot.direction[2] = -1.0;
	return true;
}

static bool set_light(
	struct pen_gltf_reading *r, const struct pen_gltf_light *from, struct pen_light_desc *light)
{
	for (size_t i = 0; i < 3; i++) {
		const double color = from->color.count == 3 ? from->color.items[i] : 1.0;

		light->color[i] = color * from->intensity / LUMENS_PER_WATT;
		if (!(light->color[i] >= 0.0 && light->color[i] <= PEN_COORDINATE_MAX)) {
			pen_gltf_refuse(r, "its color and intensity must not be negative, nor "
					   "beyond all bounds");
			return false;
		}
	}
	if (strcmp(from->type, "spot") == 0) {
		light->type = PEN_LIGHT_SPOT;
		return set_spot(r, from, light);
	}
	if (strcmp(from->type, "directional") == 0) {
		light->type = PEN_LIGHT_DIRECTIONAL;
		light->u.directional.direction[2] = -1.0;
		return true;
	}
	light->type = PEN_LIGHT_POINT;
	if (strcmp(from->type, "point") != 0)
		pen_gltf_refuse(r, "its type must be point, spot or directional");
	return strcmp(from->type, "point") == 0;
}

static void add_light(struct pen_gltf_reading *r, const struct copy *copy, size_t index)
{
	const int which = r->model->nodes[index].light;
	struct pen_light_desc light = {.node = copy->nodes[index]};

	if ((size_t)which >= r->model->light_count) {
		pen_gltf_refuse(r, "there is no light %d", which);
		return;
	}
	pen_gltf_at(r, "light", (size_t)which, r->model->lights[which].name);
	if (set_light(r, &r->model->lights[which], &light))
		(void)pen_gltf_add(r, &r->lights, &light, sizeof light, PEN_LIGHTS_MAX);
}

static void add_camera(struct pen_gltf_reading *r, const struct copy *copy, size_t index)
{
	const struct pen_gltf_node *node = &r->model->nodes[index];
	struct pen_gltf_camera_found found = {.node_name = node->name, .node = copy->nodes[index]};

	if ((size_t)node->camera >= r->model->camera_count) {
		pen_gltf_refuse(r, "there is no camera %d", node->camera);
		return;
	}
	found.camera = &r->model->cameras[node->camera];
	found.name = found.camera->name;
	(void)pen_gltf_add(r, &r->cameras, &found, sizeof found, PEN_NODES_MAX);
}

static void add_contents(struct pen_gltf_reading *r, const struct copy *copy)
{
	for (uint32_t i = 0; i < r->asset->order_count && pen_gltf_sound(r); i++) {
		const size_t index = r->asset->order[i];
		const struct pen_gltf_node *node = &r->model->nodes[index];

		pen_gltf_at(r, "node", index, node->name);
		if (node->camera >= 0)
			add_camera(r, copy, index);
		if (!copy->object->visible)
			continue;
		if (node->light >= 0)
			add_light(r, copy, index);
		pen_gltf_at(r, "node", index, node->name);
		if (node->mesh >= 0)
			add_mesh(r, copy, index);
	}
}

void pen_gltf_place(struct pen_gltf_reading *r, const struct pen_object_desc *object)
{
	struct copy copy = {
		.object = object,
		.nodes = pen_gltf_alloc(r, r->model->node_count, sizeof *copy.nodes),
		.skins = pen_gltf_alloc(r, r->model->skin_count, sizeof *copy.skins),
	};

	if (!copy.nodes || !copy.skins)
		return;
	memset(copy.skins, 0xff, r->model->skin_count * sizeof *copy.skins);
	add_nodes(r, &copy);
	if (pen_gltf_sound(r))
		add_contents(r, &copy);
}
