/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/canonical.h"

#include "core/base/limits.h"
#include "core/scene/parse.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define ASSET "sha256:0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

static json_t *parse(const char *text)
{
	struct pen_error err = PEN_ERROR_INIT;
	json_t *tree = NULL;

	if (pen_json_parse(text, strlen(text), &tree, &err) < 0)
		fail_msg("%s: %s", text, err.text);
	return tree;
}

/* The canonical text of a tree; the caller frees it. */
static char *canonical(const json_t *tree)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_buf buf;

	pen_buf_init(&buf, PEN_SCENE_BYTES_MAX);
	assert_int_equal(pen_json_canonical(tree, &buf, &err), 0);
	return pen_buf_take(&buf);
}

static void assert_canonical(const char *text, const char *expected)
{
	json_t *tree = parse(text);
	char *found = canonical(tree);

	assert_string_equal(found, expected);
	free(found);
	json_decref(tree);
}

/* Reads a scene; *ret_text is the canonical text of the tree that it leaves. The caller frees both.
 */
static struct pen_scene *read_scene(const char *text, char **ret_text)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_scene_errors errors;
	struct pen_scene *scene = NULL;
	json_t *tree = parse(text);

	if (pen_scene_parse(tree, &scene, &errors, &err) < 0)
		fail_msg("%s", err.text);
	*ret_text = canonical(tree);
	json_decref(tree);
	return scene;
}

static char *canonical_scene(const char *text)
{
	char *found;

	pen_scene_destroy(read_scene(text, &found));
	return found;
}

struct number {
	uint64_t bits;
	const char *text;
};

/* RFC 8785, appendix B, and powers of two where the nearest short decimal lies outside the double's
 * interval. Broken by any digit that ECMAScript would not print. */
static void numbers_are_ecmascripts(void **state)
{
	static const struct number numbers[] = {
		{0x0000000000000000, "0"},
		{0x8000000000000000, "0"},
		{0x0000000000000001, "5e-324"},
		{0x8000000000000001, "-5e-324"},
		{0x7fefffffffffffff, "1.7976931348623157e+308"},
		{0xffefffffffffffff, "-1.7976931348623157e+308"},
		{0x4340000000000000, "9007199254740992"},
		{0xc340000000000000, "-9007199254740992"},
		{0x4430000000000000, "295147905179352830000"},
		{0x44b52d02c7e14af5, "9.999999999999997e+22"},
		{0x44b52d02c7e14af6, "1e+23"},
		{0x44b52d02c7e14af7, "1.0000000000000001e+23"},
		{0x444b1ae4d6e2ef4e, "999999999999999700000"},
		{0x444b1ae4d6e2ef4f, "999999999999999900000"},
		{0x444b1ae4d6e2ef50, "1e+21"},
		{0x3eb0c6f7a0b5ed8c, "9.999999999999997e-7"},
		{0x3eb0c6f7a0b5ed8d, "0.000001"},
		{0x41b3de4355555553, "333333333.3333332"},
		{0x41b3de4355555554, "333333333.33333325"},
		{0x41b3de4355555555, "333333333.3333333"},
		{0x41b3de4355555556, "333333333.3333334"},
		{0x41b3de4355555557, "333333333.33333343"},
		{0xbecbf647612f3696, "-0.0000033333333333333333"},
		{0x43143ff3c1cb0959, "1424953923781206.2"},
		{0x3d30000000000000, "5.684341886080802e-14"},
		{0x0010000000000000, "2.2250738585072014e-308"},
		{0x000fffffffffffff, "2.225073858507201e-308"},
		{0x3ff0000000000000, "1"},
		{0x3fb999999999999a, "0.1"},
		{0x40c81c8000000000, "12345"},
		{0x430c6bf52634000a, "1000000000000001.2"},
	};

	(void)state;
	for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
		double number;
		json_t *value;
		char *text;

		memcpy(&number, &numbers[i].bits, sizeof number);
		value = json_real(number);
		text = canonical(value);
		assert_string_equal(text, numbers[i].text);
		free(text);
		json_decref(value);
	}
}

