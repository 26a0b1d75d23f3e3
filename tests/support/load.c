/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/load.h"

#include "core/base/limits.h"
#include "core/scene/gltf.h"
#include "core/scene/parse.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

void load_fail(const char *text)
{
	(void)fprintf(stderr, "%s: %s\n", program_invocation_short_name, text);
	exit(1);
}

void *load_allocate(size_t count, size_t size)
{
	void *memory = calloc(count + 1, size);

	if (!memory)
		load_fail("out of memory");
	return memory;
}

struct pen_scene *load_scene(const char *path)
{
	static struct pen_scene_errors errors;
	struct pen_error err = PEN_ERROR_INIT;
	char *text = load_allocate(PEN_SCENE_BYTES_MAX, 1);
	FILE *file = fopen(path, "rb");
	struct pen_scene *scene = NULL;
	json_t *tree = NULL;
	size_t size;

	if (!file)
		load_fail("cannot open the scene");
	size = fread(text, 1, PEN_SCENE_BYTES_MAX, file);
	(void)fclose(file);
	if (pen_json_parse(text, size, &tree, &err) < 0)
		load_fail(err.text);
	if (pen_scene_parse(tree, &scene, &errors, &err) < 0) {
		for (size_t i = 0; i < errors.count; i++)
			(void)fprintf(stderr, "%s: %s\n", errors.items[i].pointer,
				errors.items[i].detail);
		load_fail(err.text);
	}
	json_decref(tree);
	free(text);
	return scene;
}

static struct pen_blob load_asset(const char *directory, const struct pen_asset_desc *asset)
{
	char name[PEN_SHA256_TEXT], path[4096];
	struct pen_blob blob = {NULL, 0};
	FILE *file;
	void *bytes;
	long size = -1;

	pen_sha256_format(&asset->sha256, name);
	(void)snprintf(path, sizeof path, "%s/%s", directory ? directory : ".", name);
	file = fopen(path, "rb");
	if (file && fseek(file, 0, SEEK_END) == 0)
		size = ftell(file);
	if (size < 0)
		load_fail("cannot open an asset");
	rewind(file);
	bytes = load_allocate((size_t)size, 1);
	if (fread(bytes, 1, (size_t)size, file) != (size_t)size || fclose(file) != 0)
		load_fail("cannot read an asset");
	blob.bytes = bytes;
	blob.size = (size_t)size;
	return blob;
}

struct pen_pictures *load_assets(struct pen_scene *scene, const char *directory)
{
	static struct pen_scene_errors errors;
	struct pen_blob *blobs = load_allocate(scene->asset_count, sizeof *blobs);
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_pictures *pictures = NULL;

	for (uint32_t i = 0; i < scene->asset_count; i++)
		blobs[i] = load_asset(directory, &scene->assets[i]);
	if (pen_scene_expand(scene, blobs, &errors, &err) < 0 ||
		pen_pictures_load(scene, blobs, &errors, &pictures, &err) < 0) {
		for (size_t i = 0; i < errors.count; i++)
			(void)fprintf(stderr, "%s: %s\n", errors.items[i].pointer,
				errors.items[i].detail);
		load_fail(err.text);
	}
	for (uint32_t i = 0; i < scene->asset_count; i++)
		free((void *)(uintptr_t)blobs[i].bytes);
	free(blobs);
	return pictures;
}
