/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SCENE_FILE_H
#define PEN_SERVER_SCENE_FILE_H

#include "core/base/digest.h"
#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Scenes on disk: DIR/SHA256.json, the canonical text, named by its content. */

/*
 * Nothing is done when it is there already. If it is to be durable it is once DIR was settled
 * (server/durable.h), and the call may block on the disk.
 */
int pen_scene_file_write(const char *dir, const struct pen_sha256 *sha256, const void *text,
	size_t size, bool is_durable, struct pen_error *err);

/* A read-only descriptor, the caller closes it. PEN_ENOTFOUND. */
int pen_scene_file_open(const char *dir, const struct pen_sha256 *sha256, int *ret_fd,
	uint64_t *ret_size, struct pen_error *err);

/* Whether it is there, and is the text that its name says. */
bool pen_scene_file_is_whole(const char *dir, const struct pen_sha256 *sha256);

void pen_scene_file_remove(const char *dir, const struct pen_sha256 *sha256);

#endif
