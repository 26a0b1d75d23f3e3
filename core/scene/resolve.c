/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/resolve.h"

#include <stdlib.h>
#include <string.h>

static int compare_name(const void *name, const void *material)
{
	return strcmp(name, ((const struct pen_material_desc *)material)->name);
}

static void resolve_material(struct pen_reader *reader, const struct pen_place *at, json_t *object,
	struct pen_object_desc *desc)
{
	const struct pen_scene *scene = reader->scene;
	const json_t *value = json_object_get(object, "material");
	const struct pen_material_desc *found;
	struct pen_place place;

	desc->material = PEN_NO_INDEX;
	if (!json_is_string(value) || !scene->materials)
		return;
	found = bsearch(json_string_value(value), scene->materials, scene->material_count,
		sizeof *found, compare_name);
	if (found) {
		desc->material = (uint32_t)(found - scene->materials);
		return;
	}
	place = pen_place_member(at, object, "material");
	pen_reader_refuse(reader, &place, "names no material of this scene");
}

/* The room for this material was made when the others were read. */
static void add_default_material(struct pen_scene *scene)
{
	bool needed = false;

	for (uint32_t i = 0; i < scene->object_count; i++) {
		struct pen_object_desc *object = &scene->objects[i];

		if (object->material == PEN_NO_INDEX && object->type != PEN_OBJECT_INSTANCE) {
			object->material = scene->material_count;
			needed = true;
		}
	}
	if (needed)
		scene->materials[scene->material_count++] = (struct pen_material_desc){
			.name = "", .type = PEN_MATERIAL_MATTE, .color = {0.5, 0.5, 0.5}};
}

/* What no text refers to. */
static void set_absent_indices(struct pen_scene *scene)
{
	scene->camera.node = PEN_NO_INDEX;
	scene->background.picture = PEN_NO_INDEX;
	for (uint32_t i = 0; i < scene->object_count; i++)
		scene->objects[i].node = PEN_NO_INDEX;
	for (uint32_t i = 0; i < scene->light_count; i++)
		scene->lights[i].node = PEN_NO_INDEX;
	for (uint32_t i = 0; i < scene->material_count; i++)
		for (int k = 0; k < PEN_INPUT_COUNT; k++)
			scene->materials[i].inputs[k].texture = PEN_NO_INDEX;
}

/* Enters an object's name into a map from names to indices. */
static void enter_name(struct pen_reader *reader, const struct pen_place *at, json_t *object,
	size_t index, json_t *ret_names)
{
	const char *name = json_string_value(json_object_get(object, "name"));
	struct pen_place place;

	if (!name)
		return;
	if (json_object_get(ret_names, name)) {
		place = pen_place_member(at, object, "name");
		pen_reader_refuse(reader, &place, "is the name of an earlier object");
	} else if (json_object_set_new(ret_names, name, json_integer((json_int_t)index)) < 0) {
		reader->out_of_memory = true;
	}
}

static void resolve_instance(struct pen_reader *reader, const struct pen_place *at, json_t *object,
	const json_t *names, struct pen_object_desc *desc)
{
	const char *name = json_string_value(json_object_get(object, "of"));
	struct pen_place place = pen_place_member(at, object, "of");
	const json_t *index;

	if (!name || desc->type != PEN_OBJECT_INSTANCE)
		return;
	index = json_object_get(names, name);
	if (!index) {
		pen_reader_refuse(reader, &place, "names no object of this scene");
		return;
	}
	desc->u.instance.of = (uint32_t)json_integer_value(index);
	if (reader->scene->objects[desc->u.instance.of].type == PEN_OBJECT_INSTANCE)
		pen_reader_refuse(reader, &place, "must not name an instance");
}

void pen_resolve_names(struct pen_reader *reader, const struct pen_place *root, json_t *tree)
{
	struct pen_scene *scene = reader->scene;
	json_t *list = json_object_get(tree, "objects"), *names = json_object();
	struct pen_place place = pen_place_member(root, tree, "objects");

	if (!names)
		reader->out_of_memory = true;
	for (uint32_t i = 0; names && i < scene->object_count; i++) {
		struct pen_place element = pen_place_element(&place, i);

		enter_name(reader, &element, json_array_get(list, i), i, names);
		resolve_material(reader, &element, json_array_get(list, i), &scene->objects[i]);
	}
	for (uint32_t i = 0; names && i < scene->object_count; i++) {
		struct pen_place element = pen_place_element(&place, i);

		resolve_instance(
			reader, &element, json_array_get(list, i), names, &scene->objects[i]);
	}
	if (scene->materials)
		add_default_material(scene);
	set_absent_indices(scene);
	json_decref(names);
}