/* Broken by a text that does not name its own double, or by digits to spare. */
static void numbers_name_themselves(void **state)
{
	uint64_t bits = 88172645463325252u; /* xorshift's state (Marsaglia 2003) */

	(void)state;
	for (size_t i = 0; i < 20000; i++) {
		double number;
		json_t *value;
		char *text;

		bits ^= bits << 13;
		bits ^= bits >> 7;
		bits ^= bits << 17;
		memcpy(&number, &bits, sizeof number);
		value = json_real(number);
		if (!value)
			continue; /* not finite */
		text = canonical(value);
		assert_true(strtod(text, NULL) == number);
		assert_in_range(strlen(text), 1, 25);
		free(text);
		json_decref(value);
	}
}

/* RFC 8785, sections 3.2.2.2 and 3.2.3: escapes, and keys by UTF-16 code units. */
static void strings_and_keys_are_as_in_the_rfc(void **state)
{
	(void)state;
	assert_canonical("[\"\\u20ac$\\u000F\\u000aA'\\u0042\\u0022\\u005c\\\\\\\"\\/\"]",
		"[\"\xe2\x82\xac$\\u000f\\nA'B\\\"\\\\\\\\\\\"/\"]");
	assert_canonical("[\"\\b\\t\\n\\f\\r\\u007f\\u001f\"]", "[\"\\b\\t\\n\\f\\r\x7f\\u001f\"]");
	assert_canonical("{\"\\u20ac\":1,\"\\r\":2,\"\\ufb33\":3,\"1\":4,\"\\ud83d\\ude00\":5,"
			 "\"\\u0080\":6,\"\\u00f6\":7}",
		"{\"\\r\":2,\"1\":4,\"\xc2\x80\":6,\"\xc3\xb6\":7,\"\xe2\x82\xac\":1,"
		"\"\xf0\x9f\x98\x80\":5,\"\xef\xac\xb3\":3}");
	assert_canonical(" { \"b\" : [ true , false , null , { } , [ ] ] , \"a\" : 1.0e0 } ",
		"{\"a\":1,\"b\":[true,false,null,{},[]]}");
}

/* Broken by a text cut at the ceiling that is handed out as whole. */
static void a_full_buffer_is_an_error(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	json_t *tree = parse("[1,2,3]");
	struct pen_buf buf;

	(void)state;
	pen_buf_init(&buf, 6);
	assert_int_equal(pen_json_canonical(tree, &buf, &err), PEN_ELIMIT);
	pen_buf_finish(&buf);
	pen_buf_init(&buf, 7);
	assert_int_equal(pen_json_canonical(tree, &buf, &err), 0);
	pen_buf_finish(&buf);
	json_decref(tree);
}

static const char terse[] =
	"{\"version\":1,\"image\":{\"width\":8,\"height\":4},"
	"\"camera\":{\"keyframes\":[{\"time\":0},{\"time\":1,\"position\":[1,2,9]}]},"
	"\"materials\":{\"b\":{\"type\":\"glass\"},\"a\":{\"type\":\"matte\"}},"
	"\"objects\":[{\"type\":\"sphere\",\"material\":\"b\"}],"
	"\"lights\":[{\"type\":\"spot\"}]}";

