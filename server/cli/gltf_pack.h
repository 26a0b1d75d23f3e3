/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_GLTF_PACK_H
#define PEN_SERVER_CLI_GLTF_PACK_H

#include "core/base/buf.h"
#include "core/base/error.h"

#include <stdbool.h>

/* Whether the bytes are a GLB, by its first four. */
bool pen_gltf_is_glb(const struct pen_buf *bytes);

/* Whether a file of this name is glTF text, whose buffers and images may be files of their own. */
bool pen_gltf_is_text(const char *name);

/*
 * Puts a GLB (glTF 2.0, section 4) in the place of glTF text: its buffers, data URIs and the files
 * beside it become one binary chunk. path: of the text, below folder (folder.h). What the text
 * says otherwise is not looked at.
 */
int pen_gltf_pack(struct pen_buf *bytes, int folder, const char *path, struct pen_error *err);

#endif
