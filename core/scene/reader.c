/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/reader.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* How many JSON values a tree holds; its depth is bounded by pen_json_parse. */
static size_t count_values(json_t *tree)
{
	const char *key;
	json_t *value;
	size_t count = 1;

	if (json_is_object(tree))
		json_object_foreach (tree, key, value)
			count += count_values(value);
	for (size_t i = 0; i < json_array_size(tree); i++)
		count += count_values(json_array_get(tree, i));
	return count;
}

static bool has_gltf(const json_t *tree)
{
	const json_t *list = json_object_get(tree, "objects");

	for (size_t i = 0; i < json_array_size(list); i++) {
		const char *type =
			json_string_value(json_object_get(json_array_get(list, i), "type"));

		if (type && strcmp(type, "gltf") == 0)
			return true;
	}
	return false;
}

void pen_reader_init(struct pen_reader *reader, struct pen_scene *scene, json_t *tree,
	struct pen_scene_errors *errors)
{
	errors->count = 0;
	*reader = (struct pen_reader){
		.scene = scene,
		.errors = errors,
		.values = count_values(tree),
		.has_gltf = has_gltf(tree),
	};
}

static void trail_init(struct pen_trail *trail, const struct pen_place *at)
{
	size_t level = 0;

	for (const struct pen_place *p = at; p->parent; p = p->parent)
		level++;
	assert(level <= PEN_SCENE_DEPTH_MAX);
	trail->depth = level;
	for (const struct pen_place *p = at; p->parent; p = p->parent)
		trail->steps[--level] = p->position;
}

static bool trail_before(const struct pen_trail *a, const struct pen_trail *b)
{
	for (size_t i = 0; i < a->depth && i < b->depth; i++)
		if (a->steps[i] != b->steps[i])
			return a->steps[i] < b->steps[i];
	return a->depth < b->depth;
}

/* Appends to a text of the given size; a character that does not fit whole is left out. */
static size_t append(char *text, size_t size, size_t used, const char *piece, size_t length)
{
	if (length >= size - used)
		return size;
	memcpy(text + used, piece, length);
	text[used + length] = '\0';
	return used + length;
}

static size_t append_key(char *text, size_t size, size_t used, const char *key)
{
	while (*key && used < size) {
		size_t length = 1;

		while (((unsigned char)key[length] & 0xC0) == 0x80)
			length++;
		if (*key == '~')
			used = append(text, size, used, "~0", 2);
		else if (*key == '/')
			used = append(text, size, used, "~1", 2);
		else
			used = append(text, size, used, key, length);
		key += length;
	}
	return used;
}

/* RFC 6901; a pointer too long for its room is cut between two characters. */
static void write_pointer(char *text, size_t size, const struct pen_place *at)
{
	const struct pen_place *steps[PEN_SCENE_DEPTH_MAX + 1];
	size_t depth = 0, used = 0;
	char index[24];

	text[0] = '\0';
	for (const struct pen_place *p = at; p->parent; p = p->parent)
		steps[depth++] = p;
	while (depth > 0 && used < size) {
		const struct pen_place *step = steps[--depth];

		used = append(text, size, used, "/", 1);
		(void)snprintf(index, sizeof index, "%zu", step->position);
		if (used < size)
			used = append_key(text, size, used, step->key ? step->key : index);
	}
}

void pen_reader_refuse(
	struct pen_reader *reader, const struct pen_place *at, const char *format, ...)
{
	struct pen_scene_errors *errors = reader->errors;
	struct pen_scene_error *error;
	struct pen_trail trail;
	size_t slot = errors->count, moved;
	va_list args;

	reader->found++;
	trail_init(&trail, at);
	while (slot > 0 && trail_before(&trail, &reader->trails[slot - 1]))
		slot--;
	if (slot == PEN_SCENE_ERRORS_MAX)
		return;

	/* Make room; the last one falls off a full list. */
	if (errors->count < PEN_SCENE_ERRORS_MAX)
		errors->count++;
	moved = errors->count - 1 - slot;
	memmove(&errors->items[slot + 1], &errors->items[slot], moved * sizeof *errors->items);
	memmove(&reader->trails[slot + 1], &reader->trails[slot], moved * sizeof *reader->trails);

	reader->trails[slot] = trail;
	error = &errors->items[slot];
	write_pointer(error->pointer, sizeof error->pointer, at);
	va_start(args, format);
	(void)vsnprintf(error->detail, sizeof error->detail, format, args);
	va_end(args);
}

void *pen_reader_alloc(struct pen_reader *reader, size_t count, size_t size)
{
	void *memory = pen_arena_alloc(&reader->scene->arena, count, size);

	if (!memory)
		reader->out_of_memory = true;
	return memory;
}

const char *pen_reader_text(struct pen_reader *reader, const char *text)
{
	const char *copy = pen_arena_text(&reader->scene->arena, text, strlen(text));

	if (!copy)
		reader->out_of_memory = true;
	return copy;
}

const char *pen_reader_pointer(struct pen_reader *reader, const struct pen_place *at)
{
	char pointer[sizeof reader->errors->items[0].pointer];

	write_pointer(pointer, sizeof pointer, at);
	return pen_reader_text(reader, pointer);
}

bool pen_reader_sound(const struct pen_reader *reader)
{
	return !reader->out_of_memory && reader->values <= PEN_SCENE_NODES_MAX;
}

void pen_reader_fill(struct pen_reader *reader, json_t *object, const char *key, json_t *value)
{
	reader->values += value ? count_values(value) : 0;
	if (reader->values > PEN_SCENE_NODES_MAX)
		json_decref(value);
	else if (json_object_set_new_nocheck(object, key, value) < 0)
		reader->out_of_memory = true;
}

struct pen_place pen_place_member(const struct pen_place *parent, json_t *object, const char *key)
{
	struct pen_place place = {.parent = parent, .key = key};

	for (void *i = json_object_iter(object); i; i = json_object_iter_next(object, i)) {
		if (strcmp(json_object_iter_key(i), key) == 0)
			break;
		place.position++;
	}
	return place;
}

struct pen_place pen_place_element(const struct pen_place *parent, size_t index)
{
	return (struct pen_place){.parent = parent, .position = index};
}
