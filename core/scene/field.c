/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/field.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static_assert(sizeof(enum pen_kind) == sizeof(unsigned), "enums are stored as unsigned");

bool pen_number_read(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	struct pen_range range, double *ret_number)
{
	double number = json_number_value(value);

	if (!json_is_number(value)) {
		pen_reader_refuse(reader, at, "must be a number");
		return false;
	}
	if (!(number >= range.min && number <= range.max)) {
		pen_reader_refuse(reader, at, "must be from %g to %g", range.min, range.max);
		return false;
	}
	*ret_number = number + 0.0; /* -0 and 0 are one */
	return true;
}

bool pen_integer_read(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	struct pen_range range, uint32_t *ret_integer)
{
	double number = json_number_value(value);

	assert(range.min >= 0 && range.max <= UINT32_MAX);
	if (!json_is_number(value) || number != floor(number)) {
		pen_reader_refuse(reader, at, "must be a whole number");
		return false;
	}
	if (number < range.min || number > range.max) {
		if (range.min == range.max)
			pen_reader_refuse(reader, at, "must be %.0f", range.min);
		else
			pen_reader_refuse(
				reader, at, "must be from %.0f to %.0f", range.min, range.max);
		return false;
	}
	*ret_integer = (uint32_t)number;
	return true;
}

bool pen_vector_read(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	size_t count, struct pen_range range, double *ret_vector)
{
	bool good = true;

	if (!json_is_array(value) || json_array_size(value) != count) {
		pen_reader_refuse(reader, at, "must be an array of %zu numbers", count);
		return false;
	}
	for (size_t i = 0; i < count; i++) {
		struct pen_place element = pen_place_element(at, i);

		good &= pen_number_read(
			reader, &element, json_array_get(value, i), range, &ret_vector[i]);
	}
	return good;
}

static void read_boolean(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	bool *ret_boolean)
{
	if (json_is_boolean(value))
		*ret_boolean = json_is_true(value);
	else
		pen_reader_refuse(reader, at, "must be true or false");
}

static void read_text(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	const char **ret_text)
{
	if (json_is_string(value))
		*ret_text = pen_reader_text(reader, json_string_value(value));
	else
		pen_reader_refuse(reader, at, "must be a string");
}

/* The item that value names; NULL after an offence. */
static const struct pen_variant *find_variant(struct pen_reader *reader, const struct pen_place *at,
	const json_t *value, const struct pen_variant *items)
{
	char names[128] = "";
	size_t used = 0;

	for (const struct pen_variant *v = items; json_is_string(value) && v->name; v++)
		if (strcmp(v->name, json_string_value(value)) == 0)
			return v;
	for (const struct pen_variant *v = items; v->name; v++)
		used += (size_t)snprintf(
			names + used, sizeof names - used, "%s%s", v == items ? "" : ", ", v->name);
	assert(used < sizeof names);
	pen_reader_refuse(reader, at, "must be one of %s", names);
	return NULL;
}

static void read_choice(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	const struct pen_variant *items, unsigned *ret_choice)
{
	const struct pen_variant *item = find_variant(reader, at, value, items);

	if (item)
		*ret_choice = item->value;
}

static void read_list(struct pen_reader *reader, const struct pen_place *at, json_t *value,
	const struct pen_field *field, char *desc)
{
	const struct pen_list *list = field->list;
	size_t count = json_array_size(value);
	char *elements;

	if (!json_is_array(value) || count > list->max) {
		pen_reader_refuse(reader, at, "must be an array of at most %zu objects", list->max);
		return;
	}
	elements = pen_reader_alloc(reader, count, list->size);
	for (size_t i = 0; elements && i < count; i++) {
		struct pen_place element = pen_place_element(at, i);

		if (list->blank)
			memcpy(elements + i * list->size, list->blank, list->size);
		if (list->variants)
			pen_variant_read(reader, &element, json_array_get(value, i), list->variants,
				elements + i * list->size);
		else
			pen_table_read(reader, &element, json_array_get(value, i), list->table,
				elements + i * list->size);
	}
	*(void **)(desc + field->offset) = count > 0 ? elements : NULL;
	*(uint32_t *)(desc + list->count_offset) = (uint32_t)count;
}

static void read_field(struct pen_reader *reader, const struct pen_place *at, json_t *value,
	const struct pen_field *field, char *desc)
{
	void *out = desc + field->offset;

	switch (field->kind) {
	case PEN_KIND_NUMBER: (void)pen_number_read(reader, at, value, *field->range, out); break;
	case PEN_KIND_INTEGER: (void)pen_integer_read(reader, at, value, *field->range, out); break;
	case PEN_KIND_VECTOR3:
		(void)pen_vector_read(reader, at, value, 3, *field->range, out);
		break;
	case PEN_KIND_VECTOR4:
		(void)pen_vector_read(reader, at, value, 4, *field->range, out);
		break;
	case PEN_KIND_BOOLEAN: read_boolean(reader, at, value, out); break;
	case PEN_KIND_TEXT: read_text(reader, at, value, out); break;
	case PEN_KIND_CHOICE: read_choice(reader, at, value, field->choices, out); break;
	case PEN_KIND_TABLE: pen_table_read(reader, at, value, field->table, out); break;
	case PEN_KIND_VARIANT: pen_variant_read(reader, at, value, field->variants, out); break;
	case PEN_KIND_LIST: read_list(reader, at, value, field, desc); break;
	case PEN_KIND_READ: field->read(reader, at, value, out); break;
	}
}

