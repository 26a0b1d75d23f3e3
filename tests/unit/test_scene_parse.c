/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/parse.h"

#include "core/base/buf.h"
#include "core/base/limits.h"
#include "core/scene/canonical.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#define HEAD "{\"version\":1,\"image\":{\"width\":8,\"height\":4}"

/* Reads a scene text; the caller destroys *ret_scene, which is NULL after a failure. */
static int read_text(
	const char *text, struct pen_scene **ret_scene, struct pen_scene_errors *ret_errors)
{
	struct pen_error err = PEN_ERROR_INIT;
	json_t *tree = NULL;
	int r;

	*ret_scene = NULL;
	if (pen_json_parse(text, strlen(text), &tree, &err) < 0)
		fail_msg("%s: %s", text, err.text);
	r = pen_scene_parse(tree, ret_scene, ret_errors, &err);
	json_decref(tree);
	assert_true((r == 0) == (ret_errors->count == 0));
	assert_true((r == 0) == (*ret_scene != NULL));
	return r;
}

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

struct offence {
	const char *members; /* behind HEAD */
	const char *pointer, *detail;
};

#define KEYS(a, b)                                                                                 \
	",\"objects\":[{\"type\":\"sphere\",\"keyframes\":[{\"time\":0," a "},{\"time\":1," b "}]" \
	"}]"
#define MESH(more)                                                                                 \
	",\"objects\":[{\"type\":\"mesh\",\"vertices\":[[0,0,0],[1,0,0],[0,1,0]]," more "}]"
#define LIGHT(type, more) ",\"lights\":[{\"type\":\"" type "\"," more "}]"

