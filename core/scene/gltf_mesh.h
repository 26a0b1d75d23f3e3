/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_MESH_H
#define PEN_SCENE_GLTF_MESH_H

#include "core/scene/gltf_reading.h"

/*
 * The primitives of one of the asset's meshes as objects that have no place yet: read when they are
 * first asked for. What is no surface (points, lines) is left out with a warning. NULL when there
 * is no such mesh; empty after an offence.
 */
struct pen_gltf_shapes *pen_gltf_mesh(struct pen_gltf_reading *r, int index);

#endif