static const struct pen_field *find_field(const struct pen_field *fields, const char *key)
{
	for (const struct pen_field *f = fields; f->key; f++)
		if (strcmp(f->key, key) == 0)
			return f;
	return NULL;
}

enum { KEY_MAX = 24 }; /* no key of the format is as long */

static size_t smallest(size_t a, size_t b, size_t c)
{
	size_t least = a < b ? a : b;

	return least < c ? least : c;
}

/* Levenshtein's distance, row by row. */
static size_t edit_distance(const char *a, const char *b)
{
	size_t row[KEY_MAX + 1], length = strlen(b);

	for (size_t j = 0; j <= length; j++)
		row[j] = j;
	for (size_t i = 0; a[i]; i++) {
		size_t diagonal = row[0];

		row[0] = i + 1;
		for (size_t j = 0; j < length; j++) {
			size_t swap = diagonal + (a[i] != b[j]);

			diagonal = row[j + 1];
			row[j + 1] = smallest(row[j] + 1, row[j + 1] + 1, swap);
		}
	}
	return row[length];
}

/* The key of the table that was probably meant, or NULL. */
static const char *nearest_key(const struct pen_field *fields, const char *key)
{
	const char *nearest = NULL;
	size_t least = 3;

	for (const struct pen_field *f = fields; f->key && strlen(key) < KEY_MAX; f++) {
		size_t distance = edit_distance(key, f->key);

		if (distance < least && distance < strlen(f->key)) {
			least = distance;
			nearest = f->key;
		}
	}
	return nearest;
}

static void refuse_key(
	struct pen_reader *reader, const struct pen_place *at, const struct pen_field *fields)
{
	bool listed = reader->errors->count < PEN_SCENE_ERRORS_MAX;
	const char *nearest = listed ? nearest_key(fields, at->key) : NULL;

	if (nearest)
		pen_reader_refuse(reader, at, "unknown key; did you mean \"%s\"?", nearest);
	else
		pen_reader_refuse(reader, at, "unknown key");
}

/* Fills and reads the members that the object does not have. */
static void read_absent(struct pen_reader *reader, const struct pen_place *at, json_t *object,
	const struct pen_table *table, void *desc)
{
	for (const struct pen_field *f = table->fields; f->key; f++) {
		struct pen_place member;
		json_t *value;

		if (f->fallback == PEN_ABSENT || json_object_get(object, f->key))
			continue;
		member = (struct pen_place){at, f->key, json_object_size(object)};
		if (strcmp(f->fallback, PEN_REQUIRED) == 0) {
			pen_reader_refuse(reader, &member, "is missing");
			continue;
		}
		pen_reader_fill(
			reader, object, f->key, json_loads(f->fallback, JSON_DECODE_ANY, NULL));
		value = json_object_get(object, f->key);
		if (value)
			read_field(reader, &member, value, f, desc);
	}
}

/* As pen_table_read; tag is a member that has been read already, or NULL. */
static void read_members(struct pen_reader *reader, const struct pen_place *at, json_t *object,
	const struct pen_table *table, const char *tag, void *desc)
{
	size_t found = reader->found, position = 0;
	const char *key;
	json_t *value;

	json_object_foreach (object, key, value) {
		const struct pen_field *field = find_field(table->fields, key);
		struct pen_place member = {at, key, position++};

		if (tag && strcmp(key, tag) == 0)
			continue;
		if (field)
			read_field(reader, &member, value, field, desc);
		else
			refuse_key(reader, &member, table->fields);
		if (!field)
			found++; /* leaves the rest fit for the check */
	}
	if (pen_reader_sound(reader))
		read_absent(reader, at, object, table, desc);
	if (table->check && reader->found == found && pen_reader_sound(reader))
		table->check(reader, at, object, desc);
}

void pen_table_read(struct pen_reader *reader, const struct pen_place *at, json_t *value,
	const struct pen_table *table, void *desc)
{
	if (json_is_object(value))
		read_members(reader, at, value, table, NULL, desc);
	else
		pen_reader_refuse(reader, at, "must be an object");
}

void pen_variant_read(struct pen_reader *reader, const struct pen_place *at, json_t *value,
	const struct pen_variants *variants, void *desc)
{
	const struct pen_variant *item;
	const json_t *name;
	struct pen_place tag;

	if (!json_is_object(value)) {
		pen_reader_refuse(reader, at, "must be an object");
		return;
	}
	tag = pen_place_member(at, value, variants->tag);
	if (!json_object_get(value, variants->tag)) {
		if (strcmp(variants->fallback, PEN_REQUIRED) == 0) {
			pen_reader_refuse(reader, &tag, "is missing");
			return;
		}
		pen_reader_fill(reader, value, variants->tag, json_string(variants->fallback));
	}
	name = json_object_get(value, variants->tag);
	item = name ? find_variant(reader, &tag, name, variants->items) : NULL;
	if (!item)
		return;
	*(unsigned *)(void *)((char *)desc + variants->offset) = item->value;
	read_members(reader, at, value, item->table, variants->tag, desc);
}
