/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_LINK_H
#define PEN_SERVER_LINK_H

#include "core/base/digest.h"
#include "core/base/error.h"
#include "proto/msg.h"
#include "proto/secure.h"

#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

/*
 * One worker's connection, in TLS or, where that is allowed, in the clear: messages in, messages
 * out, scenes sent piece by piece as the worker takes them. What waits to be written is bounded; a
 * worker that does not read is cut off.
 */
struct pen_link;

struct pen_link_events {
	/* msg is valid during the call. */
	void (*message)(void *user, const struct pen_msg *msg);
	/* The last event, always from the loop; reason is "" after pen_link_close. The link is
	 * freed when it returns. */
	void (*closed)(void *user, const char *reason);
	/* Of TLS: the key of a name. */
	pen_secure_lookup find_key;
	void *user;
};

/*
 * Accepts the connection that waits at listener. Nothing is made of what comes before the other
 * end has shown that it has a key, unless allows_plain and what comes is no TLS.
 */
int pen_link_accept(uv_stream_t *listener, const struct pen_link_events *events, bool allows_plain,
	struct pen_link **ret_link, struct pen_error *err);

/* The name whose key the worker has; "" in the clear. */
const char *pen_link_name(const struct pen_link *link);

/* "127.0.0.1:4711"; valid as long as the link. */
const char *pen_link_address(const struct pen_link *link);

/* Does nothing once the link is closing. */
void pen_link_send(struct pen_link *link, const struct pen_msg *msg);

/*
 * Sends size bytes of fd as the scene (SCENE_DATA) or asset (ASSET_DATA) sha256, piece by piece
 * between other messages; fd becomes the link's. fd < 0: there is none.
 */
void pen_link_send_file(struct pen_link *link, enum pen_frame_type type,
	const struct pen_sha256 *sha256, int fd, uint64_t size);

/* Closes when what was sent before has been written, or after two seconds. */
void pen_link_finish(struct pen_link *link);

void pen_link_close(struct pen_link *link);

#endif
