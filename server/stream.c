/* SPDX-License-Identifier: Apache-2.0 */
#include "server/stream.h"

#include "core/base/limits.h"

#include <microhttpd.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

enum { BLOCK_BYTES = 4096 }; /* of a connection's memory */

struct pen_stream {
	struct pen_stream_source source;
	struct MHD_Connection *connection;
	void (*resumed)(void *user);
	void *user;
	struct pen_buf text; /* read and not taken yet */
	bool ended;	     /* the source has no more */
	bool suspended;
};

void pen_stream_wake(struct pen_stream *stream)
{
	if (!stream->suspended)
		return;
	stream->suspended = false;
	MHD_resume_connection(stream->connection);
	stream->resumed(stream->user);
}

/* A client that waits must not keep the memory of the longest text it ever got. */
static void take(struct pen_stream *stream, char *bytes, size_t size)
{
	memcpy(bytes, stream->text.data, size);
	pen_buf_consume(&stream->text, size);
	if (stream->text.size > 0)
		return;
	pen_buf_finish(&stream->text);
	pen_buf_init(&stream->text, PEN_STREAM_TEXT_MAX);
}

static ssize_t read_stream(void *user, uint64_t position, char *bytes, size_t max)
{
	struct pen_stream *stream = user;
	size_t size;

	(void)position;
	if (stream->text.size == 0 && !stream->ended)
		stream->ended = !stream->source.read(stream->source.user, stream, &stream->text);
	if (stream->text.failed)
		return MHD_CONTENT_READER_END_WITH_ERROR;
	size = stream->text.size < max ? stream->text.size : max;
	if (size > 0) {
		take(stream, bytes, size);
		return (ssize_t)size;
	}
	if (stream->ended)
		return MHD_CONTENT_READER_END_OF_STREAM;
	stream->suspended = true;
	MHD_suspend_connection(stream->connection);
	return 0;
}

static void stream_destroy(void *user)
{
	struct pen_stream *stream = user;

	stream->source.finish(stream->source.user);
	pen_buf_finish(&stream->text);
	free(stream);
}

struct MHD_Response *pen_stream_response(const struct pen_stream_source *source,
	struct MHD_Connection *connection, void (*resumed)(void *user), void *user)
{
	struct pen_stream *stream = calloc(1, sizeof *stream);
	struct MHD_Response *response = NULL;

	if (!stream) {
		source->finish(source->user);
		return NULL;
	}
	*stream = (struct pen_stream){
		.source = *source,
		.connection = connection,
		.resumed = resumed,
		.user = user,
	};
	pen_buf_init(&stream->text, PEN_STREAM_TEXT_MAX);
	response = MHD_create_response_from_callback(
		MHD_SIZE_UNKNOWN, BLOCK_BYTES, read_stream, stream, stream_destroy);
	if (!response)
		stream_destroy(stream);
	return response;
}
