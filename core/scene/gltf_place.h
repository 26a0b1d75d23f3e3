/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_PLACE_H
#define PEN_SCENE_GLTF_PLACE_H

#include "core/scene/gltf_reading.h"

/* Counts how often a copy of the asset's scene shows each mesh. */
void pen_gltf_place_count(struct pen_gltf_reading *r);

/*
 * Adds a copy of the asset's scene, placed by an object of the text: nodes, cameras and, if it is
 * visible, objects and lights. A rigid mesh that is shown more than once is one hidden object and
 * instances of it. The object's own material, if it has one, goes before the asset's.
 */
void pen_gltf_place(struct pen_gltf_reading *r, const struct pen_object_desc *object);

#endif
