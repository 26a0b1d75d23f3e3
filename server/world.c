/* SPDX-License-Identifier: Apache-2.0 */
#include "server/world.h"

#include "core/base/limits.h"
#include "core/scene/canonical.h"
#include "server/tree.h"

#include <stdint.h>
#include <string.h>

/* Members of the scene are shared, not copied. */
static json_t *without_view(const json_t *tree, const json_t *camera)
{
	json_t *world = json_object(), *value;
	const char *key;

	json_object_foreach ((json_t *)(uintptr_t)tree, key, value) {
		if (strcmp(key, "image") != 0 && strcmp(key, "sampling") != 0)
			pen_tree_set(&world, key, json_incref(value));
	}
	value = json_object_get(camera, "shutter");
	if (value)
		pen_tree_set(&world, "camera", json_incref(value));
	else
		pen_tree_set(&world, "camera", json_null());
	return world;
}

int pen_world_of(const json_t *tree, bool *ret_has_world, struct pen_sha256 *ret_world,
	struct pen_error *err)
{
	const json_t *camera = json_object_get(tree, "camera");
	const json_t *from = json_object_get(camera, "from");
	struct pen_buf text;
	json_t *world;
	int r;

	*ret_has_world = false;
	if (!json_object_get(camera, "position") || (from && !json_is_null(from)))
		return 0;
	world = without_view(tree, camera);
	pen_buf_init(&text, PEN_SCENE_MEMORY_MAX);
	r = world ? pen_json_canonical(world, &text, err) : pen_error_memory(err);
	if (r == 0)
		r = pen_sha256_of(text.data, text.size, ret_world, err);
	*ret_has_world = r == 0;
	pen_buf_finish(&text);
	json_decref(world);
	return r;
}
