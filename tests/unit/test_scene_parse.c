/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/parse.h"

#include "core/base/buf.h"
#include "core/base/limits.h"
#include "core/scene/canonical.h"
#include "tests/unit/scene_text.h"

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct offence {
	const char *members; /* behind HEAD */
	const char *pointer, *detail;
};

#define KEYS(a, b)                                                                                 \
	",\"objects\":[{\"type\":\"sphere\",\"keyframes\":[{\"time\":0," a "},{\"time\":1," b "}]" \
	"}]"
#define MESH(more)                                                                                 \
	",\"objects\":[{\"type\":\"mesh\",\"vertices\":[[0,0,0],[1,0,0],[0,1,0]]," more "}]"
#define PRINCIPLED(more)                                                                           \
	",\"textures\":{\"a\":{\"image\":\"" ASSET                                                 \
	"\"}},\"materials\":{\"m\":{\"type\":\"principled\"," more "}}"
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

	/* Assets and textures */
	{",\"textures\":[]", "/textures", "must be an object"},
	{",\"textures\":{\"a\":{}}", "/textures/a/image", "is missing"},
	{",\"textures\":{\"a\":{\"image\":7}}", "/textures/a/image", "must be a string"},
	{",\"textures\":{\"a\":{\"image\":\"wood.png\"}}", "/textures/a/image", "relative paths"},
	{",\"textures\":{\"a\":{\"image\":\"https://x.example/a\"}}", "/textures/a/image",
		"no URL is fetched"},
	{",\"textures\":{\"a\":{\"image\":\"sha256:00\"}}", "/textures/a/image", "64 lower-case"},
	{",\"textures\":{\"a\":{\"image\":\"" ASSET "0\"}}", "/textures/a/image", "64 lower-case"},
	{",\"textures\":{\"a\":{\"image\":\"" ASSET "\",\"color_space\":\"rec2020\"}}",
		"/textures/a/color_space", "srgb, linear"},
	{",\"textures\":{\"a\":{\"image\":\"" ASSET "\",\"wrap_v\":\"tile\"}}",
		"/textures/a/wrap_v", "repeat, mirror, clamp"},
	{",\"background\":{\"image\":\"../sky.hdr\"}", "/background/image", "no path is opened"},
	{",\"background\":{\"color\":[0,0,0],\"image\":\"" ASSET "\"}", "/background/color",
		"leave out one"},
	{",\"background\":{\"intensity\":1}", "/background/intensity", "there is none"},
	{",\"background\":{\"rotation\":1}", "/background/rotation", "there is none"},
	{",\"objects\":[{\"type\":\"gltf\"}]", "/objects/0/asset", "is missing"},
	{",\"objects\":[{\"type\":\"gltf\",\"asset\":\"/etc/passwd\"}]", "/objects/0/asset",
		"no path is opened"},

	/* Sampling, frames */
	{",\"sampling\":{\"threshold\":0.1}", "/sampling/threshold", "unknown key"},
	{",\"sampling\":{\"mode\":\"edge\",\"threshold\":-1}", "/sampling/threshold", "from 0"},
	{",\"sampling\":{\"mode\":\"adaptive\",\"samples\":8,\"min_samples\":9}",
		"/sampling/min_samples", "more than samples"},
	{",\"sampling\":{\"mode\":\"adaptive\",\"confidence\":1}", "/sampling/confidence",
		"from 0.5"},
	{",\"frames\":{}", "/frames/last", "is missing"},
	{",\"frames\":{\"first\":2,\"last\":1}", "/frames/last", "before first"},
	{",\"frames\":{\"last\":10000,\"fps\":0.009}", "/frames/fps", "higher"},

	/* Camera */
	{",\"camera\":{\"from\":\"x\"}", "/camera/from", "no object"},
	{",\"camera\":{\"from\":1}", "/camera/from", "must be a string"},
	{GLTF ",\"camera\":{\"from\":\"x\",\"keyframes\":[{\"time\":0,\"position\":[0,0,1]}]}",
		"/camera/keyframes/0/look_at", "from a glTF"},
	{GLTF ",\"camera\":{\"from\":\"x\",\"position\":[0,0,1],\"look_at\":[0,0,1]}",
		"/camera/look_at", "differ"},
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
	{PRINCIPLED("\"metallic\":2"), "/materials/m/metallic", "from 0 to 1"},
	{PRINCIPLED("\"metallic\":\"b\""), "/materials/m/metallic", "must be a number"},
	{PRINCIPLED("\"metallic\":{}"), "/materials/m/metallic/texture", "is missing"},
	{PRINCIPLED("\"metallic\":{\"texture\":\"b\"}"), "/materials/m/metallic/texture",
		"names no texture"},
	{PRINCIPLED("\"metallic\":{\"texture\":\"a\",\"channel\":\"x\"}"),
		"/materials/m/metallic/channel", "r, g, b, a"},
	{PRINCIPLED("\"metallic\":{\"texture\":\"a\",\"factor\":[1,1,1]}"),
		"/materials/m/metallic/factor", "must be a number"},
	{PRINCIPLED("\"base_color\":{\"texture\":\"a\",\"factor\":[1,1,2]}"),
		"/materials/m/base_color/factor/2", "from 0 to 1"},
	{PRINCIPLED("\"base_color\":{\"texture\":\"a\",\"channel\":\"r\"}"),
		"/materials/m/base_color/channel", "unknown key"},
	{PRINCIPLED("\"base_color\":{\"texture\":\"a\",\"uv_set\":2}"),
		"/materials/m/base_color/uv_set", "from 0 to 1"},
	{PRINCIPLED("\"base_color\":{\"texture\":\"a\",\"transform\":{\"scale\":2}}"),
		"/materials/m/base_color/transform/scale", "array of 2 numbers"},
	{PRINCIPLED("\"normal\":1"), "/materials/m/normal", "names a texture"},
	{PRINCIPLED("\"emission\":[1e10,0,0],\"emission_strength\":1e10"),
		"/materials/m/emission_strength", "must be less"},
	{PRINCIPLED("\"double_sided\":1"), "/materials/m/double_sided", "true or false"},
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
		{"{\"version\":1,\"image\":{\"width\":4,\"height\":4,\"aovs\":[\"heat\"]}}",
			"/image/aovs/0", "one of albedo"},
		{"{\"version\":1,\"image\":{\"width\":4,\"height\":4,"
		 "\"aovs\":[\"depth\",\"normal\",\"depth\"]}}",
			"/image/aovs/2", "already"},
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
		"\"camera\":{\"up\":[0,0,0]},\"image\":{\"height\":0},\"frames\":{}"
		"}";
	static const char *const pointers[] = {"/objects/0/of", "/objects/1/material",
		"/objects/1/radius", "/lights/0/edge_v", "/lights/0/hue", "/camera/up",
		"/image/height", "/image/width", "/frames/last", "/version"};
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
		{HEAD ",\"sampling\":{\"mode\":\"interleaved\",\"pattern\":", "}}", PEN_PATTERN_MAX,
			PEN_PATTERN_MAX + 1},
		{HEAD ",\"sampling\":{\"mode\":\"interleaved\",\"pattern\":", "}}", 1, 0},
		{HEAD ",\"frames\":{\"first\":1,\"last\":", "}}", PEN_FRAMES_MAX,
			PEN_FRAMES_MAX + 1},
		{HEAD ",\"frames\":{\"first\":1000000,\"last\":", "}}", PEN_FRAME_NUMBER_MAX,
			PEN_FRAME_NUMBER_MAX + 1},
		{HEAD ",\"frames\":{\"last\":1,\"fps\":", "}}", PEN_FRAME_RATE_MAX,
			PEN_FRAME_RATE_MAX * 1.001},
		{HEAD ",\"frames\":{\"last\":1,\"fps\":", "}}", PEN_FRAME_RATE_MIN,
			PEN_FRAME_RATE_MIN * 0.999},
		{"{\"version\":1,\"image\":{\"width\":16384,\"height\":8192},"
		 "\"sampling\":{\"samples\":8192},\"frames\":{\"last\":",
			"}}", 1024, 1025},
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
	static const char gltf[] = "{\"type\":\"gltf\",\"asset\":\"" ASSET "\"}";
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

	for (size_t i = PEN_ASSETS_MAX - 1; i <= PEN_ASSETS_MAX + 1; i++)
		assert_int_equal(read_repeated(objects, gltf, i, "]}", &errors),
			i <= PEN_ASSETS_MAX ? 0 : PEN_EINVALID);
	assert_string_equal(errors.items[0].pointer, "/objects/4096/asset");

	/* So many objects have too many values once their defaults are there. */
	for (size_t i = PEN_OBJECTS_MAX; i <= PEN_OBJECTS_MAX + 1; i++) {
		assert_int_equal(read_repeated(objects, "{\"type\":\"sphere\"}", i, "]}", &errors),
			PEN_EINVALID);
		assert_int_equal(errors.count, 1);
		assert_string_equal(
			errors.items[0].pointer, i <= PEN_OBJECTS_MAX ? "" : "/objects");
	}
}

