/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_reading.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { LIST_COUNT = 9, NAME_SHOWN = 40 };

static void list_lists(struct pen_gltf_reading *r, struct pen_buf *ret_lists[LIST_COUNT])
{
	struct pen_buf *const lists[LIST_COUNT] = {&r->objects, &r->nodes, &r->lights,
		&r->materials, &r->textures, &r->pictures, &r->skins, &r->cameras, &r->warnings};

	memcpy(ret_lists, lists, sizeof lists);
}

static void load(struct pen_gltf_reading *r, struct pen_buf *list, const void *items, size_t count,
	size_t size)
{
	if (count > 0 && pen_buf_append(list, items, count * size) < 0)
		r->out_of_memory = true;
}

void pen_gltf_reading_init(
	struct pen_gltf_reading *r, struct pen_scene *scene, struct pen_scene_errors *errors)
{
	struct pen_buf *lists[LIST_COUNT];

	*r = (struct pen_gltf_reading){.scene = scene, .errors = errors, .pointer = ""};
	errors->count = 0;
	list_lists(r, lists);
	for (int i = 0; i < LIST_COUNT; i++)
		pen_buf_init(lists[i], PEN_GLTF_MEMORY_MAX);
	load(r, &r->nodes, scene->nodes, scene->node_count, sizeof *scene->nodes);
	load(r, &r->lights, scene->lights, scene->light_count, sizeof *scene->lights);
	load(r, &r->materials, scene->materials, scene->material_count, sizeof *scene->materials);
	load(r, &r->textures, scene->textures, scene->texture_count, sizeof *scene->textures);
	load(r, &r->pictures, scene->pictures, scene->picture_count, sizeof *scene->pictures);
	load(r, &r->skins, scene->skins, scene->skin_count, sizeof *scene->skins);
	load(r, &r->warnings, scene->warnings, scene->warning_count, sizeof *scene->warnings);
}

void pen_gltf_reading_finish(struct pen_gltf_reading *r)
{
	struct pen_buf *lists[LIST_COUNT];

	list_lists(r, lists);
	for (int i = 0; i < LIST_COUNT; i++)
		pen_buf_finish(lists[i]);
}

static void *take(
	struct pen_gltf_reading *r, const struct pen_buf *list, size_t size, uint32_t *ret_count)
{
	void *items = pen_gltf_alloc(r, list->size, 1);

	if (items && list->size > 0)
		memcpy(items, list->data, list->size);
	*ret_count = items ? (uint32_t)(list->size / size) : 0;
	return items;
}

void pen_gltf_reading_take(struct pen_gltf_reading *r)
{
	struct pen_scene *s = r->scene;

	s->objects = take(r, &r->objects, sizeof *s->objects, &s->object_count);
	s->nodes = take(r, &r->nodes, sizeof *s->nodes, &s->node_count);
	s->lights = take(r, &r->lights, sizeof *s->lights, &s->light_count);
	s->materials = take(r, &r->materials, sizeof *s->materials, &s->material_count);
	s->textures = take(r, &r->textures, sizeof *s->textures, &s->texture_count);
	s->pictures = take(r, &r->pictures, sizeof *s->pictures, &s->picture_count);
	s->skins = take(r, &r->skins, sizeof *s->skins, &s->skin_count);
	s->warnings = take(r, &r->warnings, sizeof *s->warnings, &s->warning_count);
}

/* Characters that end a line or ring a bell are none to show. */
static void make_printable(char *text)
{
	for (; *text; text++)
		if ((unsigned char)*text < 0x20 || *text == 0x7f)
			*text = '?';
}

void pen_gltf_at(struct pen_gltf_reading *r, const char *kind, size_t index, const char *name)
{
	if (name && name[0])
		(void)snprintf(r->place, sizeof r->place, "%s %zu \"%.*s\"", kind, index,
			NAME_SHOWN, name);
	else
		(void)snprintf(r->place, sizeof r->place, "%s %zu", kind, index);
	make_printable(r->place);
	r->part = strlen(r->place);
}

void pen_gltf_at_part(struct pen_gltf_reading *r, const char *format, ...)
{
	char part[80];
	va_list args;

	va_start(args, format);
	(void)vsnprintf(part, sizeof part, format, args);
	va_end(args);
	make_printable(part);
	(void)snprintf(r->place + r->part, sizeof r->place - r->part, "%s%s",
		r->part > 0 && part[0] ? ", " : "", part);
}

void pen_gltf_refuse(struct pen_gltf_reading *r, const char *format, ...)
{
	struct pen_scene_error *error = &r->errors->items[r->errors->count];
	char fault[256];
	size_t length;
	va_list args;

	if (r->found++ >= PEN_SCENE_ERRORS_MAX)
		return;
	va_start(args, format);
	(void)vsnprintf(fault, sizeof fault, format, args);
	va_end(args);
	make_printable(fault);
	(void)snprintf(error->pointer, sizeof error->pointer, "%s", r->pointer);
	(void)snprintf(
		error->detail, sizeof error->detail, "%s%s", r->place, r->place[0] ? ": " : "");
	length = strlen(error->detail);
	(void)snprintf(error->detail + length, sizeof error->detail - length, "%s", fault);
	r->errors->count++;
}

void pen_gltf_warn(struct pen_gltf_reading *r, const char *format, ...)
{
	char fault[256], line[512];
	const char *text;
	va_list args;

	if (r->warnings.size / sizeof text >= PEN_GLTF_WARNINGS_MAX)
		return;
	va_start(args, format);
	(void)vsnprintf(fault, sizeof fault, format, args);
	va_end(args);
	make_printable(fault);
	(void)snprintf(line, sizeof line, "%s: %s%s%s", r->pointer, r->place,
		r->place[0] ? ": " : "", fault);
	text = pen_gltf_text(r, line);
	for (size_t i = 0; text && i < r->warnings.size / sizeof text; i++)
		if (strcmp(((const char *const *)(const void *)r->warnings.data)[i], text) == 0)
			return;
	if (text && pen_buf_append(&r->warnings, &text, sizeof text) < 0)
		r->out_of_memory = true;
}

void *pen_gltf_alloc(struct pen_gltf_reading *r, size_t count, size_t size)
{
	const struct pen_arena *arena = &r->scene->arena;
	void *memory = pen_arena_alloc(&r->scene->arena, count, size);
	size_t total;

	if (memory)
		return memory;
	if (__builtin_mul_overflow(count, size, &total) || total > arena->max - arena->used)
		r->is_full = true;
	else
		r->out_of_memory = true;
	return NULL;
}

const char *pen_gltf_text(struct pen_gltf_reading *r, const char *text)
{
	const size_t length = strlen(text);
	char *copy = pen_arena_text(&r->scene->arena, text,
		length < PEN_SCENE_STRING_MAX ? length : PEN_SCENE_STRING_MAX);

	if (copy)
		make_printable(copy);
	else
		r->out_of_memory = true;
	return copy;
}

uint32_t pen_gltf_add(struct pen_gltf_reading *r, struct pen_buf *list, const void *item,
	size_t size, uint32_t max)
{
	const uint32_t index = (uint32_t)(list->size / size);

	if (index >= max)
		r->is_full = true;
	else if (pen_buf_append(list, item, size) < 0)
		r->out_of_memory = true;
	else
		return index;
	return PEN_NO_INDEX;
}
