/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/*
 * Reads glTF files as a scene process does, without rendering. For each: "accepted FILE objects=N
 * ...", or "refused FILE" and a line for each error; then its warnings.
 */

static void *read_file(const char *path, size_t *ret_size)
{
	FILE *file = fopen(path, "rb");
	char *bytes = NULL;
	size_t size = 0, got = 0;

	if (!file) {
		(void)fprintf(stderr, "gltf-read: cannot open %s\n", path);
		exit(2);
	}
	do {
		bytes = realloc(bytes, size + (1u << 20));
		if (!bytes)
			exit(2);
		got = fread(bytes + size, 1, 1u << 20, file);
		size += got;
	} while (got > 0);
	(void)fclose(file);
	/* Exactly as large as the file, so that a sanitizer sees what reads beyond. */
	*ret_size = size;
	return realloc(bytes, size > 0 ? size : 1);
}

static struct pen_scene *create_scene(void)
{
	static const char text[] = "{\"version\": 1, \"image\": {\"width\": 64, \"height\": 36}}";
	struct pen_scene_errors errors;
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_scene *scene;
	json_t *tree;

	if (pen_json_parse(text, sizeof text - 1, &tree, &err) < 0 ||
		pen_scene_parse(tree, &scene, &errors, &err) < 0)
		exit(2);
	json_decref(tree);
	return scene;
}

static void report(const char *path, const struct pen_scene *scene, int code,
	const struct pen_scene_errors *errors, const struct pen_error *err)
{
	if (code == 0)
		printf("accepted %s objects=%u nodes=%u materials=%u textures=%u lights=%u "
		       "skins=%u\n",
			path, scene->object_count, scene->node_count, scene->material_count,
			scene->texture_count, scene->light_count, scene->skin_count);
	else
		printf("refused %s: %s\n", path, err->text);
	for (size_t i = 0; code < 0 && i < errors->count; i++)
		printf("  error %s: %s\n", errors->items[i].pointer, errors->items[i].detail);
	for (uint32_t i = 0; code == 0 && i < scene->warning_count; i++)
		printf("  warning %s\n", scene->warnings[i]);
}

int main(int argc, char **argv)
{
	for (int i = 1; i < argc; i++) {
		struct pen_asset_desc asset = {.pointer = "/objects/0/asset"};
		struct pen_object_desc object = {.type = PEN_OBJECT_GLTF,
			.material = PEN_NO_INDEX,
			.visible = true,
			.transform = {.rotate = {0, 0, 0, 1}, .scale = {1, 1, 1}},
			.node = PEN_NO_INDEX};
		struct pen_scene *scene = create_scene();
		struct pen_scene_errors errors;
		struct pen_error err = PEN_ERROR_INIT;
		struct pen_blob blob;
		void *bytes = read_file(argv[i], &blob.size);

		blob.bytes = bytes;
		scene->objects = &object;
		scene->object_count = 1;
		scene->assets = &asset;
		scene->asset_count = 1;
		report(argv[i], scene, pen_scene_expand(scene, &blob, &errors, &err), &errors,
			&err);
		pen_scene_destroy(scene);
		free(bytes);
	}
	return 0;
}
