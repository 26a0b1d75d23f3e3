/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_MESH_H
#define PEN_SCENE_MESH_H

#include "core/scene/field.h"

/* The arrays of a mesh object; each reads one member of it into a struct pen_object_desc. */
void pen_mesh_read_vertices(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object);
void pen_mesh_read_keys(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object);
void pen_mesh_read_indices(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object);
void pen_mesh_read_normals(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object);
void pen_mesh_read_uvs(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object);

/* Whether the arrays fit each other. */
void pen_mesh_check(
	struct pen_reader *reader, const struct pen_place *at, json_t *mesh, void *object);

#endif
