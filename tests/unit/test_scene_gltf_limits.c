/* SPDX-License-Identifier: Apache-2.0 */

/* Each limit of a glTF asset at one below it, at it, and one above. */
#include "core/scene/gltf.h"
#include "core/scene/gltf_accessor.h"
#include "core/scene/gltf_container.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include <cmocka.h>

/* A text that is put together piece by piece. */
struct text {
	FILE *stream;
	char *bytes;
	size_t size;
};

static void text_begin(struct text *text, const char *head)
{
	text->stream = open_memstream(&text->bytes, &text->size);
	assert_non_null(text->stream);
	(void)fputs(head, text->stream);
}

/* The same piece count times, with commas between. */
static void repeat(struct text *text, const char *piece, size_t count)
{
	for (size_t i = 0; i < count; i++)
		(void)fprintf(text->stream, "%s%s", i > 0 ? "," : "", piece);
}

static void text_end(struct text *text, const char *tail)
{
	(void)fputs(tail, text->stream);
	assert_int_equal(fclose(text->stream), 0);
}

/* What came of reading an asset. */
struct outcome {
	struct pen_scene *scene;
	struct pen_scene_errors errors;
	struct pen_error err;
	int code;
	struct pen_asset_desc asset;
	struct pen_object_desc object;
};

/* Reads the text as the asset of a scene's only object, and lets go of it. */
static void expand(struct outcome *o, struct text *text)
{
	static const char scene[] = "{\"version\": 1, \"image\": {\"width\": 8, \"height\": 8}, "
				    "\"background\": {\"color\": [1, 1, 1]}}";
	const struct pen_blob blob = {text->bytes, text->size};
	json_t *tree;

	*o = (struct outcome){.asset = {.pointer = "/objects/0/asset"},
		.object = {.type = PEN_OBJECT_GLTF,
			.material = PEN_NO_INDEX,
			.visible = true,
			.transform = {.rotate = {0, 0, 0, 1}, .scale = {1, 1, 1}},
			.node = PEN_NO_INDEX}};
	assert_int_equal(pen_json_parse(scene, sizeof scene - 1, &tree, &o->err), 0);
	assert_int_equal(pen_scene_parse(tree, &o->scene, &o->errors, &o->err), 0);
	json_decref(tree);
	o->scene->objects = &o->object;
	o->scene->object_count = 1;
	o->scene->assets = &o->asset;
	o->scene->asset_count = 1;
	o->code = pen_scene_expand(o->scene, &blob, &o->errors, &o->err);
	free(text->bytes);
}

/* Expects it to be read, or refused in these words with the object's place. */
static void check(struct outcome *o, bool is_read, const char *words)
{
	if ((o->code == 0) != is_read)
		fail_msg("%s: %s", is_read ? "refused" : "read", o->err.text);
	if (!is_read) {
		assert_true(o->errors.count > 0);
		assert_string_equal(o->errors.items[0].pointer, "/objects/0");
		if (!strstr(o->errors.items[0].detail, words))
			fail_msg("%s", o->errors.items[0].detail);
	}
	pen_scene_destroy(o->scene);
}

#define HEAD   "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],"
#define POINTS "\"accessors\":[{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"
#define SHAPE  "{\"attributes\":{\"POSITION\":0}"

/* Bytes of nothing: only their number is looked at, or that there are spaces. */
static void text_bytes(void **state)
{
	const size_t max = PEN_GLTF_TEXT_BYTES_MAX;
	void *bytes = mmap(NULL, max + 1, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);

	(void)state;
	assert_true(bytes != MAP_FAILED);
	for (size_t size = max - 1; size <= max + 1; size++) {
		struct pen_error err = PEN_ERROR_INIT;
		struct pen_gltf_container container;

		assert_int_equal(pen_gltf_container_open(bytes, size, &container, &err),
			size <= max ? 0 : PEN_ELIMIT);
	}
	(void)munmap(bytes, max + 1);
}

static void text_depth(void **state)
{
	(void)state;
	for (size_t depth = PEN_GLTF_TEXT_DEPTH_MAX - 1; depth <= PEN_GLTF_TEXT_DEPTH_MAX + 1;
		depth++) {
		struct text text;
		struct outcome o;

		text_begin(&text, HEAD "\"nodes\":[{}],\"extras\":");
		for (size_t i = 1; i < depth; i++)
			(void)fputc('[', text.stream);
		for (size_t i = 1; i < depth; i++)
			(void)fputc(']', text.stream);
		text_end(&text, "}");
		expand(&o, &text);
		check(&o, depth <= PEN_GLTF_TEXT_DEPTH_MAX, "nested more than");
	}
}

