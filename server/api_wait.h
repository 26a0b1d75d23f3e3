/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_WAIT_H
#define PEN_SERVER_API_WAIT_H

#include "server/api.h"

#include <stdbool.h>

/* Prefer: wait=N (RFC 7240): answers that are held until there is something to say. */

/* Answers the exchange; job is there. */
typedef void pen_api_held_fn(struct pen_exchange *exchange, const struct pen_job *job);

/*
 * If the client prefers to wait and there is something to wait for, a change of the render or its
 * end, answer is called then, or when the time is over; 404 or 410 when the render has gone. False
 * when the exchange is to be answered at once.
 */
bool pen_api_hold(struct pen_exchange *exchange, const struct pen_job *job, bool until_over,
	pen_api_held_fn *answer);

/* Preference-Applied, if the client prefers to wait. */
void pen_api_add_preference(struct pen_answer *answer, const struct pen_exchange *exchange);

#endif
