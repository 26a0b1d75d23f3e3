/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_VIEW_H
#define PEN_WORKER_VIEW_H

#include "core/render/shot.h"
#include "core/scene/parse.h"

/* What a scene process, or a render process, shows of the scene that was built. */
struct pen_view {
	struct pen_scene *scene; /* that was built; its camera, image and sampling change */
	struct pen_render_shot *shot;
	struct pen_scene *shown; /* whose camera it is; NULL: the scene's own */
};

/*
 * Takes the view of another scene's text, which differs in nothing else. After a failure no frame
 * is ready.
 */
int pen_view_take(struct pen_view *view, const char *text, size_t size, struct pen_error *err);

#endif
