/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_TURNS_H
#define PEN_SERVER_TURNS_H

#include "core/base/error.h"
#include "server/visitor.h"

#include <stdbool.h>
#include <uv.h>

struct MHD_Daemon;

/*
 * The turns that a libmicrohttpd without a thread of its own takes on the loop: when one of its
 * sockets is ready, when a time has come for it, and when it asks for one at once, which it gets
 * after everything else on the loop has had one. Some requests make it ask without getting on (a
 * chunk's size that is too long): then it has to wait a while each time, until the deadline of its
 * client.
 */
struct pen_turns {
	struct MHD_Daemon *daemon;
	struct pen_visitors *visitors;
	uv_poll_t poll;	  /* libmicrohttpd's epoll descriptor */
	uv_timer_t timer; /* what it waits for besides */
	uv_idle_t idle;	  /* what it can go on with */
	unsigned handles; /* open */
	bool has_moved;	  /* a request has got on since the last turn */
	unsigned stalls;  /* turns one after the other in which nothing did */
	unsigned crowd;	  /* the most connections since memory was given back */
	void (*closed)(void *user);
	void *user;
};

/* Borrows the daemon and its visitors. */
int pen_turns_start(struct pen_turns *turns, uv_loop_t *loop, struct MHD_Daemon *daemon,
	struct pen_visitors *visitors, struct pen_error *err);

/* A request has got on: said from inside a turn. */
void pen_turns_moved(struct pen_turns *turns);

/* There is something for libmicrohttpd to do that it doesn't know of. */
void pen_turns_ask(struct pen_turns *turns);

/* No more turns: before the daemon is stopped. closed is called when the loop has run. */
void pen_turns_close(struct pen_turns *turns, void (*closed)(void *user), void *user);

#endif
