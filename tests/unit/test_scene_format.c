/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/format.h"

#include "core/scene/input.h"
#include "core/scene/parse.h"
#include "tests/unit/scene_text.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A scene of the members given, which must be good; the caller destroys it. */
static struct pen_scene *good(const char *members)
{
	struct pen_scene_errors errors;
	struct pen_scene *scene;
	char text[4096];

	(void)snprintf(text, sizeof text, HEAD "%s}", members);
	if (read_text(text, &scene, &errors) < 0)
		fail_msg("%s: %s %s", members, errors.items[0].pointer, errors.items[0].detail);
	return scene;
}

static void assert_vector(const double *found, double x, double y, double z)
{
	assert_true(found[0] == x && found[1] == y && found[2] == z);
}

/* Broken by a default that differs from the format's. */
static void defaults_are_the_formats(void **state)
{
	struct pen_scene *scene = good("");

	(void)state;
	assert_int_equal(scene->image.width, 8);
	assert_int_equal(scene->image.height, 4);
	assert_int_equal(scene->image.filter, PEN_FILTER_GAUSSIAN);
	assert_true(scene->image.filter_width == 3 && scene->image.exposure == 0);
	assert_int_equal(pen_rect_area(scene->image.crop), 32);
	assert_vector(scene->camera.position, 0, 2, 10);
	assert_vector(scene->camera.look_at, 0, 0, 0);
	assert_vector(scene->camera.up, 0, 1, 0);
	assert_true(scene->camera.horizontal_fov == 50 && scene->camera.aperture_radius == 0);
	assert_true(scene->camera.focus_distance == sqrt(104));
	assert_true(scene->camera.shutter_open == 0 && scene->camera.shutter_close == 0);
	assert_int_equal(scene->camera.key_count, 0);
	assert_int_equal(scene->integrator.type, PEN_INTEGRATOR_DISTRIBUTION);
	assert_int_equal(scene->integrator.max_depth, 6);
	assert_int_equal(scene->sampling.samples, 64);
	assert_int_equal(scene->sampling.sequence, PEN_SEQUENCE_SOBOL);
	assert_int_equal(scene->sampling.seed, 0);
	assert_vector(scene->background.color, 0, 0, 0);
	assert_int_equal(scene->material_count + scene->object_count + scene->light_count, 0);
	pen_scene_destroy(scene);
}

/* Broken by a filter whose default width is another's. */
static void filters_have_their_own_widths(void **state)
{
	static const struct {
		const char *name;
		enum pen_filter_type type;
		double width;
	} filters[] = {
		{"box", PEN_FILTER_BOX, 1},
		{"triangle", PEN_FILTER_TRIANGLE, 2},
		{"gaussian", PEN_FILTER_GAUSSIAN, 3},
		{"blackman-harris", PEN_FILTER_BLACKMAN_HARRIS, 3},
		{"mitchell", PEN_FILTER_MITCHELL, 4},
	};

	(void)state;
	for (size_t i = 0; i < sizeof filters / sizeof *filters; i++) {
		struct pen_scene_errors errors;
		struct pen_scene *scene;
		char text[256];

		(void)snprintf(text, sizeof text,
			"{\"version\":1,\"image\":{\"width\":1,\"height\":1,\"filter\":{\"type\":"
			"\"%s\"}}}",
			filters[i].name);
		assert_int_equal(read_text(text, &scene, &errors), 0);
		assert_int_equal(scene->image.filter, filters[i].type);
		assert_true(scene->image.filter_width == filters[i].width);
		pen_scene_destroy(scene);
	}
}