static const struct offence offences[] = {
	/* Keys and types */
	{",\"colour\":1", "/colour", "unknown key"},
	{",\"camera\":{\"focus_distanse\":1}", "/camera/focus_distanse",
		"did you mean \"focus_distance\"?"},
	{",\"camera\":{\"a/b~c\":1}", "/camera/a~1b~0c", "unknown key"},
	{",\"camera\":[]", "/camera", "must be an object"},
	{",\"camera\":{\"position\":[0,1]}", "/camera/position", "array of 3 numbers"},
	{",\"camera\":{\"position\":[0,1,\"2\"]}", "/camera/position/2", "must be a number"},
	{",\"camera\":{\"focal_surface\":\"cube\"}", "/camera/focal_surface", "plane, sphere"},
	{",\"objects\":{}", "/objects", "must be an array"},
	{",\"objects\":[7]", "/objects/0", "must be an object"},
	{",\"objects\":[{}]", "/objects/0/type", "is missing"},
	{",\"objects\":[{\"type\":\"cone\"}]", "/objects/0/type", "sphere, mesh, instance"},
	{",\"objects\":[{\"type\":\"sphere\",\"visible\":0}]", "/objects/0/visible",
		"true or false"},
	{",\"objects\":[{\"type\":\"sphere\",\"name\":1}]", "/objects/0/name", "string"},
	{",\"objects\":[{\"type\":\"sphere\",\"keyframes\":[{}]}]", "/objects/0/keyframes/0/time",
		"is missing"},
	{",\"materials\":[]", "/materials", "must be an object"},
	{",\"lights\":[{\"type\":\"point\",\"visible\":true}]", "/lights/0/visible", "unknown key"},
	{",\"sampling\":{\"samples\":1.5}", "/sampling/samples", "whole number"},
	{",\"sampling\":{\"seed\":-1}", "/sampling/seed", "from 0 to 4294967295"},

	/* Of the format, but not offered yet */
	{",\"textures\":{}", "/textures", "not supported yet"},
	{",\"frames\":{}", "/frames", "not supported yet"},
	{",\"camera\":{\"from\":\"x\"}", "/camera/from", "not supported yet"},
	{",\"background\":{\"image\":\"x\"}", "/background/image", "not supported yet"},
	{",\"background\":{\"intensity\":1}", "/background/intensity", "not supported yet"},
	{",\"background\":{\"rotation\":1}", "/background/rotation", "not supported yet"},
	{",\"sampling\":{\"mode\":\"edge\"}", "/sampling/mode", "not supported yet"},
	{",\"sampling\":{\"mode\":\"adaptive\"}", "/sampling/mode", "not supported yet"},
	{",\"sampling\":{\"mode\":\"interleaved\"}", "/sampling/mode", "not supported yet"},
	{",\"sampling\":{\"threshold\":0.1}", "/sampling/threshold", "not supported yet"},
	{",\"materials\":{\"a\":{\"type\":\"principled\"}}", "/materials/a/type",
		"not supported yet"},
	{",\"objects\":[{\"type\":\"gltf\"}]", "/objects/0/type", "not supported yet"},

	/* Camera */
	{",\"camera\":{\"position\":[1,2,3],\"look_at\":[1,2,3]}", "/camera/look_at", "differ"},
	{",\"camera\":{\"position\":[0,0,0]}", "/camera/look_at", "differ"},
	{",\"camera\":{\"position\":[0,0,1e-20]}", "/camera/look_at", "differ"},
	{",\"camera\":{\"position\":[0,5,0]}", "/camera/up", "along the view"},
	{",\"camera\":{\"up\":[0,0,0]}", "/camera/up", "zero"},
	{",\"camera\":{\"focus_distance\":0}", "/camera/focus_distance", "from 1e-15"},
	{",\"camera\":{\"horizontal_fov\":180}", "/camera/horizontal_fov", "to 179"},
	{",\"camera\":{\"aperture_radius\":-1}", "/camera/aperture_radius", "from 0"},
	{",\"camera\":{\"blades\":1}", "/camera/blades", "3 and more"},
	{",\"camera\":{\"blades\":2}", "/camera/blades", "3 and more"},
	{",\"camera\":{\"shutter\":{\"open\":1,\"close\":0.5}}", "/camera/shutter/close", "before"},
	{",\"camera\":{\"keyframes\":[{\"time\":0,\"look_at\":[0,2,10]}]}",
		"/camera/keyframes/0/look_at", "differ"},
	{",\"camera\":{\"keyframes\":[{\"time\":0},{\"time\":0}]}", "/camera/keyframes/1/time",
		"later"},
	{",\"camera\":{\"look_at\":[0,2,0],\"keyframes\":[{\"time\":0},{\"time\":1,\"look_at\":[0,"
	 "2,20]}]}",
		"/camera/keyframes/1", "180 degrees"},

	/* Objects */
	{",\"objects\":[{\"type\":\"sphere\",\"radius\":0}]", "/objects/0/radius", "from 1e-15"},
	{",\"objects\":[{\"type\":\"sphere\",\"radius\":-1}]", "/objects/0/radius", "from 1e-15"},
	{",\"objects\":[{\"type\":\"sphere\",\"material\":\"m\"}]", "/objects/0/material",
		"names no material"},
	{",\"objects\":[{\"type\":\"sphere\",\"name\":\"a\"},{\"type\":\"sphere\",\"name\":\"a\"}]",
		"/objects/1/name", "earlier"},
	{",\"objects\":[{\"type\":\"instance\"}]", "/objects/0/of", "is missing"},
	{",\"objects\":[{\"type\":\"instance\",\"of\":\"x\"}]", "/objects/0/of", "names no object"},
	{",\"objects\":[{\"type\":\"sphere\",\"name\":\"s\"},{\"type\":\"instance\",\"of\":\"s\","
	 "\"name\":\"i\"},{\"type\":\"instance\",\"of\":\"i\"}]",
		"/objects/2/of", "instance"},
	{",\"objects\":[{\"type\":\"instance\",\"of\":\"i\",\"name\":\"i\"}]", "/objects/0/of",
		"instance"},
	{",\"objects\":[{\"type\":\"sphere\",\"transform\":{\"scale\":[1,0,1]}}]",
		"/objects/0/transform/scale", "smaller"},
	{",\"objects\":[{\"type\":\"sphere\",\"transform\":{\"rotate\":[0,0,0,0]}}]",
		"/objects/0/transform/rotate", "zero"},
	{",\"objects\":[{\"type\":\"sphere\",\"transform\":{\"rotate\":[0,1e-162,0,0]}}]",
		"/objects/0/transform/rotate", "zero"},
	{KEYS("\"scale\":[1,1,1]", "\"scale\":[0,1,1]"), "/objects/0/keyframes/1/scale", "smaller"},
	{KEYS("\"scale\":[1,1,1]", "\"scale\":[1,1,-1]"), "/objects/0/keyframes/1/scale", "sign"},
	{KEYS("\"rotate\":[0,0,0,1]", "\"rotate\":[0,5,0,0]"), "/objects/0/keyframes/1/rotate",
		"180 degrees"},
	{KEYS("\"rotate\":[0,0,0,1]", "\"rotate\":[0,1,0,-1e-7]"), "/objects/0/keyframes/1/rotate",
		"180 degrees"},
	{KEYS("\"rotate\":[0,0,0,0]", "\"rotate\":[0,1,0,0]"), "/objects/0/keyframes/0/rotate",
		"zero"},
	{",\"objects\":[{\"type\":\"sphere\",\"keyframes\":[{\"time\":1},{\"time\":0.5}]}]",
		"/objects/0/keyframes/1/time", "later"},

	/* Meshes */
	{",\"objects\":[{\"type\":\"mesh\",\"indices\":[0,1,2]}]", "/objects/0/vertices",
		"missing"},
	{MESH("\"name\":\"m\""), "/objects/0/indices", "is missing"},
	{MESH("\"indices\":[0,1,3]"), "/objects/0/indices/2", "number of vertices, 3"},
	{MESH("\"indices\":[0,1,-1]"), "/objects/0/indices/2", "from 0"},
	{MESH("\"indices\":[0,1,0.5]"), "/objects/0/indices/2", "whole number"},
	{MESH("\"indices\":[0,1,1e300]"), "/objects/0/indices/2", "from 0"},
	{MESH("\"indices\":[0,1,2,0]"), "/objects/0/indices", "three"},
	{MESH("\"indices\":[]"), "/objects/0/indices", "three"},
	{MESH("\"indices\":[0,1,2],\"normals\":[[0,0,1]]"), "/objects/0/normals", "3 vertices"},
	{MESH("\"indices\":[0,1,2],\"normals\":[[0,0,1],[0,0,0],[0,0,1]]"), "/objects/0/normals/1",
		"zero"},
	{MESH("\"indices\":[0,1,2],\"uvs\":[[0,0],[0,1]]"), "/objects/0/uvs", "3 vertices"},
	{MESH("\"indices\":[0,1,2],\"vertices_at\":[{\"time\":0,\"vertices\":[[0,0,0]]}]"),
		"/objects/0/vertices_at/0/vertices", "3 vertices"},
	{",\"objects\":[{\"type\":\"mesh\",\"indices\":[0,0,0],\"vertices_at\":[{\"time\":0,"
	 "\"vertices\":[[0,0,0]]},{\"time\":1,\"vertices\":[[0,0,0],[1,1,1]]}]}]",
		"/objects/0/vertices_at/1/vertices", "1 vertices"},
	{",\"objects\":[{\"type\":\"mesh\",\"indices\":[0,0,0],\"vertices_at\":[{\"time\":0,"
	 "\"vertices\":[[0,0,0]]},{\"time\":0,\"vertices\":[[0,0,0]]}]}]",
		"/objects/0/vertices_at/1/time", "later"},
	{",\"objects\":[{\"type\":\"mesh\",\"indices\":[0,0,0],\"vertices\":[]}]",
		"/objects/0/vertices", "empty"},
	{",\"objects\":[{\"type\":\"mesh\",\"indices\":[0,0,0],\"vertices\":[[0,1e16,0]]}]",
		"/objects/0/vertices/0/1", "to 1e+15"},

	/* Lights */
	{LIGHT("rectangle", "\"edge_u\":[0,0,0]"), "/lights/0/edge_u", "zero"},
	{LIGHT("rectangle", "\"edge_v\":[0,0,0]"), "/lights/0/edge_v", "zero"},
	{LIGHT("rectangle", "\"edge_v\":[1,0,1]"), "/lights/0/edge_v", "two triangle lights"},
	{LIGHT("triangle", "\"vertices\":[[0,0,0],[1,1,1],[3,3,3]]"), "/lights/0/vertices",
		"one line"},
	{LIGHT("triangle", "\"vertices\":[[0,0,0],[1,1,1]]"), "/lights/0/vertices", "3 points"},
	{LIGHT("disk", "\"normal\":[0,0,0]"), "/lights/0/normal", "zero"},
	{LIGHT("disk", "\"radius\":0"), "/lights/0/radius", "from 1e-15"},
	{LIGHT("sphere", "\"radius\":-1"), "/lights/0/radius", "from 1e-15"},
	{LIGHT("sphere", "\"radiance\":[1,-1,1]"), "/lights/0/radiance/1", "from 0"},
	{LIGHT("spot", "\"direction\":[0,0,0]"), "/lights/0/direction", "zero"},
	{LIGHT("spot", "\"cone_angle\":181"), "/lights/0/cone_angle", "to 180"},
	{LIGHT("directional", "\"direction\":[0,0,0]"), "/lights/0/direction", "zero"},

	/* Materials */
	{",\"materials\":{\"m\":{\"type\":\"matte\",\"color\":[0,2,0]}}", "/materials/m/color/1",
		"from 0 to 1"},
	{",\"materials\":{\"m\":{\"type\":\"glossy\",\"roughness\":-1}}", "/materials/m/roughness",
		"from 0 to 1"},
	{",\"materials\":{\"m\":{\"type\":\"matte\",\"ior\":1.5}}", "/materials/m/ior",
		"unknown key"},
};

