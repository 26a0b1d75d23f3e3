/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_CANONICAL_H
#define PEN_SCENE_CANONICAL_H

#include "core/base/buf.h"
#include "core/base/error.h"

#include <jansson.h>

/*
 * RFC 8785 (JCS): keys sorted by UTF-16 code units, no white space, numbers as ECMAScript prints
 * them (so 1, 1.0 and 1e0 are one text). Appends to out.
 */
int pen_json_canonical(const json_t *tree, struct pen_buf *out, struct pen_error *err);

/* RFC 7396: merges patch onto target in place (target must be an object). */
int pen_json_merge_patch(json_t *target, const json_t *patch, struct pen_error *err);

#endif
