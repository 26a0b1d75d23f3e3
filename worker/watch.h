/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_WATCH_H
#define PEN_WORKER_WATCH_H

#include "core/base/error.h"

#include <uv.h>

/*
 * A descriptor that the loop watches for reading. It belongs to the watch, and the watch can be
 * destroyed at any time, also from within its own callback.
 */
struct pen_watch;

typedef void pen_watch_fn(void *user);

/* fd passes to the watch, also on failure. fn is called when fd is readable or closed. */
int pen_watch_create(uv_loop_t *loop, int fd, pen_watch_fn *fn, void *user,
	struct pen_watch **ret_watch, struct pen_error *err);
void pen_watch_destroy(struct pen_watch *watch);

int pen_watch_fd(const struct pen_watch *watch);

#endif
