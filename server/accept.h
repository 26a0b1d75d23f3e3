/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ACCEPT_H
#define PEN_SERVER_ACCEPT_H

#include "core/base/error.h"
#include "server/job.h"

#include <stdint.h>

/* PEN_ENOSPACE unless the disk of dir has room for the scene's framebuffer and some to spare. */
int pen_accept_check_disk(const char *dir, const struct pen_scene *scene, struct pen_error *err);

/*
 * Fills a new job from its submission: a fresh id, its geometry in tiles of tile_px, its times.
 * All but the number and the priority; name is a copy.
 */
int pen_accept_fill(const struct pen_submission *submission, uint32_t tile_px,
	struct pen_job *ret_job, struct pen_error *err);

#endif