static void text_values(void **state)
{
	(void)state;
	for (size_t count = PEN_GLTF_TEXT_VALUES_MAX - 1; count <= PEN_GLTF_TEXT_VALUES_MAX + 1;
		count++) {
		struct text text;
		struct pen_error err = PEN_ERROR_INIT;
		struct pen_gltf_container container;

		text_begin(&text, "[");
		/* One for the whole, and one for the bracket. */
		repeat(&text, "0", count - 1);
		text_end(&text, "]");
		assert_int_equal(pen_gltf_container_open(text.bytes, text.size, &container, &err),
			count <= PEN_GLTF_TEXT_VALUES_MAX ? 0 : PEN_ELIMIT);
		free(text.bytes);
	}
}

static void lists(void **state)
{
	static const char *const names[] = {
		"nodes", "meshes", "materials", "textures", "samplers", "cameras", "bufferViews"};
	static const char *const items[] = {"{}", "{\"primitives\":[]}", "{}", "{}", "{}",
		"{\"type\":\"perspective\",\"perspective\":{\"yfov\":1,\"znear\":1}}",
		"{\"buffer\":0,\"byteLength\":1}"};

	(void)state;
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		/* Of the first one also below it: the check is the same for all. */
		for (size_t count = PEN_GLTF_LIST_MAX - (i == 0); count <= PEN_GLTF_LIST_MAX + 1;
			count++) {
			struct text text;
			struct outcome o;

			text_begin(&text, HEAD);
			if (i > 0)
				(void)fputs("\"nodes\":[{}],", text.stream);
			(void)fprintf(text.stream, "\"%s\":[", names[i]);
			repeat(&text, items[i], count);
			text_end(&text, "]}");
			expand(&o, &text);
			check(&o, count <= PEN_GLTF_LIST_MAX, names[i]);
		}
	}
}

/* A chain of nodes. */
static void node_depth(void **state)
{
	(void)state;
	for (size_t depth = PEN_GLTF_DEPTH_MAX - 1; depth <= PEN_GLTF_DEPTH_MAX + 1; depth++) {
		struct text text;
		struct outcome o;

		text_begin(&text, HEAD "\"nodes\":[");
		for (size_t i = 1; i < depth; i++)
			(void)fprintf(text.stream, "{\"children\":[%zu]},", i);
		text_end(&text, "{}]}");
		expand(&o, &text);
		check(&o, depth <= PEN_GLTF_DEPTH_MAX, "node 255: more than 255 nodes stand above");
	}
}

static void morph_targets(void **state)
{
	(void)state;
	for (size_t count = PEN_GLTF_MORPHS_MAX - 1; count <= PEN_GLTF_MORPHS_MAX + 1; count++) {
		struct text text;
		struct outcome o;

		text_begin(&text,
			HEAD POINTS "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[" SHAPE
				    ",\"targets\":[");
		repeat(&text, "{\"POSITION\":0}", count);
		text_end(&text, "]}]}]}");
		expand(&o, &text);
		if (count <= PEN_GLTF_MORPHS_MAX)
			assert_int_equal(o.scene->objects[0].u.mesh.deform->morph_count, count);
		check(&o, count <= PEN_GLTF_MORPHS_MAX, "more than 64 morph targets");
	}
}

/* Beyond the limit nothing more is told; nothing else happens. */
static void warnings(void **state)
{
	(void)state;
	for (size_t count = PEN_GLTF_WARNINGS_MAX - 1; count <= PEN_GLTF_WARNINGS_MAX + 1;
		count++) {
		struct text text;
		struct outcome o;

		text_begin(&text, HEAD "\"nodes\":[{}],\"extensionsUsed\":[");
		for (size_t i = 0; i < count; i++)
			(void)fprintf(text.stream, "%s\"X_%zu\"", i > 0 ? "," : "", i);
		text_end(&text, "]}");
		expand(&o, &text);
		assert_int_equal(o.scene->warning_count,
			count < PEN_GLTF_WARNINGS_MAX ? count : PEN_GLTF_WARNINGS_MAX);
		check(&o, true, "");
	}
}

