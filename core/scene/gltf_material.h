/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_MATERIAL_H
#define PEN_SCENE_GLTF_MATERIAL_H

#include "core/scene/gltf_reading.h"

/*
 * The scene's material for one of the asset's (negative: glTF's default), made with its textures
 * and pictures when it is first asked for. PEN_NO_INDEX after an offence.
 */
uint32_t pen_gltf_material(struct pen_gltf_reading *r, int index);

#endif
