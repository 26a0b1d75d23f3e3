/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_PREVIEW_H
#define PEN_SERVER_PREVIEW_H

#include "server/run.h"

/*
 * Previews: renders of which nothing outlives the coordinator. Their scenes' texts are memory, and
 * only the last PEN_PREVIEWS_KEPT_MAX of those that are over are kept.
 */

/* text (heap) becomes the run's, also on failure. */
int pen_preview_keep_text(struct pen_run *run, char *text, size_t size, struct pen_error *err);

/* The text of a preview's scene that is still being rendered: a descriptor for the caller. */
bool pen_preview_open_text(const struct pen_jobs *jobs, const struct pen_sha256 *sha256,
	int *ret_fd, uint64_t *ret_size);

/* It is over; the oldest one may go for it. */
void pen_preview_ended(struct pen_jobs *jobs, struct pen_run *run);

/* It is being removed: one that is over is no more counted. */
void pen_preview_leaves(struct pen_jobs *jobs, struct pen_run *run);

#endif
