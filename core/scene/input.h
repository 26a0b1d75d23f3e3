/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_INPUT_H
#define PEN_SCENE_INPUT_H

#include "core/scene/reader.h"

/* A material of no properties but what nearly all have, and of no texture. */
extern const struct pen_material_desc pen_blank_material;

/*
 * Reads a property of a material, known by its key: a number or colour, or an object that names a
 * texture and says how it is laid on. desc: the struct pen_material_desc. The texture's index waits
 * for pen_input_resolve.
 */
void pen_input_read(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc);

/* Turns the names of textures in a material at a place into indices, once the textures are known.
 */
void pen_input_resolve(struct pen_reader *reader, const struct pen_place *at, json_t *material,
	struct pen_material_desc *desc);

/*
 * The matrix of KHR_texture_transform, uv' = translation * rotation * scale * uv with v pointing
 * down, of an angle in degrees.
 */
void pen_input_place(
	const double offset[2], double degrees, const double scale[2], double ret_uv[2][3]);

#endif
