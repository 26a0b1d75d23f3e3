/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_PARSE_H
#define PEN_SCENE_PARSE_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "core/scene/desc.h"
#include "core/scene/json.h"

#include <jansson.h>
#include <stddef.h>

/* One offender: where (RFC 6901 pointer into the scene) and what is wrong, and its cure. */
struct pen_scene_error {
	char pointer[PEN_SCENE_ERROR_BYTES_MAX + 1];
	char detail[PEN_SCENE_ERROR_BYTES_MAX + 1];
};

/*
 * All that is wrong with a scene, in document order, at most PEN_SCENE_ERRORS_MAX of them; none of
 * the texts repeats bytes of the input other than keys inside pointers.
 */
struct pen_scene_errors {
	struct pen_scene_error items[PEN_SCENE_ERRORS_MAX];
	size_t count;
};

/*
 * Reads a scene tree. Fills the tree's absent members with their defaults, so that
 * pen_json_canonical(tree) afterwards is the whole of what was asked for. On PEN_EINVALID errors
 * lists every offender (unknown key, wrong type, out of range, dangling reference, degenerate
 * geometry). The caller destroys the scene.
 */
int pen_scene_parse(json_t *tree, struct pen_scene **ret_scene, struct pen_scene_errors *errors,
	struct pen_error *err);

void pen_scene_destroy(struct pen_scene *scene);

#endif
