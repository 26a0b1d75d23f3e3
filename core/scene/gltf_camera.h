/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_CAMERA_H
#define PEN_SCENE_GLTF_CAMERA_H

#include "core/scene/gltf_reading.h"

/*
 * Makes one of the cameras found the scene's: the one that the text names, else the first one if
 * the text gives no view of its own. What the text gives goes before. A name that no camera and no
 * camera's node has is refused with the names there are.
 */
void pen_gltf_camera_choose(struct pen_gltf_reading *r);

#endif
