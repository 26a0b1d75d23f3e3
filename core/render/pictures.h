/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_PICTURES_H
#define PEN_RENDER_PICTURES_H

#include "core/base/error.h"
#include "core/image/mipmap.h"
#include "core/render/environment.h"
#include "core/scene/desc.h"

#include <stdint.h>

struct pen_scene_errors;

/*
 * The decoded pictures of a scene: one mipmap for each of its textures (textures of one picture
 * and encoding share theirs), and the environment of its background. Made before the renderer's
 * scene and kept as long; processes share it.
 */
struct pen_pictures;

/*
 * Decodes all pictures that textures or the background refer to. blobs: the bytes of each of the
 * scene's assets, needed only here. On PEN_EINVALID errors names every picture that is no image, is
 * damaged or breaks a limit of core/base/limits.h, by its pointer and place. One that takes longer
 * than PEN_PICTURE_CPU_S ends the process by SIGXCPU: a library that does not come back cannot be
 * stopped otherwise.
 */
int pen_pictures_load(const struct pen_scene *scene, const struct pen_blob *blobs,
	struct pen_scene_errors *errors, struct pen_pictures **ret_pictures, struct pen_error *err);
void pen_pictures_destroy(struct pen_pictures *pictures);

/* Of a texture of the scene. */
const struct pen_mipmap *pen_pictures_texture(
	const struct pen_pictures *pictures, uint32_t texture);

/* Of the background; NULL without one. */
const struct pen_environment *pen_pictures_environment(const struct pen_pictures *pictures);

#endif
