/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/view.h"

#include <stdlib.h>

int pen_view_take(struct pen_view *view, const char *text, size_t size, struct pen_error *err)
{
	struct pen_scene_errors *errors = calloc(1, sizeof *errors);
	struct pen_scene *shown = NULL;
	json_t *tree = NULL;
	int r = errors ? pen_json_parse(text, size, &tree, err) : pen_error_memory(err);

	if (r == 0)
		r = pen_scene_parse(tree, &shown, errors, err);
	json_decref(tree);
	free(errors);
	if (r < 0)
		return r;
	view->scene->camera = shown->camera;
	view->scene->image = shown->image;
	view->scene->sampling = shown->sampling;
	r = pen_render_shot_look(view->shot, err);
	/* The camera's keys are in the memory of the one that is shown. */
	pen_scene_destroy(view->shown);
	view->shown = shown;
	return r;
}
