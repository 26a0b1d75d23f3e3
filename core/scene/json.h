/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_JSON_H
#define PEN_SCENE_JSON_H

#include "core/base/error.h"

#include <jansson.h>
#include <stddef.h>

/*
 * JSON text (RFC 8259; an object or an array in UTF-8, not necessarily ended by a NUL) to a tree.
 * A scan of our own checks grammar, encoding and the bounds PEN_SCENE_BYTES_MAX,
 * PEN_SCENE_DEPTH_MAX, PEN_SCENE_NODES_MAX (values) and PEN_SCENE_STRING_MAX (bytes of a string as
 * written) before a tree is built. NUL characters, lone surrogates, numbers beyond double and
 * duplicate keys are refused. PEN_ELIMIT when there are too many bytes, else PEN_EINVALID; err then
 * holds line, column (in characters, from 1) and byte offset, and no byte of the text.
 *
 * A number may become a JSON integer or a JSON real whichever way it is written: read it with
 * json_number_value. The caller decrefs the tree.
 */
int pen_json_parse(const char *text, size_t size, json_t **ret_tree, struct pen_error *err);

#endif