/* Broken by an order, a spelling of a number or a default that leaves its trace. */
static void one_scene_has_one_text(void **state)
{
	static const char wordy[] =
		"{\"lights\":[{\"direction\":[0,-1,0],\"position\":[0,0,0],\"type\":\"spot\","
		"\"blend\":-0.0,"
		"\"cone_angle\":3e1,\"intensity\":[1,1.0,1e0]}],"
		"\"objects\":[{\"center\":[0,0,0],\"radius\":1.0,\"transform\":{\"scale\":[1,1,1]},"
		"\"keyframes\":[],\"visible\":true,\"material\":\"b\",\"type\":\"sphere\"}],\n"
		"\"materials\":{\"a\":{\"color\":[0.5,0.50,5e-1],\"type\":\"matte\"},"
		"\"b\":{\"roughness\":0,\"ior\":1.5,\"color\":[1,1,1],\"type\":\"glass\"}},\n"
		"\"background\":{\"color\":[0,0,0]},\"sampling\":{\"seed\":0,\"samples\":6.4e1,"
		"\"sequence\":\"sobol\",\"mode\":\"uniform\"},"
		"\"integrator\":{\"max_depth\":6,\"type\":\"distribution\"},"
		"\"camera\":{\"keyframes\":[{\"time\":0.0,\"position\":[0,2,10],\"look_at\":[0,0,0]"
		","
		"\"up\":[0,1,0]},{\"position\":[1,2,9],\"time\":1}],\"blades\":0,\"position\":[0,2,"
		"10],"
		"\"look_at\":[0,0,0]},"
		"\"image\":{\"height\":4,\"width\":8.0,\"crop\":[0,0,8,4],\"aovs\":[],\"exposure\":"
		"0,"
		"\"filter\":{\"width\":3,\"type\":\"gaussian\"}},\"version\":1.0}";
	char *a = canonical_scene(terse), *b = canonical_scene(wordy);

	(void)state;
	assert_string_equal(a, b);
	free(a);
	free(b);
}

/* Broken by a default that is not what it reads as, or that is missing from the text. */
static void canonical_text_is_a_fixed_point(void **state)
{
	char *once = canonical_scene(terse), *twice = canonical_scene(once);

	(void)state;
	assert_string_equal(once, twice);
	assert_non_null(strstr(once, "\"crop\":[0,0,8,4]"));
	assert_non_null(strstr(once, "\"focus_distance\":10.198039027185569"));
	free(once);
	free(twice);
}

/* Broken by a default of one of these that is not in the text, or by a camera of a glTF that is. */
static void every_part_reaches_the_canonical_text(void **state)
{
	static const char text[] =
		"{\"version\":1,\"image\":{\"width\":8,\"height\":4,\"aovs\":[\"samples\","
		"\"normal\"]},\"camera\":{\"aperture_radius\":1},\"frames\":{\"last\":3},"
		"\"sampling\":{\"mode\":\"adaptive\",\"samples\":4},"
		"\"background\":{\"image\":\"" ASSET "\"},"
		"\"textures\":{\"t\":{\"image\":\"" ASSET "\"}},"
		"\"materials\":{\"m\":{\"type\":\"principled\",\"metallic\":{\"texture\":\"t\"},"
		"\"opacity\":0.5}},"
		"\"objects\":[{\"type\":\"gltf\",\"asset\":\"" ASSET "\"}]}";
	static const char *const parts[] = {
		"\"aovs\":[\"normal\",\"samples\"]",
		"\"background\":{\"image\":\"" ASSET "\",\"intensity\":1,\"rotation\":0}",
		"\"camera\":{\"aperture_radius\":1,\"blade_rotation\":0,\"blades\":0,"
		"\"focal_surface\":\"plane\",\"keyframes\":[]}",
		"\"frames\":{\"first\":1,\"fps\":24,\"last\":3}",
		"\"metallic\":{\"channel\":\"b\",\"factor\":1,\"texture\":\"t\",\"transform\":"
		"{\"offset\":[0,0],\"rotation\":0,\"scale\":[1,1]},\"uv_set\":0}",
		"\"alpha_mode\":\"blend\"",
		"\"min_samples\":4",
		"\"color_space\":\"srgb\"",
	};
	char *once = canonical_scene(text), *twice = canonical_scene(once);

	(void)state;
	assert_string_equal(once, twice);
	for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
		if (!strstr(once, parts[i]))
			fail_msg("%s is not in %s", parts[i], once);
	free(once);
	free(twice);
}