/* Broken by a member that lands in the wrong place of the description. */
static void objects_are_described(void **state)
{
	struct pen_scene *scene = good(
		",\"materials\":{\"z\":{\"type\":\"matte\",\"color\":[0.1,0.2,0.3]},"
		"\"m\":{\"type\":\"glossy\",\"roughness\":0.5},\"c\":{\"type\":\"glass\",\"ior\":1."
		"33}},"
		"\"objects\":[{\"type\":\"instance\",\"of\":\"ball\",\"material\":\"m\","
		"\"transform\":{\"translate\":[1,2,3],\"rotate\":[0,0,2,0],\"scale\":[1,-2,3]}},"
		"{\"type\":\"sphere\",\"name\":\"ball\",\"material\":\"z\",\"center\":[4,5,6],"
		"\"radius\":2,\"visible\":false,\"keyframes\":[{\"time\":0.5},{\"time\":1,"
		"\"translate\":[1,0,0]}]},"
		"{\"type\":\"mesh\",\"vertices\":[[0,0,0],[1,0,0],[0,1.0,0]],\"indices\":[0,1,2.0],"
		"\"normals\":[[0,0,1],[0,0,1],[0,0,2]],\"uvs\":[[0,0],[1,0],[0,1]]},"
		"{\"type\":\"instance\",\"of\":\"ball\"}]");
	const struct pen_object_desc *objects = scene->objects;

	(void)state;
	assert_int_equal(scene->object_count, 4);
	assert_int_equal(objects[0].type, PEN_OBJECT_INSTANCE);
	assert_int_equal(objects[0].u.instance.of, 1);
	assert_string_equal(scene->materials[objects[0].material].name, "m");
	assert_vector(objects[0].transform.translate, 1, 2, 3);
	assert_vector(objects[0].transform.rotate, 0, 0, 1);
	assert_vector(objects[0].transform.scale, 1, -2, 3);
	assert_true(objects[0].visible && objects[0].key_count == 0);

	assert_string_equal(objects[1].name, "ball");
	assert_string_equal(scene->materials[objects[1].material].name, "z");
	assert_vector(scene->materials[objects[1].material].color, 0.1, 0.2, 0.3);
	assert_vector(objects[1].u.sphere.center, 4, 5, 6);
	assert_true(objects[1].u.sphere.radius == 2 && !objects[1].visible);
	assert_int_equal(objects[1].key_count, 2);
	assert_true(objects[1].keys[0].time == 0.5);
	assert_vector(objects[1].keys[0].pose.translate, 0, 0, 0);
	assert_vector(objects[1].keys[1].pose.translate, 1, 0, 0);
	assert_vector(objects[1].keys[1].pose.scale, 1, 1, 1);
	assert_true(objects[1].keys[1].pose.rotate[3] == 1);

	assert_int_equal(objects[2].u.mesh.vertex_count, 3);
	assert_int_equal(objects[2].u.mesh.triangle_count, 1);
	assert_true(objects[2].u.mesh.vertices[7] == 1 && objects[2].u.mesh.vertices[3] == 1);
	assert_int_equal(objects[2].u.mesh.indices[2], 2);
	assert_true(objects[2].u.mesh.normals[8] == 2 && objects[2].u.mesh.uvs[5] == 1);
	assert_int_equal(objects[3].material, PEN_NO_INDEX);

	/* The mesh has the material that stands for none, behind the three named ones. */
	assert_int_equal(scene->material_count, 4);
	assert_int_equal(objects[2].material, 3);
	assert_int_equal(scene->materials[3].type, PEN_MATERIAL_MATTE);
	assert_vector(scene->materials[3].color, 0.5, 0.5, 0.5);
	pen_scene_destroy(scene);
}

/* Broken by vertices of one key that stand for another's, or by a mesh without its first shape. */
static void deforming_meshes_keep_their_keys(void **state)
{
	struct pen_scene *scene =
		good(",\"objects\":[{\"type\":\"mesh\",\"indices\":[0,1,2],\"vertices_at\":["
		     "{\"time\":0,\"vertices\":[[0,0,0],[1,0,0],[0,1,0]]},"
		     "{\"time\":1,\"vertices\":[[0,0,5],[1,0,5],[0,1,5]]}]}]");
	const struct pen_object_desc *mesh = scene->objects;

	(void)state;
	assert_int_equal(mesh->u.mesh.key_count, 2);
	assert_ptr_equal(mesh->u.mesh.vertices, mesh->u.mesh.keys[0].vertices);
	assert_true(mesh->u.mesh.keys[0].vertices[2] == 0 && mesh->u.mesh.keys[1].vertices[2] == 5);
	pen_scene_destroy(scene);
}

