/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_SOURCE_H
#define PEN_SERVER_CLI_SOURCE_H

#include "core/base/buf.h"
#include "core/base/digest.h"

/* A file that the scene mentions by its path. */
struct pen_source_asset {
	struct pen_sha256 sha256; /* of what is uploaded */
	char *path;		  /* below the scene's folder; NULL: the held bytes */
};

/*
 * What a user asks to be rendered: a scene text, or a glTF, of which a scene is made with all
 * defaults but the path integrator; and the files that it needs.
 */
struct pen_source {
	struct pen_buf text; /* of the scene, with hashes in the place of paths */
	struct pen_buf held; /* the glTF that was the operand, as a GLB */
	int folder;
	struct pen_source_asset *assets;
	size_t asset_count;
};

void pen_source_init(struct pen_source *source);
void pen_source_finish(struct pen_source *source);

/*
 * Reads the file at path ("-": standard input, whose files are below the current folder) and hashes
 * the files that it mentions. A scene without paths stays as it was written. PEN_ELIMIT when it is
 * too large; PEN_EINVALID, with line, column and byte, when it is not JSON, and for a path that
 * may not be one. Whether it is a scene is the server's to say.
 */
int pen_source_read(struct pen_source *source, const char *path, struct pen_error *err);

/* Appends to out what is uploaded for the file at path; glTF text becomes a GLB. */
int pen_source_asset_read(const struct pen_source *source, const char *path, struct pen_buf *out,
	struct pen_error *err);

#endif
