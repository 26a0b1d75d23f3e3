/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_UNIT_SCENE_TEXT_H
#define PEN_TESTS_UNIT_SCENE_TEXT_H

#include "core/scene/parse.h"

/* clang-format off */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
/* clang-format on */
#include <string.h>

#define ASSET	    "sha256:0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"
#define GLTF_OBJECT "\"objects\":[{\"type\":\"gltf\",\"asset\":\"" ASSET "\"}]"
#define GLTF	    "," GLTF_OBJECT
#define HEAD	    "{\"version\":1,\"image\":{\"width\":8,\"height\":4}"

/* Reads a scene text; the caller destroys *ret_scene, which is NULL after a failure. */
static inline int read_text(
	const char *text, struct pen_scene **ret_scene, struct pen_scene_errors *ret_errors)
{
	struct pen_error err = PEN_ERROR_INIT;
	json_t *tree = NULL;
	int r;

	*ret_scene = NULL;
	if (pen_json_parse(text, strlen(text), &tree, &err) < 0)
		fail_msg("%s: %s", text, err.text);
	r = pen_scene_parse(tree, ret_scene, ret_errors, &err);
	json_decref(tree);
	assert_true((r == 0) == (ret_errors->count == 0));
	assert_true((r == 0) == (*ret_scene != NULL));
	return r;
}

#endif