/* Broken by a light's member that lands in another's place; the last three are never seen. */
static void lights_are_described(void **state)
{
	struct pen_scene *scene =
		good(",\"lights\":[{\"type\":\"rectangle\",\"corner\":[1,2,3],\"edge_u\":[4,0,0],"
		     "\"edge_v\":[0,0,5],\"radiance\":[6,7,8],\"visible\":false},"
		     "{\"type\":\"triangle\",\"vertices\":[[0,0,0],[1,0,0],[0,2,0]]},"
		     "{\"type\":\"disk\",\"normal\":[0,0,-9],\"radius\":2},"
		     "{\"type\":\"sphere\",\"center\":[1,1,1],\"radius\":3},"
		     "{\"type\":\"point\",\"position\":[1,2,3],\"intensity\":[4,5,6]},"
		     "{\"type\":\"spot\",\"direction\":[3,0,4],\"cone_angle\":60,\"blend\":0.5},"
		     "{\"type\":\"directional\",\"irradiance\":[1,2,3],\"angle\":0.53}]");
	const struct pen_light_desc *lights = scene->lights;

	(void)state;
	assert_int_equal(scene->light_count, 7);
	assert_vector(lights[0].color, 6, 7, 8);
	assert_vector(lights[0].u.rectangle.corner, 1, 2, 3);
	assert_vector(lights[0].u.rectangle.edge_v, 0, 0, 5);
	assert_true(!lights[0].visible && lights[1].visible && lights[3].visible);
	assert_vector(lights[1].u.triangle.vertices[2], 0, 2, 0);
	assert_vector(lights[2].u.disk.normal, 0, 0, -1);
	assert_true(lights[2].u.disk.radius == 2 && lights[3].u.sphere.radius == 3);
	assert_vector(lights[4].u.point.position, 1, 2, 3);
	assert_vector(lights[5].u.spot.direction, 0.6, 0, 0.8);
	assert_true(lights[5].u.spot.cone_angle == 60 && lights[5].u.spot.blend == 0.5);
	assert_vector(lights[6].u.directional.direction, 0, -1, 0);
	assert_true(lights[6].u.directional.angle == 0.53);
	assert_true(!lights[4].visible && !lights[5].visible && !lights[6].visible);
	pen_scene_destroy(scene);
}

/* Broken by a key that takes what it leaves out from elsewhere than the camera. */
static void camera_keys_inherit(void **state)
{
	struct pen_scene *scene = good(
		",\"camera\":{\"keyframes\":[{\"time\":0,\"up\":[1,0,0]},{\"time\":2,\"position\":["
		"7,8,9]}],"
		"\"position\":[1,2,3],\"look_at\":[0,0,1],\"shutter\":{\"open\":-0.5},\"blades\":5,"
		"\"focal_surface\":\"sphere\"}");
	const struct pen_camera_desc *camera = &scene->camera;

	(void)state;
	assert_int_equal(camera->key_count, 2);
	assert_vector(camera->keys[0].position, 1, 2, 3);
	assert_vector(camera->keys[0].up, 1, 0, 0);
	assert_vector(camera->keys[1].position, 7, 8, 9);
	assert_vector(camera->keys[1].look_at, 0, 0, 1);
	assert_vector(camera->keys[1].up, 0, 1, 0);
	assert_true(camera->shutter_open == -0.5 && camera->shutter_close == 0);
	assert_int_equal(camera->blades, 5);
	assert_int_equal(camera->focal_surface, PEN_FOCAL_SPHERE);
	pen_scene_destroy(scene);
}