static void assert_same(const void *a, const void *b, size_t count, size_t size)
{
	assert_true(count == 0 || memcmp(a, b, count * size) == 0);
}

static void assert_same_object(const struct pen_object_desc *a, const struct pen_object_desc *b)
{
	assert_int_equal(a->type, b->type);
	assert_int_equal(a->material, b->material);
	assert_int_equal(a->visible, b->visible);
	assert_same(&a->transform, &b->transform, 1, sizeof a->transform);
	assert_int_equal(a->key_count, b->key_count);
	assert_same(a->keys, b->keys, a->key_count, sizeof *a->keys);
	if (a->type == PEN_OBJECT_SPHERE)
		assert_same(&a->u.sphere, &b->u.sphere, 1, sizeof a->u.sphere);
	if (a->type != PEN_OBJECT_MESH)
		return;
	assert_int_equal(a->u.mesh.vertex_count, b->u.mesh.vertex_count);
	assert_int_equal(a->u.mesh.triangle_count, b->u.mesh.triangle_count);
	assert_same(
		a->u.mesh.vertices, b->u.mesh.vertices, a->u.mesh.vertex_count, 3 * sizeof(float));
	assert_same(a->u.mesh.indices, b->u.mesh.indices, a->u.mesh.triangle_count,
		3 * sizeof(uint32_t));
}

/* Descriptions are zeroed memory filled member by member: equal ones are equal bytes. */
static void assert_same_scene(const struct pen_scene *a, const struct pen_scene *b)
{
	struct pen_camera_desc c = a->camera, d = b->camera;

	assert_same(&a->image, &b->image, 1, sizeof a->image);
	assert_int_equal(c.key_count, d.key_count);
	assert_same(c.keys, d.keys, c.key_count, sizeof *c.keys);
	c.keys = d.keys = NULL;
	assert_same(&c, &d, 1, sizeof c);
	assert_same(&a->integrator, &b->integrator, 1, sizeof a->integrator);
	assert_same(&a->sampling, &b->sampling, 1, sizeof a->sampling);
	assert_same(a->background.color, b->background.color, 1, sizeof a->background.color);
	assert_int_equal(a->material_count, b->material_count);
	for (uint32_t i = 0; i < a->material_count; i++) {
		assert_string_equal(a->materials[i].name, b->materials[i].name);
		assert_same(a->materials[i].color, b->materials[i].color, 3, sizeof(double));
	}
	assert_int_equal(a->object_count, b->object_count);
	for (uint32_t i = 0; i < a->object_count; i++)
		assert_same_object(&a->objects[i], &b->objects[i]);
	assert_int_equal(a->light_count, b->light_count);
	assert_same(a->lights, b->lights, a->light_count, sizeof *a->lights);
}

static char *read_file(const char *path)
{
	FILE *file = fopen(path, "rb");
	char *text = calloc(1, 1 << 16);

	assert_non_null(file);
	assert_non_null(text);
	assert_in_range(fread(text, 1, (1 << 16) - 1, file), 1, (1 << 16) - 2);
	(void)fclose(file);
	return text;
}

/* Broken by a scene that a worker, who gets the canonical text, reads otherwise than the server. */
static void reference_scenes_survive_the_canonical_text(void **state)
{
	static const char *const names[] = {
		"depth_of_field", "five_balls", "glass", "gloss", "motion_blur", "soft_shadow"};

	(void)state;
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		char path[64], *text, *once, *twice;
		struct pen_scene *given, *again;

		(void)snprintf(path, sizeof path, "reference/scenes/%s.json", names[i]);
		text = read_file(path);
		given = read_scene(text, &once);
		again = read_scene(once, &twice);
		assert_string_equal(once, twice);
		assert_same_scene(given, again);
		pen_scene_destroy(given);
		pen_scene_destroy(again);
		free(text);
		free(once);
		free(twice);
	}
}

struct patch {
	const char *target, *patch, *result;
};