/* Broken by a bad scene that is taken, by the wrong culprit, by a second one, or by a slow answer.
 */
static void each_offence_is_named(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof offences / sizeof *offences; i++) {
		struct pen_scene_errors errors;
		struct pen_scene *scene;
		clock_t start = clock();
		char text[1024];

		(void)snprintf(text, sizeof text, HEAD "%s}", offences[i].members);
		if (read_text(text, &scene, &errors) != PEN_EINVALID)
			fail_msg("%s was taken", offences[i].members);
		if (errors.count != 1 ||
			strcmp(errors.items[0].pointer, offences[i].pointer) != 0 ||
			!strstr(errors.items[0].detail, offences[i].detail))
			fail_msg("%s gives %zu, first at \"%s\": %s", offences[i].members,
				errors.count, errors.items[0].pointer, errors.items[0].detail);
		assert_in_range(clock() - start, 0, CLOCKS_PER_SEC / 20);
	}
}

/* Whole texts, for what stands in HEAD above. */
static void each_offence_of_the_image_is_named(void **state)
{
	static const struct offence images[] = {
		{"[]", "", "must be an object"},
		{"{}", "/version", "is missing"},
		{"{\"version\":1}", "/image", "is missing"},
		{"{\"version\":2,\"image\":{\"width\":1,\"height\":1}}", "/version", "must be 1"},
		{"{\"version\":\"1\",\"image\":{\"width\":1,\"height\":1}}", "/version",
			"whole number"},
		{"{\"version\":1,\"image\":{\"width\":0,\"height\":1}}", "/image/width", "from 1"},
		{"{\"version\":1,\"image\":{\"height\":1}}", "/image/width", "is missing"},
		{"{\"version\":1,\"image\":{\"width\":1000000000,\"height\":1}}", "/image/width",
			"16384"},
		{"{\"version\":1,\"image\":{\"width\":16384,\"height\":16384}}", "/image",
			"134217728 pixels"},
		{"{\"version\":1,\"image\":{\"width\":4,\"height\":4,\"crop\":[0,0,5,4]}}",
			"/image/crop", "within"},
		{"{\"version\":1,\"image\":{\"width\":4,\"height\":4,\"crop\":[2,0,2,4]}}",
			"/image/crop", "rectangle"},
		{"{\"version\":1,\"image\":{\"width\":4,\"height\":4,\"crop\":[0,0,1.5,4]}}",
			"/image/crop/2", "whole number"},
		{"{\"version\":1,\"image\":{\"width\":4,\"height\":4,\"filter\":{\"width\":0}}}",
			"/image/filter/width", "from 0.01"},
		{"{\"version\":1,\"image\":{\"width\":4,\"height\":4,\"aovs\":[\"depth\"]}}",
			"/image/aovs", "not supported yet"},
		{"{\"version\":1,\"image\":{\"width\":16384,\"height\":8192},"
		 "\"sampling\":{\"samples\":8193}}",
			"/sampling/samples", "2^40"},
	};

	(void)state;
	for (size_t i = 0; i < sizeof images / sizeof *images; i++) {
		struct pen_scene_errors errors;
		struct pen_scene *scene;

		assert_int_equal(read_text(images[i].members, &scene, &errors), PEN_EINVALID);
		assert_string_equal(errors.items[0].pointer, images[i].pointer);
		if (!strstr(errors.items[0].detail, images[i].detail))
			fail_msg("%s gives \"%s\"", images[i].members, errors.items[0].detail);
	}
}

