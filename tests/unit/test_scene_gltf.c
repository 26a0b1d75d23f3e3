/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* A scene of one glTF object, and the asset's bytes, as long as a test needs them. */
struct reading {
	struct pen_scene *scene;
	struct pen_asset_desc assets[2];
	struct pen_object_desc objects[3];
	struct pen_scene_errors errors;
	struct pen_error err;
	unsigned char *glb;
	size_t glb_size;
	int code;
};

static struct pen_scene *create_scene(const char *text)
{
	struct pen_scene_errors errors;
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_scene *scene;
	json_t *tree;

	assert_int_equal(pen_json_parse(text, strlen(text), &tree, &err), 0);
	assert_int_equal(pen_scene_parse(tree, &scene, &errors, &err), 0);
	json_decref(tree);
	return scene;
}

static void put_word(unsigned char *to, uint32_t word)
{
	for (int i = 0; i < 4; i++)
		to[i] = (unsigned char)(word >> 8 * i);
}

/* A GLB of a text and a binary chunk; in a block of exactly its size. */
static unsigned char *make_glb(const char *text, const void *chunk, size_t size, size_t *ret_size)
{
	const size_t text_size = (strlen(text) + 3) & ~(size_t)3, padded = (size + 3) & ~(size_t)3;
	const size_t total = 20 + text_size + (size > 0 ? 8 + padded : 0);
	unsigned char *glb = calloc(1, total);

	assert_non_null(glb);
	memcpy(glb, "glTF", 4);
	put_word(glb + 4, 2);
	put_word(glb + 8, (uint32_t)total);
	put_word(glb + 12, (uint32_t)text_size);
	memcpy(glb + 16, "JSON", 4);
	memset(glb + 20, ' ', text_size);
	memcpy(glb + 20, text, strlen(text));
	if (size > 0) {
		put_word(glb + 20 + text_size, (uint32_t)padded);
		memcpy(glb + 24 + text_size, "BIN\0", 4);
		memcpy(glb + 28 + text_size, chunk, size);
	}
	*ret_size = total;
	return glb;
}

static const struct pen_pose identity = {.rotate = {0, 0, 0, 1}, .scale = {1, 1, 1}};
static const char plain_scene[] = "{\"version\": 1, \"image\": {\"width\": 200, \"height\": 100}}";

/* Expands a scene text whose first object, added here, shows the asset. */
static void read_bytes(struct reading *r, const char *scene, unsigned char *bytes, size_t size)
{
	struct pen_blob blob = {bytes, size};

	*r = (struct reading){.scene = create_scene(scene), .glb = bytes, .glb_size = size};
	r->assets[0].pointer = "/objects/0/asset";
	r->objects[0] = (struct pen_object_desc){.type = PEN_OBJECT_GLTF,
		.material = PEN_NO_INDEX,
		.visible = true,
		.transform = identity,
		.node = PEN_NO_INDEX};
	r->scene->assets = r->assets;
	r->scene->asset_count = 1;
	r->scene->objects = r->objects;
	r->scene->object_count = 1;
	r->code = pen_scene_expand(r->scene, &blob, &r->errors, &r->err);
}

static void read_glb(struct reading *r, const char *text, const void *chunk, size_t size)
{
	size_t glb_size;
	unsigned char *glb = make_glb(text, chunk, size, &glb_size);

	read_bytes(r, plain_scene, glb, glb_size);
}

static void finish(struct reading *r)
{
	pen_scene_destroy(r->scene);
	free(r->glb);
}

/* Three corners, four indices of a byte, and room behind. */
static const struct {
	float positions[9];
	unsigned char indices[4];
} triangle = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2, 0}};

#define TRIANGLE_VIEWS                                                                             \
	"\"buffers\":[{\"byteLength\":40}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"     \
	"{\"buffer\":0,\"byteOffset\":36,\"byteLength\":3}],"
#define TRIANGLE_ACCESSORS                                                                         \
	"\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"  \
	"{\"bufferView\":1,\"componentType\":5121,\"count\":3,\"type\":\"SCALAR\"}],"
