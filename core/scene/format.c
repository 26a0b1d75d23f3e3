/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/format.h"

#include "core/scene/check.h"
#include "core/scene/mesh.h"

#include <stdlib.h>
#include <string.h>

#define OF(type, member) offsetof(struct pen_##type, member)

/* Ranges */
static const struct pen_range world = {-PEN_COORDINATE_MAX, PEN_COORDINATE_MAX};
static const struct pen_range positive = {1e-15, PEN_COORDINATE_MAX};
static const struct pen_range magnitude = {0, PEN_COORDINATE_MAX};
static const struct pen_range unit = {0, 1};
static const struct pen_range half_turn = {0, 180};
static const struct pen_range turn = {-360, 360};
static const struct pen_range instant = {-PEN_TIME_MAX, PEN_TIME_MAX};
static const struct pen_range scale = {-PEN_SCALE_MAX, PEN_SCALE_MAX};
static const struct pen_range pixels = {1, PEN_IMAGE_SIDE_MAX};
static const struct pen_range support = {0.01, PEN_FILTER_WIDTH_MAX};
static const struct pen_range stops = {-64, 64};
static const struct pen_range field_of_view = {0.01, 179};
static const struct pen_range blades = {0, PEN_BLADES_MAX};
static const struct pen_range depth = {1, PEN_DEPTH_MAX};
static const struct pen_range whitted_depth = {1, PEN_WHITTED_DEPTH_MAX};
static const struct pen_range sample_count = {1, PEN_SAMPLES_MAX};
static const struct pen_range any_seed = {0, UINT32_MAX};
static const struct pen_range refraction = {0.1, 10};
static const struct pen_range cone = {0.01, 180};

/* Rows; the default comes last. */
#define ROW(key_, kind_, offset_, fallback_)                                                       \
	.key = (key_), .kind = PEN_KIND_##kind_, .offset = (offset_), .fallback = (fallback_)
#define NUMBER(key, type, member, range_, fallback)                                                \
	ROW(key, NUMBER, OF(type, member), fallback), .range = &range_
#define INTEGER(key, type, member, range_, fallback)                                               \
	ROW(key, INTEGER, OF(type, member), fallback), .range = &range_
#define VECTOR3(key, type, member, range_, fallback)                                               \
	ROW(key, VECTOR3, OF(type, member), fallback), .range = &range_
#define VECTOR4(key, type, member, range_, fallback)                                               \
	ROW(key, VECTOR4, OF(type, member), fallback), .range = &range_
#define BOOLEAN(key, type, member, fallback) ROW(key, BOOLEAN, OF(type, member), fallback)
#define TEXT(key, type, member, fallback)    ROW(key, TEXT, OF(type, member), fallback)
#define CHOICE(key, type, member, choices_, fallback)                                              \
	ROW(key, CHOICE, OF(type, member), fallback), .choices = choices_
#define TABLE(key, offset, table_, fallback) ROW(key, TABLE, offset, fallback), .table = &table_
#define VARIANT(key, offset, variants_, fallback)                                                  \
	ROW(key, VARIANT, offset, fallback), .variants = &variants_
#define LIST(key, type, member, list_, fallback)                                                   \
	ROW(key, LIST, OF(type, member), fallback), .list = &list_
#define READ(key, offset, read_, fallback) ROW(key, READ, offset, fallback), .read = read_
#define LATER(key)			   ROW(key, LATER, 0, PEN_ABSENT)

/* Image */

