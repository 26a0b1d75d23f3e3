/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_FIELD_H
#define PEN_SCENE_FIELD_H

#include "core/scene/reader.h"

/*
 * The scene format as tables: a row for each key says what its value must be, where it goes in the
 * description, and what stands for it when it is absent. Reading collects every offender and fills
 * the tree's absent members.
 */

enum pen_kind {
	PEN_KIND_NUMBER,  /* double in range */
	PEN_KIND_INTEGER, /* uint32_t in range */
	PEN_KIND_VECTOR3, /* double[3], each in range */
	PEN_KIND_VECTOR4,
	PEN_KIND_BOOLEAN, /* bool */
	PEN_KIND_TEXT,	  /* const char * */
	PEN_KIND_CHOICE,  /* enum, by its name in choices, whose tables are not used */
	PEN_KIND_TABLE,	  /* object with the members of table, described in place */
	PEN_KIND_VARIANT, /* object whose tag member chooses the table */
	PEN_KIND_LIST,	  /* array of objects: the address of the first, and their number */
	PEN_KIND_READ	  /* whatever read makes of it */
};

/* Reads or checks a value; desc is what the row's table describes, at the row's offset. */
typedef void pen_read_fn(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc);

struct pen_range {
	double min, max; /* both allowed */
};

struct pen_field {
	const char *key; /* NULL ends the table */
	enum pen_kind kind;
	size_t offset; /* in the table's description */
	const struct pen_range *range;
	const char *fallback; /* the default as JSON text; or one of the two below */
	const struct pen_table *table;
	const struct pen_variant *choices;
	const struct pen_variants *variants;
	const struct pen_list *list;
	pen_read_fn *read;
};

#define PEN_REQUIRED ""	  /* absence is an offence */
#define PEN_ABSENT   NULL /* absence has its own meaning and stays */

struct pen_table {
	const struct pen_field *fields;
	pen_read_fn *check; /* of an object whose members are all good, or NULL */
};

/* Values of a tag member, each with its enum constant and the table of the other members. */
struct pen_variant {
	const char *name; /* NULL ends the list */
	unsigned value;
	const struct pen_table *table;
};

struct pen_variants {
	const char *tag;
	const char *fallback; /* the default's name, or PEN_REQUIRED */
	size_t offset;	      /* of the enum */
	const struct pen_variant *items;
};

/*
 * At most max elements of size bytes, each described by table or else by variants, and before that
 * a copy of blank, or zero.
 */
struct pen_list {
	size_t size, max;
	size_t count_offset; /* of a uint32_t in the description that has the array's address */
	const struct pen_table *table;
	const struct pen_variants *variants;
	const void *blank;
};

void pen_table_read(struct pen_reader *reader, const struct pen_place *at, json_t *value,
	const struct pen_table *table, void *desc);
void pen_variant_read(struct pen_reader *reader, const struct pen_place *at, json_t *value,
	const struct pen_variants *variants, void *desc);

/* The building blocks of read functions; false after an offence. */
bool pen_number_read(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	struct pen_range range, double *ret_number);
bool pen_vector_read(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	size_t count, struct pen_range range, double *ret_vector);
bool pen_integer_read(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	struct pen_range range, uint32_t *ret_integer);

#endif
