/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_FORMAT_H
#define PEN_SCENE_FORMAT_H

#include "core/scene/field.h"

/* The whole scene format, version 1: the members of a scene, describing a struct pen_scene. */
extern const struct pen_table pen_format_scene;

#endif