static const struct pen_field box_fields[] = {
	{NUMBER("width", image_desc, filter_width, support, "1")},
	{0},
};
static const struct pen_field triangle_filter_fields[] = {
	{NUMBER("width", image_desc, filter_width, support, "2")},
	{0},
};
static const struct pen_field gaussian_fields[] = {
	{NUMBER("width", image_desc, filter_width, support, "3")},
	{0},
};
static const struct pen_field mitchell_fields[] = {
	{NUMBER("width", image_desc, filter_width, support, "4")},
	{0},
};
static const struct pen_table box_table = {box_fields, NULL};
static const struct pen_table triangle_filter_table = {triangle_filter_fields, NULL};
static const struct pen_table gaussian_table = {gaussian_fields, NULL};
static const struct pen_table mitchell_table = {mitchell_fields, NULL};
static const struct pen_variant filter_types[] = {
	{"box", PEN_FILTER_BOX, &box_table},
	{"triangle", PEN_FILTER_TRIANGLE, &triangle_filter_table},
	{"gaussian", PEN_FILTER_GAUSSIAN, &gaussian_table},
	{"blackman-harris", PEN_FILTER_BLACKMAN_HARRIS, &gaussian_table},
	{"mitchell", PEN_FILTER_MITCHELL, &mitchell_table},
	{0},
};
static const struct pen_variants filter = {
	"type", "gaussian", OF(image_desc, filter), filter_types};

static void read_crop(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	static const struct pen_range edge = {0, PEN_IMAGE_SIDE_MAX};
	struct pen_rect *crop = desc;
	uint32_t *edges[] = {&crop->x0, &crop->y0, &crop->x1, &crop->y1};

	if (!json_is_array(value) || json_array_size(value) != 4) {
		pen_reader_refuse(reader, at, "must be an array of 4 whole numbers");
		return;
	}
	for (size_t i = 0; i < 4; i++) {
		struct pen_place element = pen_place_element(at, i);

		(void)pen_integer_read(reader, &element, json_array_get(value, i), edge, edges[i]);
	}
}

static void read_aovs(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	(void)desc;
	if (!json_is_array(value))
		pen_reader_refuse(reader, at, "must be an array");
	else if (json_array_size(value) > 0)
		pen_reader_refuse(reader, at, "not supported yet");
}

static const struct pen_field image_fields[] = {
	{INTEGER("width", image_desc, width, pixels, PEN_REQUIRED)},
	{INTEGER("height", image_desc, height, pixels, PEN_REQUIRED)},
	{VARIANT("filter", 0, filter, "{}")},
	{READ("crop", OF(image_desc, crop), read_crop, PEN_ABSENT)},
	{NUMBER("exposure", image_desc, exposure, stops, "0")},
	{READ("aovs", 0, read_aovs, "[]")},
	{0},
};
static const struct pen_table image_table = {image_fields, pen_check_image};

/* Camera */

static const struct pen_field shutter_fields[] = {
	{NUMBER("open", camera_desc, shutter_open, instant, "0")},
	{NUMBER("close", camera_desc, shutter_close, instant, "0")},
	{0},
};
static const struct pen_table shutter_table = {shutter_fields, pen_check_shutter};

static const struct pen_field camera_key_fields[] = {
	{NUMBER("time", camera_key, time, instant, PEN_REQUIRED)},
	{VECTOR3("position", camera_key, position, world, PEN_ABSENT)},
	{VECTOR3("look_at", camera_key, look_at, world, PEN_ABSENT)},
	{VECTOR3("up", camera_key, up, world, PEN_ABSENT)},
	{0},
};
static const struct pen_table camera_key_table = {camera_key_fields, NULL};
static const struct pen_list camera_keys = {sizeof(struct pen_camera_key), PEN_KEYFRAMES_MAX,
	OF(camera_desc, key_count), &camera_key_table, NULL};

static const struct pen_variant focal_surfaces[] = {
	{"plane", PEN_FOCAL_PLANE, NULL},
	{"sphere", PEN_FOCAL_SPHERE, NULL},
	{0},
};