/* Broken by a texture that lands on another property, or by indices that forget the sorting. */
static void principled_materials_are_described(void **state)
{
	struct pen_scene *scene = good(
		",\"materials\":{\"p\":{\"type\":\"principled\",\"base_color\":{\"texture\":\"z\","
		"\"factor\":[1,0.5,0.25],\"uv_set\":1},\"metallic\":{\"texture\":\"a\",\"factor\":"
		"0.5,\"transform\":{\"offset\":[3,4],\"rotation\":90,\"scale\":[2,5]}},"
		"\"roughness\":{\"texture\":\"a\",\"channel\":\"a\"},\"normal\":{\"texture\":\"a\","
		"\"scale\":0.5},\"emission\":[1,2,3],\"emission_strength\":4,\"opacity\":0.5,"
		"\"clearcoat\":0.25,\"double_sided\":false},\"m\":{\"type\":\"matte\",\"color\":{"
		"\"texture\":\"a\"}}},"
		"\"textures\":{\"z\":{\"image\":\"" ASSET "\"},\"a\":{\"image\":\"" ASSET
		"\",\"color_space\":\"linear\",\"wrap_u\":\"clamp\"}}");
	const struct pen_material_desc *m = &scene->materials[0], *p = &scene->materials[1];
	const struct pen_input_desc *metallic = &p->inputs[PEN_INPUT_METALLIC];

	(void)state;
	assert_int_equal(scene->texture_count, 2);
	assert_string_equal(scene->textures[0].name, "a");
	assert_true(!scene->textures[0].is_srgb && scene->textures[1].is_srgb);
	assert_int_equal(scene->textures[0].wrap_u, PEN_WRAP_CLAMP);
	assert_int_equal(scene->textures[0].wrap_v, PEN_WRAP_REPEAT);
	assert_int_equal(m->inputs[PEN_INPUT_COLOR].texture, 0);
	assert_vector(m->color, 1, 1, 1);
	assert_true(m->opacity == 1 && !m->is_one_sided);

	assert_int_equal(p->type, PEN_MATERIAL_PRINCIPLED);
	assert_int_equal(p->inputs[PEN_INPUT_COLOR].texture, 1);
	assert_int_equal(p->inputs[PEN_INPUT_COLOR].uv_set, 1);
	assert_vector(p->color, 1, 0.5, 0.25);
	assert_true(p->metallic == 0.5 && p->roughness == 1 && p->normal_scale == 0.5);
	assert_int_equal(metallic->texture, 0);
	assert_int_equal(metallic->channel, 2);
	assert_vector(metallic->uv[0], 0, 5, 3);
	assert_vector(metallic->uv[1], -2, 0, 4);
	assert_int_equal(p->inputs[PEN_INPUT_ROUGHNESS].channel, 3);
	assert_int_equal(p->inputs[PEN_INPUT_NORMAL].texture, 0);
	assert_int_equal(p->inputs[PEN_INPUT_EMISSION].texture, PEN_NO_INDEX);
	assert_vector(p->emission, 4, 8, 12);
	assert_true(p->opacity == 0.5 && p->alpha_cutoff == 0.5 && p->is_one_sided);
	assert_int_equal(p->alpha_mode, PEN_ALPHA_BLEND);
	assert_true(p->clearcoat == 0.25 && p->ior == 1.5);
	pen_scene_destroy(scene);
}

/* Broken by a rotation that is not sine and cosine's, or that is inexact at quarter turns. */
static void textures_turn(void **state)
{
	static const double offset[] = {0, 0}, scale[] = {1, 1};
	double uv[2][3];

	(void)state;
	for (double degrees = -360; degrees <= 360; degrees += 0.37) {
		const double radians = degrees * 0.017453292519943295;

		pen_input_place(offset, degrees, scale, uv);
		assert_true(fabs(uv[0][0] - cos(radians)) < 1e-15);
		assert_true(fabs(uv[0][1] - sin(radians)) < 1e-15);
		assert_true(uv[1][0] == -uv[0][1] && uv[1][1] == uv[0][0]);
	}
	pen_input_place(offset, -270, scale, uv);
	assert_true(uv[0][0] == 0 && uv[0][1] == 1 && uv[1][0] == -1 && uv[1][1] == 0);
}

/* Broken by a mention of a file that is not entered, or under the wrong pointer. */
static void assets_are_listed_where_they_stand(void **state)
{
	struct pen_scene *scene =
		good(",\"textures\":{\"a/b\":{\"image\":\"" ASSET
		     "\"}},\"background\":{\"image\":\"" ASSET "\",\"rotation\":90}," GLTF_OBJECT);
	struct pen_sha256 digest;

	(void)state;
	assert_true(pen_sha256_parse(&ASSET[7], &digest));
	assert_int_equal(scene->asset_count, 3);
	for (uint32_t i = 0; i < scene->asset_count; i++)
		assert_true(pen_sha256_equal(&scene->assets[i].sha256, &digest));
	assert_string_equal(scene->assets[0].pointer, "/textures/a~1b/image");
	assert_string_equal(scene->assets[1].pointer, "/background/image");
	assert_string_equal(scene->assets[2].pointer, "/objects/0/asset");
	assert_int_equal(scene->picture_count, 2);
	assert_string_equal(scene->pictures[scene->textures[0].picture].pointer, "/textures/a~1b");
	assert_string_equal(scene->pictures[scene->background.picture].pointer, "/background");
	assert_int_equal(scene->pictures[scene->background.picture].asset, 1);
	assert_true(scene->background.intensity == 1 && scene->background.rotation == 90);
	assert_int_equal(scene->objects[0].type, PEN_OBJECT_GLTF);
	assert_int_equal(scene->objects[0].u.gltf.asset, 2);
	assert_int_equal(scene->objects[0].material, PEN_NO_INDEX);
	assert_int_equal(scene->material_count, 0);
	pen_scene_destroy(scene);
}

