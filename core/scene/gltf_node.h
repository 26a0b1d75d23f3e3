/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_NODE_H
#define PEN_SCENE_GLTF_NODE_H

#include "core/scene/gltf_reading.h"

/*
 * Reads the node tree of the asset's default scene (the first one, without) and its animations. A
 * tree that is none (a node with two parents, a circle) is refused, and one that is too deep.
 */
void pen_gltf_tree_read(struct pen_gltf_reading *r);

#endif
