/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_ASSET_H
#define PEN_SCENE_ASSET_H

#include "core/scene/reader.h"

/*
 * Files that a scene text refers to, each time as "sha256:" and 64 hex digits. A read function
 * enters each mention into the scene's assets, in the order in which they are read.
 */

/* desc: a uint32_t, the index of the asset. */
void pen_asset_read(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc);

/* desc: a uint32_t, the index of a new picture that is the whole asset; it is of at's parent. */
void pen_picture_read(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc);

#endif
