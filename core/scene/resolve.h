/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_RESOLVE_H
#define PEN_SCENE_RESOLVE_H

#include "core/scene/reader.h"

/*
 * Turns the names that materials (texture) and objects (material, of) give into indices, once all
 * textures, materials and objects have been read. Refuses names that name nothing, names given
 * twice and instances of instances; passes over what is no name at all, which has been refused
 * before. Spheres and meshes without a material share a grey one, added behind the named ones.
 */
void pen_resolve_names(struct pen_reader *reader, const struct pen_place *root, json_t *tree);

#endif
