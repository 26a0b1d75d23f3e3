/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_FORMAT_H
#define PEN_SCENE_FORMAT_H

#include "core/scene/field.h"

/* The whole scene format, version 1: the members of a scene, describing a struct pen_scene. */
extern const struct pen_table pen_format_scene;

/* Its larger members; the two that have names as keys describe a struct pen_scene. */
extern const struct pen_list pen_format_objects;
extern const struct pen_list pen_format_lights;
void pen_format_read_textures(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc);
void pen_format_read_materials(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc);

#endif
