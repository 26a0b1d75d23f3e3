/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/parse.h"

#include "core/scene/check.h"
#include "core/scene/format.h"
#include "core/scene/resolve.h"

#include <stdio.h>
#include <stdlib.h>

/* One line for those who show one: the first offender, and how many follow. */
static int report(const struct pen_reader *reader, struct pen_error *err)
{
	const struct pen_scene_error *first = reader->errors->items;
	char more[40] = "";

	if (reader->found > 1)
		(void)snprintf(more, sizeof more, " (and %zu more)", reader->found - 1);
	return pen_error_set(err, PEN_EINVALID, "scene%s%s: %s%s", first->pointer[0] ? " at " : "",
		first->pointer, first->detail, more);
}

static int read_scene(struct pen_scene *scene, json_t *tree, struct pen_scene_errors *errors,
	struct pen_error *err)
{
	static const struct pen_place root = {0};
	struct pen_reader reader;

	pen_reader_init(&reader, scene, tree, errors);
	pen_table_read(&reader, &root, tree, &pen_format_scene, scene);
	pen_resolve_names(&reader, &root, tree);
	pen_check_scene(&reader, &root, tree);
	if (reader.out_of_memory)
		return pen_error_memory(err);
	return reader.found > 0 ? report(&reader, err) : 0;
}

int pen_scene_parse(json_t *tree, struct pen_scene **ret_scene, struct pen_scene_errors *errors,
	struct pen_error *err)
{
	struct pen_scene *scene = calloc(1, sizeof *scene);
	int r;

	errors->count = 0;
	if (!scene)
		return pen_error_memory(err);
	pen_arena_init(&scene->arena, PEN_SCENE_MEMORY_MAX);
	scene->camera.node = PEN_NO_INDEX;
	scene->background.picture = PEN_NO_INDEX;
	scene->frames = (struct pen_frames_desc){.first = 1, .last = 1, .fps = 24};
	r = read_scene(scene, tree, errors, err);
	if (r < 0)
		pen_scene_destroy(scene);
	else
		*ret_scene = scene;
	return r;
}

void pen_scene_destroy(struct pen_scene *scene)
{
	if (!scene)
		return;
	pen_arena_finish(&scene->arena);
	free(scene);
}
