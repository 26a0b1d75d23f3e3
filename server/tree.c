/* SPDX-License-Identifier: Apache-2.0 */
#include "server/tree.h"

#include "core/base/buf.h"
#include "core/base/limits.h"

static void give_up(json_t **tree)
{
	json_decref(*tree);
	*tree = NULL;
}

void pen_tree_set(json_t **object, const char *key, json_t *value)
{
	if (json_object_set_new_nocheck(*object, key, value) < 0)
		give_up(object);
}

void pen_tree_append(json_t **array, json_t *value)
{
	if (json_array_append_new(*array, value) < 0)
		give_up(array);
}

static int append_text(const char *bytes, size_t size, void *text)
{
	return pen_buf_append(text, bytes, size);
}

char *pen_tree_text(json_t *tree)
{
	struct pen_buf text;
	int r;

	pen_buf_init(&text, PEN_SCENE_MEMORY_MAX);
	r = json_dump_callback(
		tree, append_text, &text, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(12));
	json_decref(tree);
	if (r == 0 && !text.failed)
		return pen_buf_take(&text);
	pen_buf_finish(&text);
	return NULL;
}
