/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SURFACES_H
#define PEN_RENDER_SURFACES_H

#include "core/render/scene.h"

/*
 * Makes a scene's surfaces and what shading needs of their materials. The geometry and the pictures
 * must be there. PEN_ENOMEM.
 */
int pen_surfaces_create(struct pen_render_scene *scene, struct pen_error *err);
void pen_surfaces_destroy(struct pen_render_scene *scene);

/* What samples cover, from the sampling of the scene's desc. */
void pen_surfaces_set_share(struct pen_render_scene *scene);

#endif
