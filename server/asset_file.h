/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ASSET_FILE_H
#define PEN_SERVER_ASSET_FILE_H

#include "core/base/digest.h"
#include "core/base/error.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * Assets: files that scenes name by their SHA-256, in a directory of their own. One that is there
 * is whole and durable. Its modification time is when it was last wanted.
 */

/* Whether it is there; one that is counts as wanted now. */
bool pen_asset_file_touch(const char *dir, const struct pen_sha256 *sha256);

/* A read-only descriptor. PEN_ENOTFOUND. */
int pen_asset_file_open(const char *dir, const struct pen_sha256 *sha256, int *ret_fd,
	uint64_t *ret_size, struct pen_error *err);

/* An asset on its way in. Nothing of it outlives the coordinator before it is finished. */
struct pen_asset_upload;

/* PEN_ENOSPACE when size bytes would take the disk's reserve; size may be 0: not known yet. */
int pen_asset_upload_create(const char *dir, uint64_t size, struct pen_asset_upload **ret_upload,
	struct pen_error *err);

/* Forgets what is not finished. */
void pen_asset_upload_destroy(struct pen_asset_upload *upload);

/* PEN_ELIMIT past PEN_ASSET_BYTES_MAX, PEN_ENOSPACE. */
int pen_asset_upload_append(
	struct pen_asset_upload *upload, const void *data, size_t size, struct pen_error *err);

/*
 * Puts the asset into the directory, durably, and tells its name; blocks on the disk. expected may
 * be NULL: PEN_EINVALID when the bytes have another hash. PEN_ENOSPACE, PEN_EIO.
 */
int pen_asset_upload_finish(struct pen_asset_upload *upload, const struct pen_sha256 *expected,
	struct pen_sha256 *ret_sha256, struct pen_error *err);

#endif