/* As many textures, one a material, of one picture or of as many. */
static void textures_of(size_t count, bool share)
{
	struct text text;
	struct outcome o;

	text_begin(&text, HEAD POINTS "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[");
	for (size_t i = 0; i < count; i++)
		(void)fprintf(text.stream, "%s" SHAPE ",\"material\":%zu}", i > 0 ? "," : "", i);
	(void)fputs("]}],\"materials\":[", text.stream);
	for (size_t i = 0; i < count; i++)
		(void)fprintf(
			text.stream, "%s{\"normalTexture\":{\"index\":%zu}}", i > 0 ? "," : "", i);
	(void)fputs("],\"textures\":[", text.stream);
	for (size_t i = 0; i < count; i++)
		(void)fprintf(text.stream, "%s{\"source\":%zu}", i > 0 ? "," : "", share ? 0 : i);
	(void)fputs("],\"images\":[", text.stream);
	repeat(&text, "{\"uri\":\"data:image/png;base64,AAAA\"}", share ? 1 : count);
	text_end(&text, "]}");
	expand(&o, &text);
	if (o.code == 0) {
		assert_int_equal(o.scene->texture_count, count);
		assert_int_equal(o.scene->picture_count, share ? 1 : count);
	}
	check(&o, count <= PEN_GLTF_TEXTURES_MAX, "more objects, lights, nodes, textures");
}

static void textures(void **state)
{
	(void)state;
	for (size_t count = PEN_GLTF_TEXTURES_MAX - 1; count <= PEN_GLTF_TEXTURES_MAX + 1;
		count++) {
		textures_of(count, true);
		textures_of(count, false);
	}
}

/* The arena's bound is lowered: what counts is that reaching it is told as a limit of the scene. */
static void memory(void **state)
{
	enum { ROOM = 1000 };

	(void)state;
	for (size_t size = ROOM - 1; size <= ROOM + 1; size++) {
		struct pen_scene scene = {0};
		struct pen_gltf_reading r = {.scene = &scene};

		pen_arena_init(&scene.arena, ROOM);
		assert_int_equal(pen_gltf_alloc(&r, size, 1) != NULL, size <= ROOM);
		assert_int_equal(r.is_full, size > ROOM);
		assert_false(r.out_of_memory);
		assert_null(pen_gltf_alloc(&r, SIZE_MAX, 2));
		assert_true(r.is_full);
		pen_arena_finish(&scene.arena);
	}
}

/* Accessors without bytes: a few that come near the limit together, and one that reaches it. */
static void zeros(void **state)
{
	enum { PART = 15, COMPONENT_FLOAT = 5126 };

	(void)state;
	for (size_t rest = PART - 1; rest <= PART + 1; rest++) {
		const struct pen_gltf_accessor accessors[] = {
			{.view = -1, .component = COMPONENT_FLOAT, .width = 3, .count = PART / 3},
			{.view = -1, .component = COMPONENT_FLOAT, .width = 1, .count = rest},
		};
		const struct pen_gltf_model model = {.accessors = accessors, .accessor_count = 2};
		struct pen_gltf_floats floats[2] = {{0}};
		struct pen_gltf_asset asset = {
			.floats = floats, .zeros = PEN_GLTF_ZEROS_MAX - 2 * PART};
		struct pen_scene_errors errors = {.count = 0};
		struct pen_scene scene = {0};
		struct pen_gltf_reading r = {.scene = &scene,
			.errors = &errors,
			.pointer = "",
			.asset = &asset,
			.model = &model};
		uint32_t count;

		pen_arena_init(&scene.arena, 1 << 20);
		for (int again = 0; again < 2; again++)
			assert_non_null(pen_gltf_accessor_floats(&r, 0, 3, PEN_GLTF_ANY, &count));
		assert_int_equal(pen_gltf_accessor_floats(&r, 1, 1, PEN_GLTF_ANY, &count) != NULL,
			rest <= PART);
		assert_int_equal(errors.count, rest > PART);
		pen_arena_finish(&scene.arena);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(text_bytes),
		cmocka_unit_test(text_depth),
		cmocka_unit_test(text_values),
		cmocka_unit_test(lists),
		cmocka_unit_test(node_depth),
		cmocka_unit_test(morph_targets),
		cmocka_unit_test(warnings),
		cmocka_unit_test(textures),
		cmocka_unit_test(memory),
		cmocka_unit_test(zeros),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