/* Broken by a bound that is off by one; textures have names, so that no two pieces are alike. */
static void textures_are_bounded(void **state)
{
	struct pen_scene_errors errors;
	struct pen_scene *scene;
	struct pen_buf buf;

	(void)state;
	for (size_t count = PEN_TEXTURES_MAX - 1; count <= PEN_TEXTURES_MAX + 1; count++) {
		pen_buf_init(&buf, PEN_SCENE_BYTES_MAX);
		(void)pen_buf_text(&buf, HEAD ",\"textures\":{");
		for (size_t i = 0; i < count; i++)
			(void)pen_buf_printf(
				&buf, "%s\"%zu\":{\"image\":\"" ASSET "\"}", i ? "," : "", i);
		(void)pen_buf_text(&buf, "}}");
		assert_int_equal(read_text(buf.data, &scene, &errors),
			count <= PEN_TEXTURES_MAX ? 0 : PEN_EINVALID);
		if (scene)
			assert_int_equal(scene->picture_count, count);
		else
			assert_string_equal(errors.items[0].pointer, "/textures");
		pen_scene_destroy(scene);
		pen_buf_finish(&buf);
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
		cmocka_unit_test(each_offence_is_named),
		cmocka_unit_test(each_offence_of_the_image_is_named),
		cmocka_unit_test(offences_stand_in_document_order),
		cmocka_unit_test(the_first_offences_are_kept),
		cmocka_unit_test(long_keys_are_cut_between_characters),
		cmocka_unit_test(ranges_are_exact),
		cmocka_unit_test(lists_are_bounded),
		cmocka_unit_test(textures_are_bounded),
		cmocka_unit_test(large_meshes_are_quick),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