/* Broken by an order other than the document's, whatever pass finds the offender. */
static void offences_stand_in_document_order(void **state)
{
	static const char text[] =
		"{\"objects\":[{\"type\":\"instance\",\"of\":\"x\"},{\"material\":\"m\",\"radius\":"
		"0,"
		"\"type\":\"sphere\"}],"
		"\"lights\":[{\"edge_v\":[0,0,0],\"hue\":1,\"type\":\"rectangle\"}],"
		"\"camera\":{\"up\":[0,0,0],\"from\":\"x\"},\"image\":{\"height\":0},\"frames\":{}"
		"}";
	static const char *const pointers[] = {"/objects/0/of", "/objects/1/material",
		"/objects/1/radius", "/lights/0/edge_v", "/lights/0/hue", "/camera/up",
		"/camera/from", "/image/height", "/image/width", "/frames", "/version"};
	struct pen_scene_errors errors;
	struct pen_scene *scene;

	(void)state;
	assert_int_equal(read_text(text, &scene, &errors), PEN_EINVALID);
	assert_int_equal(errors.count, sizeof pointers / sizeof *pointers);
	for (size_t i = 0; i < errors.count; i++)
		assert_string_equal(errors.items[i].pointer, pointers[i]);
}

/* Head, count pieces with commas between, tail. */
static int read_repeated(const char *head, const char *piece, size_t count, const char *tail,
	struct pen_scene_errors *ret_errors)
{
	struct pen_scene *scene;
	struct pen_buf buf;
	int r;