static const struct pen_field camera_fields[] = {
	{LATER("from")},
	{VECTOR3("position", camera_desc, position, world, "[0, 2, 10]")},
	{VECTOR3("look_at", camera_desc, look_at, world, "[0, 0, 0]")},
	{VECTOR3("up", camera_desc, up, world, "[0, 1, 0]")},
	{NUMBER("horizontal_fov", camera_desc, horizontal_fov, field_of_view, "50")},
	{NUMBER("aperture_radius", camera_desc, aperture_radius, magnitude, "0")},
	{NUMBER("focus_distance", camera_desc, focus_distance, positive, PEN_ABSENT)},
	{CHOICE("focal_surface", camera_desc, focal_surface, focal_surfaces, "\"plane\"")},
	{INTEGER("blades", camera_desc, blades, blades, "0")},
	{NUMBER("blade_rotation", camera_desc, blade_rotation, turn, "0")},
	{TABLE("shutter", 0, shutter_table, PEN_ABSENT)},
	{LIST("keyframes", camera_desc, keys, camera_keys, "[]")},
	{0},
};
static const struct pen_table camera_table = {camera_fields, pen_check_camera};

/* Integrator, sampling, background */

static const struct pen_field integrator_fields[] = {
	{INTEGER("max_depth", integrator_desc, max_depth, depth, "6")},
	{0},
};
static const struct pen_field whitted_fields[] = {
	{INTEGER("max_depth", integrator_desc, max_depth, whitted_depth, "6")},
	{0},
};
static const struct pen_table integrator_table = {integrator_fields, NULL};
static const struct pen_table whitted_table = {whitted_fields, NULL};
static const struct pen_variant integrator_types[] = {
	{"distribution", PEN_INTEGRATOR_DISTRIBUTION, &integrator_table},
	{"whitted", PEN_INTEGRATOR_WHITTED, &whitted_table},
	{"path", PEN_INTEGRATOR_PATH, &integrator_table},
	{0},
};
static const struct pen_variants integrator = {
	"type", "distribution", OF(integrator_desc, type), integrator_types};

static const struct pen_variant sequences[] = {
	{"sobol", PEN_SEQUENCE_SOBOL, NULL},
	{"jittered", PEN_SEQUENCE_JITTERED, NULL},
	{"random", PEN_SEQUENCE_RANDOM, NULL},
	{0},
};
static const struct pen_field uniform_fields[] = {
	{INTEGER("samples", sampling_desc, samples, sample_count, "64")},
	{CHOICE("sequence", sampling_desc, sequence, sequences, "\"sobol\"")},
	{INTEGER("seed", sampling_desc, seed, any_seed, "0")},
	{LATER("threshold")},
	{LATER("error")},
	{LATER("confidence")},
	{LATER("min_samples")},
	{LATER("pattern")},
	{0},
};
static const struct pen_table uniform_table = {uniform_fields, NULL};
static const struct pen_variant sampling_modes[] = {
	{"uniform", 0, &uniform_table},
	{"edge", 0, NULL},
	{"adaptive", 0, NULL},
	{"interleaved", 0, NULL},
	{0},
};
static const struct pen_variants sampling = {"mode", "uniform", PEN_NOWHERE, sampling_modes};

static const struct pen_field background_fields[] = {
	{VECTOR3("color", scene, background.color, magnitude, "[0, 0, 0]")},
	{LATER("image")},
	{LATER("intensity")},
	{LATER("rotation")},
	{0},
};
static const struct pen_table background_table = {background_fields, NULL};

/* Materials */

static const struct pen_field matte_fields[] = {
	{VECTOR3("color", material_desc, color, unit, "[0.5, 0.5, 0.5]")},
	{0},
};
static const struct pen_field glossy_fields[] = {
	{VECTOR3("color", material_desc, color, unit, "[0.8, 0.8, 0.8]")},
	{NUMBER("roughness", material_desc, roughness, unit, "0.25")},
	{0},
};
static const struct pen_field glass_fields[] = {
	{VECTOR3("color", material_desc, color, unit, "[1, 1, 1]")},
	{NUMBER("ior", material_desc, ior, refraction, "1.5")},
	{NUMBER("roughness", material_desc, roughness, unit, "0")},
	{0},
};
static const struct pen_table matte_table = {matte_fields, NULL};
static const struct pen_table glossy_table = {glossy_fields, NULL};
static const struct pen_table glass_table = {glass_fields, NULL};
static const struct pen_variant material_types[] = {
	{"matte", PEN_MATERIAL_MATTE, &matte_table},
	{"glossy", PEN_MATERIAL_GLOSSY, &glossy_table},
	{"glass", PEN_MATERIAL_GLASS, &glass_table},
	{"principled", 0, NULL},
	{0},
};
static const struct pen_variants material = {
	"type", PEN_REQUIRED, OF(material_desc, type), material_types};

