/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_SCENE_TEXT_H
#define PEN_SERVER_CLI_SCENE_TEXT_H

#include "core/base/buf.h"
#include "core/base/error.h"

/*
 * Reads a scene file ("-": standard input) into text, which the caller has initialised with a
 * ceiling of PEN_SCENE_BYTES_MAX. PEN_ELIMIT when it is larger; PEN_EINVALID, with line, column
 * and byte, when it is not JSON. Whether it is a scene is the server's to say.
 */
int pen_scene_text_read(const char *path, struct pen_buf *text, struct pen_error *err);

#endif