	pen_buf_init(&buf, PEN_SCENE_BYTES_MAX);
	(void)pen_buf_text(&buf, head);
	for (size_t i = 0; i < count; i++) {
		if (i > 0)
			(void)pen_buf_text(&buf, ",");
		(void)pen_buf_text(&buf, piece);
	}
	(void)pen_buf_text(&buf, tail);
	assert_false(buf.failed);
	r = read_text(buf.data, &scene, ret_errors);
	pen_scene_destroy(scene);
	pen_buf_finish(&buf);
	return r;
}

/* Broken by a list of errors that overflows, or that keeps the last instead of the first. */
static void the_first_offences_are_kept(void **state)
{
	struct pen_scene_errors errors;
	char pointer[64];

	(void)state;
	assert_int_equal(read_repeated("{\"lights\":[", "7", 5000, "]}", &errors), PEN_EINVALID);
	assert_int_equal(errors.count, PEN_SCENE_ERRORS_MAX);
	for (size_t i = 0; i < errors.count; i++) {
		(void)snprintf(pointer, sizeof pointer, "/lights/%zu", i);
		assert_string_equal(errors.items[i].pointer, pointer);
	}
}

/* Broken by a pointer that is cut within a character. */
static void long_keys_are_cut_between_characters(void **state)
{
	static const char *const heads[] = {"{\"", "{\"x", "{\"xx"};
	struct pen_scene_errors errors;
	json_t *string;

	(void)state;
	for (size_t shift = 0; shift < 3; shift++) {
		struct pen_scene *scene;
		struct pen_buf text;

		pen_buf_init(&text, 1024);
		(void)pen_buf_text(&text, heads[shift]);
		for (size_t i = 0; i < 200; i++)
			(void)pen_buf_text(&text, "\xe2\x82\xac");
		(void)pen_buf_text(&text, "\":1}");
		assert_int_equal(read_text(text.data, &scene, &errors), PEN_EINVALID);
		string = json_string(errors.items[0].pointer);
		assert_non_null(string);
		assert_in_range(strlen(errors.items[0].pointer), 250, 255);
		json_decref(string);
		pen_buf_finish(&text);
	}
}

