/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ASSET_SWEEP_H
#define PEN_SERVER_ASSET_SWEEP_H

#include "core/base/error.h"

#include <stdint.h>
#include <uv.h>

/*
 * Removes kept scenes (server/shelf.h) that nobody has wanted for a while, and assets that no scene
 * names, of a render or kept, and that nobody has wanted either: shortly after the start and then
 * every hour, on the thread pool. An asset that was just uploaded for a render still to be posted
 * is young, so it stays.
 */
struct pen_asset_sweep;

/* The directories are those of server/asset_file.h and server/scene_file.h; all are borrowed. */
int pen_asset_sweep_create(uv_loop_t *loop, const char *assets_dir, const char *scenes_dir,
	const char *kept_dir, uint32_t keep_s, struct pen_asset_sweep **ret_sweep,
	struct pen_error *err);

/* The memory goes when the loop has run. */
void pen_asset_sweep_destroy(struct pen_asset_sweep *sweep);

#endif
