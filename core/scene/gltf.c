/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf.h"

#include "core/scene/gltf_camera.h"
#include "core/scene/gltf_node.h"
#include "core/scene/gltf_place.h"
#include "core/scene/gltf_reading.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const known_extensions[] = {
	"KHR_lights_punctual",
	"KHR_materials_clearcoat",
	"KHR_materials_emissive_strength",
	"KHR_materials_ior",
	"KHR_materials_specular",
	"KHR_materials_transmission",
	"KHR_materials_unlit",
	"KHR_mesh_quantization",
	"KHR_texture_transform",
};

bool pen_gltf_knows(const char *extension)
{
	for (size_t i = 0; i < sizeof known_extensions / sizeof *known_extensions; i++)
		if (strcmp(extension, known_extensions[i]) == 0)
			return true;
	return false;
}

static void tell_extensions(struct pen_gltf_reading *r)
{
	for (size_t i = 0; i < r->model->used_count; i++)
		if (!pen_gltf_knows(r->model->used[i]))
			pen_gltf_warn(r, "the extension %.60s is not supported and is left out",
				r->model->used[i]);
}

static void *fill_none(struct pen_gltf_reading *r, size_t count)
{
	uint32_t *indices = pen_gltf_alloc(r, count, sizeof *indices);

	if (indices)
		memset(indices, 0xff, count * sizeof *indices);
	return indices;
}

/* Room for what is known of an asset. */
static void prepare(struct pen_gltf_reading *r)
{
	const struct pen_gltf_model *m = r->model;
	struct pen_gltf_asset *a = r->asset;

	a->floats = pen_gltf_alloc(r, m->accessor_count, sizeof *a->floats);
	a->shapes = pen_gltf_alloc(r, m->mesh_count, sizeof *a->shapes);
	for (size_t i = 0; a->shapes && i < m->mesh_count; i++)
		a->shapes[i].first = PEN_NO_INDEX;
	a->materials = fill_none(r, m->material_count + 1);
	a->pictures = fill_none(r, m->image_count);
	a->textures = fill_none(r, 2 * m->texture_count);
}

/* Makes an asset the one at hand; false when it is refused as a whole. */
static bool enter(struct pen_gltf_reading *r, struct pen_gltf_asset *asset)
{
	r->asset = asset;
	r->place[0] = '\0';
	r->part = 0;
	r->model = asset->gltf ? pen_gltf_content(asset->gltf) : NULL;
	return r->model != NULL;
}

static void open_asset(
	struct pen_gltf_reading *r, struct pen_gltf_asset *asset, const struct pen_blob *blob)
{
	struct pen_error err = PEN_ERROR_INIT;

	(void)enter(r, asset);
	if (pen_gltf_create(blob->bytes, blob->size, &asset->gltf, &err) < 0) {
		if (err.code == PEN_ENOMEM)
			r->out_of_memory = true;
		pen_gltf_refuse(r, "%s", err.text);
		return;
	}
	if (!enter(r, asset))
		return;
	tell_extensions(r);
	prepare(r);
	if (pen_gltf_sound(r))
		pen_gltf_tree_read(r);
}

/* The objects of the text, the assets, and where the objects went. */
struct expansion {
	struct pen_gltf_reading reading;
	const struct pen_blob *blobs;
	struct pen_gltf_asset *assets; /* one each of the scene's; equal files share the first */
	uint32_t *places;	       /* of the text's objects in the list; PEN_NO_INDEX: none */
};

static const char *pointer_of(struct pen_gltf_reading *r, uint32_t object)
{
	char pointer[32];

	(void)snprintf(pointer, sizeof pointer, "/objects/%u", object);
	return pen_gltf_text(r, pointer);
}

static struct pen_gltf_asset *asset_of(struct expansion *e, uint32_t object, uint32_t asset)
{
	const struct pen_scene *scene = e->reading.scene;
	uint32_t first = 0;

	while (memcmp(&scene->assets[first].sha256, &scene->assets[asset].sha256,
		       sizeof scene->assets->sha256) != 0)
		first++;
	if (!e->assets[first].is_open) {
		e->assets[first].is_open = true;
		e->assets[first].index = first;
		e->reading.pointer = pointer_of(&e->reading, object);
		open_asset(&e->reading, &e->assets[first], &e->blobs[first]);
	}
	return &e->assets[first];
}

/* The glTF object that an object is, or is an instance of; NULL: neither. */
static const struct pen_object_desc *gltf_of(const struct pen_scene *scene, uint32_t index)
{
	const struct pen_object_desc *object = &scene->objects[index];

	if (object->type == PEN_OBJECT_INSTANCE)
		object = &scene->objects[object->u.instance.of];
	return object->type == PEN_OBJECT_GLTF ? object : NULL;
}