/* The examples of RFC 7396, appendix A, that have objects for target and patch, below one key. */
static void merge_patch_is_as_in_the_rfc(void **state)
{
	static const struct patch patches[] = {
		{"{\"a\":\"b\"}", "{\"a\":\"c\"}", "{\"a\":\"c\"}"},
		{"{\"a\":\"b\"}", "{\"b\":\"c\"}", "{\"a\":\"b\",\"b\":\"c\"}"},
		{"{\"a\":\"b\"}", "{\"a\":null}", "{}"},
		{"{\"a\":\"b\",\"b\":\"c\"}", "{\"a\":null}", "{\"b\":\"c\"}"},
		{"{\"a\":[\"b\"]}", "{\"a\":\"c\"}", "{\"a\":\"c\"}"},
		{"{\"a\":\"c\"}", "{\"a\":[\"b\"]}", "{\"a\":[\"b\"]}"},
		{"{\"a\":{\"b\":\"c\"}}", "{\"a\":{\"b\":\"d\",\"c\":null}}",
			"{\"a\":{\"b\":\"d\"}}"},
		{"{\"a\":[{\"b\":\"c\"}]}", "{\"a\":[1]}", "{\"a\":[1]}"},
		{"{\"e\":null}", "{\"a\":1}", "{\"a\":1,\"e\":null}"},
		{"{\"a\":\"foo\"}", "{\"a\":{\"b\":null,\"c\":1}}", "{\"a\":{\"c\":1}}"},
		{"{}", "{\"a\":{\"bb\":{\"ccc\":null}}}", "{\"a\":{\"bb\":{}}}"},
		{"{\"a\":1}", "{\"a\":[{\"b\":null}]}", "{\"a\":[{\"b\":null}]}"},
	};

	(void)state;
	for (size_t i = 0; i < sizeof patches / sizeof *patches; i++) {
		struct pen_error err = PEN_ERROR_INIT;
		json_t *target = parse(patches[i].target), *patch = parse(patches[i].patch);
		char *text, *patch_text;

		assert_int_equal(pen_json_merge_patch(target, patch, &err), 0);
		text = canonical(target);
		assert_string_equal(text, patches[i].result);
		patch_text = canonical(patch);
		assert_string_equal(patch_text, patches[i].patch);
		free(text);
		free(patch_text);
		json_decref(target);
		json_decref(patch);
	}
}

/* Broken by a target that shares values with its patch: filling the one would change the other. */
static void merged_values_are_copies(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	json_t *target = parse("{}"), *patch = parse("{\"a\":{\"b\":{}},\"c\":[{}]}");

	(void)state;
	assert_int_equal(pen_json_merge_patch(target, patch, &err), 0);
	json_object_set_new(json_object_get(json_object_get(target, "a"), "b"), "x", json_null());
	json_object_set_new(json_array_get(json_object_get(target, "c"), 0), "x", json_null());
	assert_int_equal(json_object_size(json_object_get(json_object_get(patch, "a"), "b")), 0);
	assert_int_equal(json_object_size(json_array_get(json_object_get(patch, "c"), 0)), 0);
	json_decref(patch);
	patch = parse("[]");
	assert_int_equal(pen_json_merge_patch(target, patch, &err), PEN_EINVALID);
	json_decref(target);
	json_decref(patch);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(numbers_are_ecmascripts),
		cmocka_unit_test(numbers_name_themselves),
		cmocka_unit_test(strings_and_keys_are_as_in_the_rfc),
		cmocka_unit_test(a_full_buffer_is_an_error),
		cmocka_unit_test(one_scene_has_one_text),
		cmocka_unit_test(canonical_text_is_a_fixed_point),
		cmocka_unit_test(every_part_reaches_the_canonical_text),
		cmocka_unit_test(reference_scenes_survive_the_canonical_text),
		cmocka_unit_test(merge_patch_is_as_in_the_rfc),
		cmocka_unit_test(merged_values_are_copies),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