static int by_name(const void *a, const void *b)
{
	return strcmp(((const struct pen_material_desc *)a)->name,
		((const struct pen_material_desc *)b)->name);
}

/* Materials stand sorted by name, so that the order of the text does not matter. */
static void read_materials(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	struct pen_scene *scene = desc;
	struct pen_material_desc *materials;
	size_t count = json_object_size(value), i = 0;
	const char *name;
	json_t *element;

	if (!json_is_object(value)) {
		pen_reader_refuse(reader, at, "must be an object");
		return;
	}
	/* One more than there are: the one of objects without a material. */
	materials = pen_reader_alloc(reader, count + 1, sizeof *materials);
	if (!materials)
		return;
	json_object_foreach (value, name, element) {
		struct pen_place place = {at, name, i};

		materials[i].name = pen_reader_text(reader, name);
		if (!materials[i].name)
			return;
		pen_variant_read(reader, &place, element, &material, &materials[i]);
		i++;
	}
	qsort(materials, count, sizeof *materials, by_name);
	scene->materials = materials;
	scene->material_count = (uint32_t)count;
}

/* Objects */

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
	OF(object_desc, key_count), &pose_key_table, NULL};

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
static const struct pen_table sphere_table = {sphere_fields, pen_check_object};
static const struct pen_table mesh_table = {mesh_fields, pen_mesh_check};
static const struct pen_table instance_table = {instance_fields, pen_check_object};
static const struct pen_variant object_types[] = {
	{"sphere", PEN_OBJECT_SPHERE, &sphere_table},
	{"mesh", PEN_OBJECT_MESH, &mesh_table},
	{"instance", PEN_OBJECT_INSTANCE, &instance_table},
	{"gltf", 0, NULL},
	{0},
};
static const struct pen_variants object = {
	"type", PEN_REQUIRED, OF(object_desc, type), object_types};
static const struct pen_list objects = {
	sizeof(struct pen_object_desc), PEN_OBJECTS_MAX, OF(scene, object_count), NULL, &object};

/* Lights */

static void read_corners(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	double(*vertices)[3] = desc;

	if (!json_is_array(value) || json_array_size(value) != 3) {
		pen_reader_refuse(reader, at, "must be an array of 3 points");
		return;
	}
	for (size_t i = 0; i < 3; i++) {
		struct pen_place element = pen_place_element(at, i);

		(void)pen_vector_read(
			reader, &element, json_array_get(value, i), 3, world, vertices[i]);
	}
}

/* clang-format off */
#define AREA_ROWS \
	{VECTOR3("radiance", light_desc, color, magnitude, "[1, 1, 1]")}, \
	{BOOLEAN("visible", light_desc, visible, "true")}
/* clang-format on */

