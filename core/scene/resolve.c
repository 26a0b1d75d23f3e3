/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/resolve.h"

#include "core/scene/input.h"

#include <stdlib.h>
#include <string.h>

static int compare_name(const void *name, const void *material)
{
	return strcmp(name, ((const struct pen_material_desc *)material)->name);
}

static struct pen_material_desc *find_material(const struct pen_scene *scene, const char *name)
{
	if (!scene->materials)
		return NULL;
	return bsearch(name, scene->materials, scene->material_count, sizeof *scene->materials,
		compare_name);
}

static void resolve_textures(struct pen_reader *reader, const struct pen_place *root, json_t *tree)
{
	struct pen_place list = pen_place_member(root, tree, "materials");
	struct pen_place place = {.parent = &list};
	struct pen_material_desc *material;
	json_t *element;

	json_object_foreach (json_object_get(tree, "materials"), place.key, element) {
		material = find_material(reader->scene, place.key);
		if (material)
			pen_input_resolve(reader, &place, element, material);
		place.position++;
	}
}

static void resolve_material(struct pen_reader *reader, const struct pen_place *at, json_t *object,
	struct pen_object_desc *desc)
{
	const struct pen_scene *scene = reader->scene;
	const json_t *value = json_object_get(object, "material");
	const struct pen_material_desc *found;
	struct pen_place place;

	if (!json_is_string(value) || !scene->materials)
		return;
	found = find_material(scene, json_string_value(value));
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
	struct pen_material_desc *material;
	bool needed = false;

	for (uint32_t i = 0; i < scene->object_count; i++) {
		struct pen_object_desc *object = &scene->objects[i];

		if (object->material == PEN_NO_INDEX &&
			(object->type == PEN_OBJECT_SPHERE || object->type == PEN_OBJECT_MESH)) {
			object->material = scene->material_count;
			needed = true;
		}
	}
	if (!needed)
		return;
	material = &scene->materials[scene->material_count++];
	*material = pen_blank_material;
	material->name = "";
	material->type = PEN_MATERIAL_MATTE;
	for (size_t i = 0; i < 3; i++)
		material->color[i] = 0.5;
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
	resolve_textures(reader, root, tree);
	if (scene->materials)
		add_default_material(scene);
	json_decref(names);
}