#define TRIANGLE_MESH                                                                              \
	"\"meshes\":[{\"name\":\"Tri\",\"primitives\":[{\"attributes\":{\"POSITION\":0},"          \
	"\"indices\":1}]}],"
#define HEAD	  "{\"asset\":{\"version\":\"2.0\"},"
#define ONE_NODE  "\"nodes\":[{\"mesh\":0}],\"scenes\":[{\"nodes\":[0]}]}"
#define TRIANGLES HEAD TRIANGLE_VIEWS TRIANGLE_ACCESSORS TRIANGLE_MESH

/* Breaks when a mesh shown once is not an object of its own, or loses a vertex or an index. */
static void test_a_triangle(void **state)
{
	struct reading r;

	(void)state;
	read_glb(&r, TRIANGLES ONE_NODE, &triangle, sizeof triangle);
	assert_string_equal(r.err.text, "");
	assert_int_equal(r.code, 0);
	assert_int_equal(r.scene->object_count, 1);

	const struct pen_object_desc *mesh = &r.scene->objects[0];

	assert_int_equal(mesh->type, PEN_OBJECT_MESH);
	assert_true(mesh->visible);
	assert_string_equal(mesh->name, "Tri");
	assert_int_equal(mesh->u.mesh.vertex_count, 3);
	assert_int_equal(mesh->u.mesh.triangle_count, 1);
	assert_memory_equal(mesh->u.mesh.vertices, triangle.positions, 36);
	for (uint32_t i = 0; i < 3; i++)
		assert_int_equal(mesh->u.mesh.indices[i], i);
	assert_int_equal(mesh->node, 0);
	assert_int_equal(r.scene->node_count, 1);
	assert_int_equal(r.scene->materials[mesh->material].type, PEN_MATERIAL_PRINCIPLED);
	assert_true(r.scene->materials[mesh->material].metallic == 1.0);
	finish(&r);
}

/* Breaks when a mesh that several nodes show is stored more than once. */
static void test_instances_share_a_mesh(void **state)
{
	struct reading r;

	(void)state;
	read_glb(&r,
		TRIANGLES "\"nodes\":[{\"mesh\":0,\"children\":[1]},{\"mesh\":0,\"translation\":[1,"
			  "2,3]}],\"scenes\":[{\"nodes\":[0]}]}",
		&triangle, sizeof triangle);
	assert_int_equal(r.code, 0);
	assert_int_equal(r.scene->object_count, 3);
	assert_int_equal(r.scene->objects[0].type, PEN_OBJECT_MESH);
	assert_false(r.scene->objects[0].visible);
	for (uint32_t i = 1; i < 3; i++) {
		assert_int_equal(r.scene->objects[i].type, PEN_OBJECT_INSTANCE);
		assert_int_equal(r.scene->objects[i].u.instance.of, 0);
		assert_int_equal(r.scene->objects[i].node, i - 1);
	}
	assert_int_equal(r.scene->nodes[1].parent, 0);
	assert_true(r.scene->nodes[1].pose.translate[2] == 3.0);
	finish(&r);
}