struct bound {
	const char *head, *tail; /* of a scene, around a number */
	double last;		 /* the last good number */
	double beyond;
};

/* Broken by a range that is off by one. */
static void ranges_are_exact(void **state)
{
	static const struct bound bounds[] = {
		{"{\"version\":1,\"image\":{\"width\":", ",\"height\":1}}", 16384, 16385},
		{"{\"version\":1,\"image\":{\"width\":1,\"height\":", "}}", 1, 0},
		{"{\"version\":1,\"image\":{\"width\":16384,\"height\":",
			"},\"sampling\":{\"samples\":1}}", 8192, 8193},
		{"{\"version\":1,\"image\":{\"width\":16384,\"height\":8192},"
		 "\"sampling\":{\"samples\":",
			"}}", 8192, 8193},
		{HEAD ",\"sampling\":{\"samples\":", "}}", PEN_SAMPLES_MAX, PEN_SAMPLES_MAX + 1},
		{HEAD ",\"sampling\":{\"samples\":", "}}", 1, 0},
		{HEAD ",\"sampling\":{\"seed\":", "}}", 4294967295.0, 4294967296.0},
		{HEAD ",\"integrator\":{\"max_depth\":", "}}", PEN_DEPTH_MAX, PEN_DEPTH_MAX + 1},
		{HEAD ",\"integrator\":{\"type\":\"path\",\"max_depth\":", "}}", 1, 0},
		{HEAD ",\"integrator\":{\"type\":\"whitted\",\"max_depth\":", "}}",
			PEN_WHITTED_DEPTH_MAX, PEN_WHITTED_DEPTH_MAX + 1},
		{HEAD ",\"camera\":{\"blades\":", "}}", PEN_BLADES_MAX, PEN_BLADES_MAX + 1},
		{HEAD ",\"camera\":{\"position\":[0,0,", "]}}", PEN_COORDINATE_MAX,
			1.0000000000000002e15},
		{HEAD ",\"camera\":{\"position\":[0,0,", "]}}", -PEN_COORDINATE_MAX,
			-1.0000000000000002e15},
		{HEAD ",\"objects\":[{\"type\":\"sphere\",\"transform\":{\"scale\":[1,1,", "]}}]}",
			PEN_SCALE_MIN, PEN_SCALE_MIN * 0.999},
		{HEAD ",\"objects\":[{\"type\":\"sphere\",\"transform\":{\"scale\":[1,1,", "]}}]}",
			-PEN_SCALE_MAX, -PEN_SCALE_MAX * 1.001},
		{HEAD ",\"objects\":[{\"type\":\"sphere\",\"keyframes\":[{\"time\":", "}]}]}",
			PEN_TIME_MAX, PEN_TIME_MAX * 1.001},
		{"{\"version\":1,\"image\":{\"width\":1,\"height\":1,\"filter\":{\"width\":", "}}}",
			PEN_FILTER_WIDTH_MAX, PEN_FILTER_WIDTH_MAX + 0.001},
	};

	(void)state;
	for (size_t i = 0; i < sizeof bounds / sizeof *bounds; i++) {
		struct pen_scene_errors errors;
		struct pen_scene *scene;
		char text[256];

		(void)snprintf(text, sizeof text, "%s%.17g%s", bounds[i].head, bounds[i].last,
			bounds[i].tail);
		if (read_text(text, &scene, &errors) < 0)
			fail_msg("%s is refused", text);
		pen_scene_destroy(scene);
		(void)snprintf(text, sizeof text, "%s%.17g%s", bounds[i].head, bounds[i].beyond,
			bounds[i].tail);
		if (read_text(text, &scene, &errors) == 0)
			fail_msg("%s is taken", text);
	}
}

