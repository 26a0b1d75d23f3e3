/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/format.h"

#include "core/scene/asset.h"
#include "core/scene/check.h"
#include "core/scene/mesh.h"
#include "core/scene/row.h"

/* clang-format off */
#define POSE_ROWS(type, prefix) \
	{VECTOR3("translate", type, prefix translate, world, "[0, 0, 0]")}, \
	{VECTOR4("rotate", type, prefix rotate, world, "[0, 0, 0, 1]")}, \
	{VECTOR3("scale", type, prefix scale, scale, "[1, 1, 1]")}
/* clang-format on */

static const struct pen_field transform_fields[] = {
	POSE_ROWS(pose, ),
	{0},
};
static const struct pen_field pose_key_fields[] = {
	{NUMBER("time", pose_key, time, instant, PEN_REQUIRED)},
	POSE_ROWS(pose_key, pose.),
	{0},
};
static const struct pen_table transform_table = {transform_fields, pen_check_pose};
static const struct pen_table pose_key_table = {pose_key_fields, pen_check_pose_key};
static const struct pen_list pose_keys = {sizeof(struct pen_pose_key), PEN_KEYFRAMES_MAX,
	OF(object_desc, key_count), &pose_key_table, NULL, NULL};

/* Names of other things are resolved when all are known. */
static void read_name(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	(void)desc;
	if (!json_is_string(value))
		pen_reader_refuse(reader, at, "must be a string");
}

/* clang-format off */
#define OBJECT_ROWS \
	{TEXT("name", object_desc, name, PEN_ABSENT)}, \
	{READ("material", 0, read_name, PEN_ABSENT)}, \
	{BOOLEAN("visible", object_desc, visible, "true")}, \
	{TABLE("transform", OF(object_desc, transform), transform_table, "{}")}, \
	{LIST("keyframes", object_desc, keys, pose_keys, "[]")}
/* clang-format on */

static const struct pen_field sphere_fields[] = {
	OBJECT_ROWS,
	{VECTOR3("center", object_desc, u.sphere.center, world, "[0, 0, 0]")},
	{NUMBER("radius", object_desc, u.sphere.radius, positive, "1")},
	{0},
};
static const struct pen_field mesh_fields[] = {
	OBJECT_ROWS,
	{READ("vertices", 0, pen_mesh_read_vertices, PEN_ABSENT)},
	{READ("vertices_at", 0, pen_mesh_read_keys, "[]")},
	{READ("indices", 0, pen_mesh_read_indices, PEN_REQUIRED)},
	{READ("normals", 0, pen_mesh_read_normals, "[]")},
	{READ("uvs", 0, pen_mesh_read_uvs, "[]")},
	{0},
};
static const struct pen_field instance_fields[] = {
	OBJECT_ROWS,
	{READ("of", 0, read_name, PEN_REQUIRED)},
	{0},
};
static const struct pen_field gltf_fields[] = {
	OBJECT_ROWS,
	{READ("asset", OF(object_desc, u.gltf.asset), pen_asset_read, PEN_REQUIRED)},
	{0},
};
static const struct pen_table sphere_table = {sphere_fields, pen_check_object};
static const struct pen_table mesh_table = {mesh_fields, pen_mesh_check};
static const struct pen_table instance_table = {instance_fields, pen_check_object};
static const struct pen_table gltf_table = {gltf_fields, pen_check_object};
static const struct pen_variant object_types[] = {
	{"sphere", PEN_OBJECT_SPHERE, &sphere_table},
	{"mesh", PEN_OBJECT_MESH, &mesh_table},
	{"instance", PEN_OBJECT_INSTANCE, &instance_table},
	{"gltf", PEN_OBJECT_GLTF, &gltf_table},
	{0},
};
static const struct pen_variants object = {
	"type", PEN_REQUIRED, OF(object_desc, type), object_types};
static const struct pen_object_desc blank = {.material = PEN_NO_INDEX, .node = PEN_NO_INDEX};
const struct pen_list pen_format_objects = {sizeof(struct pen_object_desc), PEN_OBJECTS_MAX,
	OF(scene, object_count), NULL, &object, &blank};
