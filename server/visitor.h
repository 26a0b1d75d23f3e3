/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_VISITOR_H
#define PEN_SERVER_VISITOR_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <sys/socket.h>
#include <uv.h>

/*
 * The connections of HTTP clients, and how long each may take. libmicrohttpd ends those on which
 * nothing happens for PEN_HTTP_IDLE_S; a client that sends or takes a byte now and then would keep
 * its place for ever. So a request's header must be complete after PEN_HTTP_HEADER_MS, and bodies
 * and answers must pass at PEN_HTTP_RATE after PEN_HTTP_GRACE_MS and within PEN_HTTP_TRANSFER_MS.
 * Who is late has its socket shut down, never closed: the descriptor is libmicrohttpd's.
 *
 * Looked at once a second. Time in which the loop stood still is nobody's fault and not counted.
 */
struct pen_visitors;
struct pen_visitor;

/* user is what pen_visitor_user tells. */
int pen_visitors_create(
	uv_loop_t *loop, void *user, struct pen_visitors **ret_visitors, struct pen_error *err);
void *pen_visitor_user(const struct pen_visitor *visitor);

/* After the last visitor has left; memory goes when the loop has run. NULL is fine. */
void pen_visitors_destroy(struct pen_visitors *visitors);

/*
 * Whether there is room for one more from that address: at most PEN_HTTP_ADDRESS_MAX, where the
 * /64 of IPv6 is one address. Loopback is not counted: a proxy there brings everybody's.
 */
bool pen_visitors_welcome(const struct pen_visitors *visitors, const struct sockaddr *address);

/*
 * Whether an answer has got on since this was last asked: its client has taken some of it, or it is
 * new.
 */
bool pen_visitors_get_on(struct pen_visitors *visitors);

/* A connection has begun, and with it the time for its first header. NULL without memory. */
struct pen_visitor *pen_visitor_enter(
	struct pen_visitors *visitors, int fd, const struct sockaddr *address);

/* Before its descriptor is closed. NULL is fine here and below: nothing is watched then. */
void pen_visitor_leave(struct pen_visitor *visitor);

/* What it does now. */
void pen_visitor_sends(struct pen_visitor *visitor); /* the header is complete, a body may come */
void pen_visitor_sent(struct pen_visitor *visitor, size_t size); /* so much more of the body */
void pen_visitor_waits(struct pen_visitor *visitor); /* for us, or for events: no deadline */
void pen_visitor_takes(struct pen_visitor *visitor); /* the answer */
void pen_visitor_rests(struct pen_visitor *visitor); /* until the first byte of the next request */

#endif