static void keep_objects(struct expansion *e)
{
	struct pen_gltf_reading *r = &e->reading;
	const struct pen_scene *scene = r->scene;
	struct pen_object_desc *kept;

	for (uint32_t i = 0; i < scene->object_count; i++) {
		e->places[i] = PEN_NO_INDEX;
		if (!gltf_of(scene, i))
			e->places[i] = pen_gltf_add(r, &r->objects, &scene->objects[i],
				sizeof *scene->objects, PEN_OBJECTS_MAX);
	}
	kept = (struct pen_object_desc *)(void *)r->objects.data;
	for (size_t i = 0; i < r->objects.size / sizeof *kept; i++)
		if (kept[i].type == PEN_OBJECT_INSTANCE)
			kept[i].u.instance.of = e->places[kept[i].u.instance.of];
}

/* For each copy of an asset, in the order of the text. */
static void for_each_copy(struct expansion *e, void (*act)(struct expansion *, uint32_t))
{
	const struct pen_scene *scene = e->reading.scene;

	for (uint32_t i = 0; i < scene->object_count && pen_gltf_sound(&e->reading); i++) {
		const struct pen_object_desc *gltf = gltf_of(scene, i);

		if (!gltf || !enter(&e->reading, asset_of(e, i, gltf->u.gltf.asset)))
			continue;
		e->reading.pointer = pointer_of(&e->reading, i);
		act(e, i);
	}
}

static void count_copy(struct expansion *e, uint32_t object)
{
	if (e->reading.scene->objects[object].visible)
		pen_gltf_place_count(&e->reading);
}

static void place_copy(struct expansion *e, uint32_t object)
{
	const struct pen_scene *scene = e->reading.scene;
	struct pen_object_desc placed = scene->objects[object];

	if (placed.type == PEN_OBJECT_INSTANCE && placed.material == PEN_NO_INDEX)
		placed.material = scene->objects[placed.u.instance.of].material;
	pen_gltf_place(&e->reading, &placed);
}

static int conclude(struct pen_gltf_reading *r, struct pen_error *err)
{
	const struct pen_scene_error *first = r->errors->items;
	char more[40] = "";

	if (r->out_of_memory)
		return pen_error_memory(err);
	if (r->is_full)
		pen_gltf_refuse(r,
			"with this the glTF assets hold more objects, lights, nodes, textures "
			"or numbers than a scene may");
	if (r->found == 0)
		return 0;
	if (r->found > 1)
		(void)snprintf(more, sizeof more, " (and %zu more)", r->found - 1);
	return pen_error_set(err, r->is_full ? PEN_ELIMIT : PEN_EINVALID, "scene at %s: %s%s",
		first->pointer, first->detail, more);
}

/* Whether anything may shine: a background, a light, or a material. */
static bool has_light(const struct pen_gltf_reading *r)
{
	const struct pen_background_desc *b = &r->scene->background;
	const struct pen_material_desc *materials =
		(const struct pen_material_desc *)(const void *)r->materials.data;
	bool shines = r->lights.size > 0 || b->picture != PEN_NO_INDEX || b->color[0] > 0.0 ||
		      b->color[1] > 0.0 || b->color[2] > 0.0;

	for (size_t i = 0; i < r->materials.size / sizeof *materials; i++) {
		const double *e = materials[i].emission;

		shines |= materials[i].is_unlit || e[0] > 0.0 || e[1] > 0.0 || e[2] > 0.0;
	}
	return shines;
}

static int expand(struct expansion *e, struct pen_error *err)
{
	struct pen_gltf_reading *r = &e->reading;
	int code;

	keep_objects(e);
	for_each_copy(e, count_copy);
	for_each_copy(e, place_copy);
	if (r->found == 0 && pen_gltf_sound(r))
		pen_gltf_camera_choose(r);
	if (r->found == 0 && pen_gltf_sound(r) && !has_light(r)) {
		r->pointer = "/background";
		r->place[0] = '\0';
		pen_gltf_warn(r, "nothing gives light: the scene and its files have no lamp and no "
				 "emission, and the background is black");
	}
	code = conclude(r, err);
	if (code == 0) {
		pen_gltf_reading_take(r);
		code = conclude(r, err);
	}
	return code;
}

static bool has_work(const struct pen_scene *scene)
{
	for (uint32_t i = 0; i < scene->object_count; i++)
		if (gltf_of(scene, i))
			return true;
	return scene->camera.from != NULL;
}

int pen_scene_expand(struct pen_scene *scene, const struct pen_blob *blobs,
	struct pen_scene_errors *errors, struct pen_error *err)
{
	struct expansion e = {.blobs = blobs};
	int r;

	errors->count = 0;
	if (!has_work(scene))
		return 0;
	scene->arena.max = PEN_GLTF_MEMORY_MAX;
	pen_gltf_reading_init(&e.reading, scene, errors);
	e.assets = calloc(scene->asset_count + 1ul, sizeof *e.assets);
	e.places = calloc(scene->object_count + 1ul, sizeof *e.places);
	r = e.assets && e.places ? expand(&e, err) : pen_error_memory(err);
	for (uint32_t i = 0; e.assets && i < scene->asset_count; i++)
		pen_gltf_destroy(e.assets[i].gltf);
	pen_gltf_reading_finish(&e.reading);
	free(e.assets);
	free(e.places);
	return r;
}
