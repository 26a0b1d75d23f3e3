/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_RESPONSE_H
#define PEN_SERVER_RESPONSE_H

#include "core/base/limits.h"
#include "server/answer.h"

#include <stdbool.h>

struct MHD_Response;

/* What libmicrohttpd sends, made of an answer. */

/* Takes the answer's body. NULL without memory. */
struct MHD_Response *pen_response_of(struct pen_answer *answer);

/*
 * Adds the answer's fields and those of all answers. False without memory: a response without one
 * of them might mean something else.
 */
bool pen_response_add_fields(struct MHD_Response *response, const struct pen_answer *answer);

/*
 * Answers 304 that were given last: clients that poll get the same one again and again, and making
 * and freeing its fields took as long as all else that is done for it.
 */
struct pen_unchanged {
	struct pen_unchanged_response {
		struct MHD_Response *response; /* NULL: free */
		size_t field_count, values_size;
		const char *names[PEN_ANSWER_FIELDS_MAX];
		char values[PEN_ANSWER_VALUES];
	} items[PEN_UNCHANGED_MAX];
	size_t next; /* that is given up */
};

/*
 * The response to an answer 304, which stays with those kept; to be queued before the next call.
 * NULL without memory.
 */
struct MHD_Response *pen_unchanged_get(struct pen_unchanged *unchanged, struct pen_answer *answer);

void pen_unchanged_finish(struct pen_unchanged *unchanged);

#endif
