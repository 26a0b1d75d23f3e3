/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_ROW_H
#define PEN_SCENE_ROW_H

#include "core/scene/field.h"

#include <stddef.h>

/* How the tables of the format are written down: the ranges that they share, and their rows. */

extern const struct pen_range pen_range_world;
extern const struct pen_range pen_range_positive;
extern const struct pen_range pen_range_magnitude;
extern const struct pen_range pen_range_unit;
extern const struct pen_range pen_range_turn;
extern const struct pen_range pen_range_instant;
extern const struct pen_range pen_range_scale;

#define OF(type, member) offsetof(struct pen_##type, member)

/* Rows; the default comes last. */
#define ROW(key_, kind_, offset_, fallback_)                                                       \
	.key = (key_), .kind = PEN_KIND_##kind_, .offset = (offset_), .fallback = (fallback_)
#define NUMBER(key, type, member, range_, fallback)                                                \
	ROW(key, NUMBER, OF(type, member), fallback), .range = &pen_range_##range_
#define INTEGER(key, type, member, range_, fallback)                                               \
	ROW(key, INTEGER, OF(type, member), fallback), .range = &pen_range_##range_
#define VECTOR3(key, type, member, range_, fallback)                                               \
	ROW(key, VECTOR3, OF(type, member), fallback), .range = &pen_range_##range_
#define VECTOR4(key, type, member, range_, fallback)                                               \
	ROW(key, VECTOR4, OF(type, member), fallback), .range = &pen_range_##range_
#define BOOLEAN(key, type, member, fallback) ROW(key, BOOLEAN, OF(type, member), fallback)
#define TEXT(key, type, member, fallback)    ROW(key, TEXT, OF(type, member), fallback)
#define CHOICE(key, type, member, choices_, fallback)                                              \
	ROW(key, CHOICE, OF(type, member), fallback), .choices = choices_
#define TABLE(key, offset, table_, fallback) ROW(key, TABLE, offset, fallback), .table = &table_
#define VARIANT(key, offset, variants_, fallback)                                                  \
	ROW(key, VARIANT, offset, fallback), .variants = &variants_
#define LIST(key, type, member, list_, fallback)                                                   \
	ROW(key, LIST, OF(type, member), fallback), .list = &list_
#define READ(key, offset, read_, fallback) ROW(key, READ, offset, fallback), .read = read_

#endif
