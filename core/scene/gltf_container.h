/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_CONTAINER_H
#define PEN_SCENE_GLTF_CONTAINER_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>

/* A glTF asset cut into its JSON and, of a GLB, its binary chunk. */
struct pen_gltf_container {
	bool is_binary; /* a GLB */
	const char *text;
	size_t text_size;
	const void *chunk; /* the binary chunk; NULL: none */
	size_t chunk_offset, chunk_size;
};

/*
 * Cuts and measures, so that no recursive reader of the text runs out of stack and none builds a
 * tree beyond all bounds: PEN_GLTF_TEXT_BYTES_MAX, PEN_GLTF_TEXT_DEPTH_MAX and
 * PEN_GLTF_TEXT_VALUES_MAX give PEN_ELIMIT. PEN_EINVALID where a chunk is cut short or misplaced.
 * The grammar is the reader's matter.
 */
int pen_gltf_container_open(const void *bytes, size_t size,
	struct pen_gltf_container *ret_container, struct pen_error *err);

#endif
