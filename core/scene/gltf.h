/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_H
#define PEN_SCENE_GLTF_H

#include "core/base/error.h"
#include "core/scene/desc.h"
#include "core/scene/parse.h"

/*
 * Puts what the glTF assets hold in the place of the glTF objects and of their instances: meshes,
 * instances, lights, materials, textures, pictures, nodes and skins join those of the scene; a
 * camera is looked up where the text left that open. blobs: the bytes of scene->assets, one each,
 * which must outlive the scene (pictures lie in them). Nothing in the bytes is trusted: every
 * accessor is checked before it is read. What is left out is told in scene->warnings.
 *
 * Light, in candela and lux as Blender's exporter writes it, becomes radiometric by 683 lm/W.
 *
 * PEN_EINVALID: errors lists all offenders, each with the JSON pointer of the glTF object and, in
 * its detail, the place within the asset. PEN_ENOMEM, PEN_ELIMIT. The scene is then only good to
 * be destroyed.
 */
int pen_scene_expand(struct pen_scene *scene, const struct pen_blob *blobs,
	struct pen_scene_errors *errors, struct pen_error *err);

#endif
