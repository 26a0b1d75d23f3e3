/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_SESSION_H
#define PEN_WORKER_SESSION_H

#include "proto/msg.h"
#include "worker/config.h"
#include "worker/key.h"

#include <stdbool.h>
#include <uv.h>

/*
 * The connection to the coordinator: dials, says Hello, is welcomed, and dials again, with
 * growing pauses and for ever, whenever it is lost.
 */
struct pen_session;

/* Called from the loop, never from within a call on the session but pen_session_send. */
struct pen_session_events {
	void (*open)(void *user, const struct pen_msg_welcome *welcome);
	void (*message)(void *user, const struct pen_msg *msg);
	/* Nothing sent since open need have arrived. */
	void (*closed)(void *user);
	/* For good: the session dials no more. */
	void (*refused)(void *user, const char *reason);
	/* After pen_session_finish. */
	void (*finished)(void *user);
};

/* key is borrowed; with it the connection is TLS. */
int pen_session_create(uv_loop_t *loop, const struct pen_worker_config *config,
	const struct pen_key *key, const struct pen_session_events *events, void *user,
	struct pen_session **ret_session, struct pen_error *err);

bool pen_session_is_open(const struct pen_session *session);

/* Ignored while the session is not open. A coordinator that does not read loses the connection. */
void pen_session_send(struct pen_session *session, const struct pen_msg *msg);

/* Sends what is waiting, closes, and calls finished. */
void pen_session_finish(struct pen_session *session);

/* The memory goes when the loop has run once more. */
void pen_session_destroy(struct pen_session *session);

#endif
