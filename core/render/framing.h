/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_FRAMING_H
#define PEN_RENDER_FRAMING_H

#include "core/base/error.h"
#include "core/scene/desc.h"

/*
 * The view of a scene with a glTF object, when neither its text nor a glTF has a camera: from the
 * front, +Z, a little from the right and above, so far off that the image holds the boxes of all
 * that is visible when the shutter of the first frame opens, with a tenth to spare. Fills
 * camera's position, look_at and, unless it is given, focus_distance; leaves it alone where there
 * is a camera, or nothing to see. PEN_ENOMEM.
 */
int pen_framing_choose(
	const struct pen_scene *scene, struct pen_camera_desc *camera, struct pen_error *err);

#endif