static const struct pen_field rectangle_fields[] = {
	AREA_ROWS,
	{VECTOR3("corner", light_desc, u.rectangle.corner, world, "[0, 0, 0]")},
	{VECTOR3("edge_u", light_desc, u.rectangle.edge_u, world, "[1, 0, 0]")},
	{VECTOR3("edge_v", light_desc, u.rectangle.edge_v, world, "[0, 0, 1]")},
	{0},
};
static const struct pen_field triangle_fields[] = {
	AREA_ROWS,
	{READ("vertices", OF(light_desc, u.triangle.vertices), read_corners,
		"[[0, 0, 0], [1, 0, 0], [0, 0, 1]]")},
	{0},
};
static const struct pen_field disk_fields[] = {
	AREA_ROWS,
	{VECTOR3("center", light_desc, u.disk.center, world, "[0, 0, 0]")},
	{VECTOR3("normal", light_desc, u.disk.normal, world, "[0, -1, 0]")},
	{NUMBER("radius", light_desc, u.disk.radius, positive, "1")},
	{0},
};
static const struct pen_field ball_fields[] = {
	AREA_ROWS,
	{VECTOR3("center", light_desc, u.sphere.center, world, "[0, 0, 0]")},
	{NUMBER("radius", light_desc, u.sphere.radius, positive, "1")},
	{0},
};
static const struct pen_field point_fields[] = {
	{VECTOR3("intensity", light_desc, color, magnitude, "[1, 1, 1]")},
	{VECTOR3("position", light_desc, u.point.position, world, "[0, 0, 0]")},
	{0},
};
static const struct pen_field spot_fields[] = {
	{VECTOR3("intensity", light_desc, color, magnitude, "[1, 1, 1]")},
	{VECTOR3("position", light_desc, u.spot.position, world, "[0, 0, 0]")},
	{VECTOR3("direction", light_desc, u.spot.direction, world, "[0, -1, 0]")},
	{NUMBER("cone_angle", light_desc, u.spot.cone_angle, cone, "30")},
	{NUMBER("blend", light_desc, u.spot.blend, unit, "0")},
	{0},
};
static const struct pen_field directional_fields[] = {
	{VECTOR3("irradiance", light_desc, color, magnitude, "[1, 1, 1]")},
	{VECTOR3("direction", light_desc, u.directional.direction, world, "[0, -1, 0]")},
	{NUMBER("angle", light_desc, u.directional.angle, half_turn, "0")},
	{0},
};
static const struct pen_table rectangle_table = {rectangle_fields, pen_check_rectangle};
static const struct pen_table triangle_table = {triangle_fields, pen_check_triangle};
static const struct pen_table disk_table = {disk_fields, pen_check_disk};
static const struct pen_table ball_table = {ball_fields, NULL};
static const struct pen_table point_table = {point_fields, NULL};
static const struct pen_table spot_table = {spot_fields, pen_check_spot};
static const struct pen_table directional_table = {directional_fields, pen_check_directional};
static const struct pen_variant light_types[] = {
	{"rectangle", PEN_LIGHT_RECTANGLE, &rectangle_table},
	{"triangle", PEN_LIGHT_TRIANGLE, &triangle_table},
	{"disk", PEN_LIGHT_DISK, &disk_table},
	{"sphere", PEN_LIGHT_SPHERE, &ball_table},
	{"point", PEN_LIGHT_POINT, &point_table},
	{"spot", PEN_LIGHT_SPOT, &spot_table},
	{"directional", PEN_LIGHT_DIRECTIONAL, &directional_table},
	{0},
};
static const struct pen_variants light = {"type", PEN_REQUIRED, OF(light_desc, type), light_types};
static const struct pen_list lights = {
	sizeof(struct pen_light_desc), PEN_LIGHTS_MAX, OF(scene, light_count), NULL, &light};

/* The scene */

static void read_version(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	static const struct pen_range only = {1, 1};
	uint32_t version;

	(void)desc;
	(void)pen_integer_read(reader, at, value, only, &version);
}

static const struct pen_field scene_fields[] = {
	{READ("version", 0, read_version, PEN_REQUIRED)},
	{TABLE("image", OF(scene, image), image_table, PEN_REQUIRED)},
	{TABLE("camera", OF(scene, camera), camera_table, "{}")},
	{VARIANT("integrator", OF(scene, integrator), integrator, "{}")},
	{VARIANT("sampling", OF(scene, sampling), sampling, "{}")},
	{TABLE("background", 0, background_table, "{}")},
	{LATER("textures")},
	{READ("materials", 0, read_materials, "{}")},
	{LIST("objects", scene, objects, objects, "[]")},
	{LIST("lights", scene, lights, lights, "[]")},
	{LATER("frames")},
	{0},
};
const struct pen_table pen_format_scene = {scene_fields, NULL};
