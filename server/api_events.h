/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_EVENTS_H
#define PEN_SERVER_API_EVENTS_H

#include "server/api.h"

/*
 * GET /v1/renders/{id}/events as text/event-stream (HTML, server-sent events). An event's id is the
 * revision of the render that it tells, and what a client lacks follows from the last one that it
 * has: nothing is queued for anybody, and a client that comes back after an hour, or after a
 * restart, gets what it needs.
 */
void pen_api_events(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