/* Broken by a list bound that is off by one, or by defaults that make a tree too large to read. */
static void lists_are_bounded(void **state)
{
	static const char lights[] = HEAD ",\"lights\":[";
	static const char objects[] = HEAD ",\"objects\":[";
	static const char keys[] = HEAD ",\"objects\":[{\"type\":\"mesh\",\"indices\":[0,0,0],"
					"\"vertices_at\":[{\"time\":-1,\"vertices\":[[0,0,0]]},";
	static const char key[] = "{\"time\":0,\"vertices\":[[0,0,0]]}";
	struct pen_scene_errors errors;

	(void)state;
	for (size_t i = PEN_LIGHTS_MAX - 1; i <= PEN_LIGHTS_MAX + 1; i++)
		assert_int_equal(read_repeated(lights, "{\"type\":\"point\"}", i, "]}", &errors),
			i <= PEN_LIGHTS_MAX ? 0 : PEN_EINVALID);
	assert_string_equal(errors.items[0].pointer, "/lights");

	/* Of too many keys only their number is told, of as many as fit that their times are equal.
	 */
	assert_int_equal(
		read_repeated(keys, key, PEN_KEYFRAMES_MAX - 1, "]}]}", &errors), PEN_EINVALID);
	assert_string_equal(errors.items[0].pointer, "/objects/0/vertices_at/2/time");
	assert_int_equal(
		read_repeated(keys, key, PEN_KEYFRAMES_MAX, "]}]}", &errors), PEN_EINVALID);
	assert_string_equal(errors.items[0].pointer, "/objects/0/vertices_at");

	/* So many objects have too many values once their defaults are there. */
	for (size_t i = PEN_OBJECTS_MAX; i <= PEN_OBJECTS_MAX + 1; i++) {
		assert_int_equal(read_repeated(objects, "{\"type\":\"sphere\"}", i, "]}", &errors),
			PEN_EINVALID);
		assert_int_equal(errors.count, 1);
		assert_string_equal(
			errors.items[0].pointer, i <= PEN_OBJECTS_MAX ? "" : "/objects");
	}
}

/* Broken by work that grows faster than a mesh does. */
static void large_meshes_are_quick(void **state)
{
	const size_t count = 180000;
	struct pen_scene_errors errors;
	struct pen_buf tail;
	clock_t start;

	(void)state;
	pen_buf_init(&tail, PEN_SCENE_BYTES_MAX);
	(void)pen_buf_text(&tail, "],\"indices\":[0");
	for (size_t i = 1; i < count; i++)
		(void)pen_buf_printf(&tail, ",%zu", i);
	(void)pen_buf_text(&tail, "]}]}");
	assert_false(tail.failed);
	start = clock();
	assert_int_equal(read_repeated(HEAD ",\"objects\":[{\"type\":\"mesh\",\"vertices\":[",
				 "[0.125,-3.0625,7.5]", count, tail.data, &errors),
		0);
	assert_in_range(clock() - start, 0, 5 * CLOCKS_PER_SEC);
	pen_buf_finish(&tail);
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
		cmocka_unit_test(each_offence_is_named),
		cmocka_unit_test(each_offence_of_the_image_is_named),
		cmocka_unit_test(offences_stand_in_document_order),
		cmocka_unit_test(the_first_offences_are_kept),
		cmocka_unit_test(long_keys_are_cut_between_characters),
		cmocka_unit_test(ranges_are_exact),
		cmocka_unit_test(lists_are_bounded),
		cmocka_unit_test(large_meshes_are_quick),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
