/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Any bytes as the asset of a scene's one object: read, or refused with a reason. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static const char text[] = "{\"version\": 1, \"image\": {\"width\": 8, \"height\": 8}}";
	struct pen_asset_desc asset = {.pointer = "/objects/0/asset"};
	struct pen_object_desc object = {.type = PEN_OBJECT_GLTF,
		.material = PEN_NO_INDEX,
		.visible = true,
		.transform = {.rotate = {0, 0, 0, 1}, .scale = {1, 1, 1}},
		.node = PEN_NO_INDEX};
	const struct pen_blob blob = {data, size};
	struct pen_scene_errors errors;
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_scene *scene;
	json_t *tree;

	if (pen_json_parse(text, sizeof text - 1, &tree, &err) < 0)
		abort();
	if (pen_scene_parse(tree, &scene, &errors, &err) < 0)
		abort();
	json_decref(tree);
	scene->objects = &object;
	scene->object_count = 1;
	scene->assets = &asset;
	scene->asset_count = 1;
	if (pen_scene_expand(scene, &blob, &errors, &err) < 0 && err.text[0] == '\0')
		abort();
	pen_scene_destroy(scene);
	return 0;
}
