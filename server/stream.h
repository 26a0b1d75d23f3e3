/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_STREAM_H
#define PEN_SERVER_STREAM_H

#include "core/base/buf.h"

#include <stdbool.h>

struct MHD_Connection;
struct MHD_Response;

/*
 * The body of an answer that comes piece by piece, as long as the client stays. Its source is read
 * only when the client has taken what came before: a slow one costs no memory.
 */
struct pen_stream;

struct pen_stream_source {
	/*
	 * Appends what there is to tell to text, which is empty; nothing when the client shall wait
	 * until pen_stream_wake. False: this was the last.
	 */
	bool (*read)(void *user, struct pen_stream *stream, struct pen_buf *text);
	/* The client has all of it, or has gone; the stream is not there any more. */
	void (*finish)(void *user);
	void *user;
};

/* There may be something to read; nothing when the client does not wait. */
void pen_stream_wake(struct pen_stream *stream);

/* http.c's: a response with such a body. resumed: the connection wants to be looked at. NULL
 * without memory, the source is finished then. */
struct MHD_Response *pen_stream_response(const struct pen_stream_source *source,
	struct MHD_Connection *connection, void (*resumed)(void *user), void *user);

#endif
