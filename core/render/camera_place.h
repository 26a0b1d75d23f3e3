/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_CAMERA_PLACE_H
#define PEN_RENDER_CAMERA_PLACE_H

#include "core/base/error.h"
#include "core/render/motion.h"

/*
 * The scene's camera with absolute shutter times, its node, if it has one, resolved into position,
 * axes and, where it moves, keys: in so many steps that it leaves its path by less than a pixel
 * shows. What the text gives goes before what the node says. Where nobody gives a camera it is
 * pen_framing_choose's. keys are *ret_keys, which the caller frees (NULL: none of ours).
 * PEN_EINVALID: the node flattens the camera; PEN_ENOMEM.
 */
int pen_camera_place(const struct pen_scene *scene, const struct pen_shutter *shutter,
	struct pen_camera_desc *ret_camera, struct pen_camera_key **ret_keys,
	struct pen_error *err);

#endif
