/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_WORLD_H
#define PEN_SERVER_WORLD_H

#include "core/base/digest.h"
#include "core/base/error.h"

#include <jansson.h>
#include <stdbool.h>

/*
 * What all views of a scene share: all of it but for image, sampling, and of the camera all but the
 * shutter. Whoever has built one of them need only look the other way to show another.
 *
 * tree is a scene's with its defaults. *ret_has_world is false when its camera is one of a glTF
 * file's, which nobody knows before that is read.
 */
int pen_world_of(const json_t *tree, bool *ret_has_world, struct pen_sha256 *ret_world,
	struct pen_error *err);

#endif
