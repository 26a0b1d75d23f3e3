/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_DRAIN_H
#define PEN_SERVER_DRAIN_H

#include "core/base/error.h"

#include <uv.h>

/*
 * Connections that were answered before their request had ended. A socket that is closed with
 * unread bytes resets the connection, and the client may lose the answer; so what still comes is
 * read and thrown away, until the client closes, PEN_HTTP_DRAIN_MAX bytes or PEN_HTTP_DRAIN_MS.
 */
struct pen_drains {
	uv_loop_t *loop;
	struct pen_drain *first;
	unsigned count;
};

/* Drains a connection through a descriptor of its own, while fd is closed by whoever owns it. */
void pen_drains_add(struct pen_drains *drains, int fd);

/* Closes them all; memory goes when the loop has run. */
void pen_drains_finish(struct pen_drains *drains);

#endif
