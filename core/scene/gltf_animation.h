/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_ANIMATION_H
#define PEN_SCENE_GLTF_ANIMATION_H

#include "core/scene/gltf_reading.h"

/*
 * The tracks of all animations of the asset, which play together: those of a node's pose go into
 * nodes, those of its morph weights into weights, one each a node of the asset. Of two that move
 * the same thing the first one counts.
 */
void pen_gltf_animations(
	struct pen_gltf_reading *r, struct pen_node_desc *nodes, struct pen_track *weights);

#endif