/* Broken by a camera that is completed although a glTF has it, or is not although none has. */
static void gltf_cameras_are_left_to_the_gltf(void **state)
{
	struct pen_scene *scene = good("," GLTF_OBJECT ",\"camera\":{\"aperture_radius\":1}");

	(void)state;
	assert_null(scene->camera.from);
	assert_int_equal(scene->camera.given, 0);
	assert_vector(scene->camera.position, 0, 2, 10);
	pen_scene_destroy(scene);
	scene = good("," GLTF_OBJECT ",\"camera\":{\"focus_distance\":3}");
	assert_int_equal(scene->camera.given, PEN_CAMERA_FOCUS);
	pen_scene_destroy(scene);
	scene = good("," GLTF_OBJECT ",\"camera\":{\"from\":\"Eye\",\"position\":[1,2,3]}");
	assert_string_equal(scene->camera.from, "Eye");
	assert_int_equal(scene->camera.given, PEN_CAMERA_POSITION);
	pen_scene_destroy(scene);
	scene = good("," GLTF_OBJECT ",\"camera\":{\"position\":[1,2,3]}");
	assert_int_equal(scene->camera.given, PEN_CAMERA_POSITION | PEN_CAMERA_LOOK_AT |
						      PEN_CAMERA_UP | PEN_CAMERA_FOV |
						      PEN_CAMERA_FOCUS);
	pen_scene_destroy(scene);
	scene = good("");
	assert_int_equal(scene->camera.given, PEN_CAMERA_POSITION | PEN_CAMERA_LOOK_AT |
						      PEN_CAMERA_UP | PEN_CAMERA_FOV |
						      PEN_CAMERA_FOCUS);
	assert_int_equal(scene->camera.node, PEN_NO_INDEX);
	assert_int_equal(scene->background.picture, PEN_NO_INDEX);
	pen_scene_destroy(scene);
}

/* Broken by a mode's member that lands elsewhere, or by a default that differs from the format's.
 */
static void sampling_modes_frames_and_layers_are_described(void **state)
{
	struct pen_scene *scene = good(",\"sampling\":{\"mode\":\"edge\"},"
				       "\"frames\":{\"first\":0,\"last\":24,\"fps\":25}");
	struct pen_scene_errors errors;

	(void)state;
	assert_int_equal(scene->sampling.mode, PEN_SAMPLING_EDGE);
	assert_true(scene->sampling.threshold == 0.1 && scene->sampling.samples == 64);
	assert_true(scene->frames.first == 0 && scene->frames.last == 24);
	assert_true(scene->frames.fps == 25);
	pen_scene_destroy(scene);
	scene = good(",\"sampling\":{\"mode\":\"adaptive\",\"samples\":8}");
	assert_int_equal(scene->sampling.mode, PEN_SAMPLING_ADAPTIVE);
	assert_true(scene->sampling.error == 0.01 && scene->sampling.confidence == 0.95);
	assert_int_equal(scene->sampling.min_samples, 8);
	assert_true(scene->frames.first == 1 && scene->frames.last == 1);
	pen_scene_destroy(scene);
	scene = good(",\"sampling\":{\"mode\":\"adaptive\"}");
	assert_int_equal(scene->sampling.min_samples, 16);
	assert_int_equal(scene->image.aovs, 0);
	pen_scene_destroy(scene);
	assert_int_equal(read_text("{\"version\":1,\"image\":{\"width\":1,\"height\":1,"
				   "\"aovs\":[\"samples\",\"albedo\"]}}",
				 &scene, &errors),
		0);
	assert_int_equal(scene->image.aovs, PEN_AOV_ALBEDO | PEN_AOV_SAMPLES);
	pen_scene_destroy(scene);
	scene = good(",\"sampling\":{\"mode\":\"interleaved\"}");
	assert_int_equal(scene->sampling.mode, PEN_SAMPLING_INTERLEAVED);
	assert_int_equal(scene->sampling.pattern, 3);
	pen_scene_destroy(scene);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(defaults_are_the_formats),
		cmocka_unit_test(filters_have_their_own_widths),
		cmocka_unit_test(objects_are_described),
		cmocka_unit_test(deforming_meshes_keep_their_keys),
		cmocka_unit_test(lights_are_described),
		cmocka_unit_test(camera_keys_inherit),
		cmocka_unit_test(principled_materials_are_described),
		cmocka_unit_test(textures_turn),
		cmocka_unit_test(assets_are_listed_where_they_stand),
		cmocka_unit_test(gltf_cameras_are_left_to_the_gltf),
		cmocka_unit_test(sampling_modes_frames_and_layers_are_described),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