/* An index accessor of N-1, N and N+1 elements in a view of N bytes, and an index of N vertices. */
static void test_faults_at_the_edges(void **state)
{
	static const struct {
		const char *accessors;
		const char *fault; /* NULL: none */
	} cases[] = {
#define POSITIONS(count)                                                                           \
	"{\"bufferView\":0,\"componentType\":5126,\"count\":" count ",\"type\":\"VEC3\"}"
#define INDICES(more) ",{\"bufferView\":1,\"componentType\":5121,\"type\":\"SCALAR\"," more "}"
		{POSITIONS("3") INDICES("\"count\":3"), NULL},
		{POSITIONS("2") INDICES("\"count\":3"), "index 2 is 2"},
		{POSITIONS("4") INDICES("\"count\":3"), "leave buffer view 0"},
		{POSITIONS("18446744073709551615") INDICES("\"count\":3"), "too many"},
		{POSITIONS("3") INDICES("\"count\":2"), "whole number of triangles"},
		{POSITIONS("3") INDICES("\"count\":4"), "leave buffer view 1"},
		{POSITIONS("3") INDICES("\"count\":3,\"byteOffset\":1"), "leave buffer view 1"},
		{POSITIONS("3") INDICES("\"count\":3,\"byteOffset\":18446744073709551614"),
			"leave buffer view 1"},
	};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char text[2048];
		struct reading r;

		(void)snprintf(text, sizeof text,
			HEAD TRIANGLE_VIEWS "\"accessors\":[%s]," TRIANGLE_MESH ONE_NODE,
			cases[i].accessors);
		read_glb(&r, text, &triangle, sizeof triangle);
		assert_int_equal(r.code, cases[i].fault ? PEN_EINVALID : 0);
		assert_int_equal(r.errors.count > 0, cases[i].fault != NULL);
		if (cases[i].fault) {
			assert_string_equal(r.errors.items[0].pointer, "/objects/0");
			assert_non_null(strstr(r.errors.items[0].detail, "mesh 0 \"Tri\""));
			assert_non_null(strstr(r.errors.items[0].detail, cases[i].fault));
		}
		finish(&r);
	}
}

/* Breaks when a tree that is none is walked, or an extension that is needed is passed over. */
static void test_trees_and_extensions(void **state)
{
	static const struct {
		const char *tail, *fault;
	} cases[] = {
		{"\"nodes\":[{\"children\":[1]},{\"children\":[0]}],\"scenes\":[{\"nodes\":[0]}]}",
			"no root"},
		{"\"nodes\":[{\"children\":[0]}],\"scenes\":[{\"nodes\":[0]}]}", "another parent"},
		{"\"nodes\":[{\"children\":[7]}],\"scenes\":[{\"nodes\":[0]}]}", "no node 7"},
		{"\"nodes\":[{\"mesh\":3}],\"scenes\":[{\"nodes\":[0]}]}", "no mesh 3"},
		{"\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]," ONE_NODE,
			"KHR_draco_mesh_compression"},
		{"\"images\":[{\"uri\":\"bark.png\"}]," ONE_NODE, "bark.png"},
	};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char text[2048];
		struct reading r;

		(void)snprintf(text, sizeof text, TRIANGLES "%s", cases[i].tail);
		read_glb(&r, text, &triangle, sizeof triangle);
		assert_int_equal(r.code, PEN_EINVALID);
		assert_non_null(strstr(r.errors.items[0].detail, cases[i].fault));
		finish(&r);
	}
}

/*
 * A thousand assets with some bytes changed or cut off, from a seed: each is read or refused with a
 * reason, and a sanitizer has nothing to say.
 */
static void test_damaged_bytes(void **state)
{
	uint32_t random = 20260101;
	unsigned refused = 0;

	(void)state;
	for (int i = 0; i < 1000; i++) {
		size_t size;
		unsigned char *glb =
			make_glb(TRIANGLES ONE_NODE, &triangle, sizeof triangle, &size);
		struct reading r;

		for (int k = 0; k < 1 + i % 4; k++) {
			random = random * 1664525u + 1013904223u;
			glb[(random >> 8) % size] = (unsigned char)(random >> 24);
		}
		random = random * 1664525u + 1013904223u;
		if (i % 5 == 0) {
			size = (random >> 8) % size;
			glb = realloc(glb, size + 1);
			assert_non_null(glb);
		}
		read_bytes(&r, plain_scene, glb, size);
		refused += r.code < 0;
		assert_int_equal(r.code < 0, r.err.text[0] != '\0');
		finish(&r);
	}
	assert_in_range(refused, 200, 999);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_a_triangle),
		cmocka_unit_test(test_instances_share_a_mesh),
		cmocka_unit_test(test_faults_at_the_edges),
		cmocka_unit_test(test_trees_and_extensions),
		cmocka_unit_test(test_damaged_bytes),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
