/* SPDX-License-Identifier: Apache-2.0 */
#include "server/link.h"

#include "core/base/limits.h"

#include <assert.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
	PIECE_BYTES = 256 << 10,   /* of a scene, in one frame */
	OUT_BYTES_MAX = 4 << 20,   /* waiting to be written */
	ARENA_BYTES_MAX = 1 << 20, /* of one message */
	FINISH_MS = 2000,
	RAW_BYTES = 80 << 10, /* read at once, of TLS: most results as a whole */
	TRANSFERS_MAX = 4 * PEN_SCENES_CACHED_MAX
};

/* A scene or an asset on its way. */
struct transfer {
	enum pen_frame_type type;
	struct pen_sha256 sha256;
	int fd;
	uint64_t size, offset;
};

struct pen_link {
	uv_tcp_t tcp;
	uv_timer_t timer; /* of finishing */
	uv_write_t write;
	struct pen_link_events events;
	char address[64];
	struct pen_error err; /* why it closes */
	bool closing, finishing, writing;
	bool allows_plain, is_plain;
	struct pen_secure *secure; /* once TLS has begun */
	char *raw;		   /* RAW_BYTES, unless it is plain */
	unsigned open_handles;
	struct pen_frame_reader reader;
	struct pen_arena arena;
	struct pen_buf out, written; /* waiting; being written */
	uint32_t sequence;
	struct transfer transfers[TRANSFERS_MAX]; /* the first one's piece is next */
	size_t transfer_count;
};

static void handle_handle_closed(uv_handle_t *handle)
{
	struct pen_link *link = handle->data;

	if (--link->open_handles > 0)
		return;
	link->events.closed(link->events.user, link->err.text);
	for (size_t i = 0; i < link->transfer_count; i++)
		(void)close(link->transfers[i].fd);
	pen_secure_destroy(link->secure);
	free(link->raw);
	pen_frame_reader_finish(&link->reader);
	pen_arena_finish(&link->arena);
	pen_buf_finish(&link->out);
	pen_buf_finish(&link->written);
	free(link);
}

void pen_link_close(struct pen_link *link)
{
	if (link->closing)
		return;
	link->closing = true;
	uv_close((uv_handle_t *)&link->tcp, handle_handle_closed);
	uv_close((uv_handle_t *)&link->timer, handle_handle_closed);
}

static void fail(struct pen_link *link, const char *reason)
{
	(void)pen_error_set(&link->err, PEN_ECLOSED, "%s", reason);
	pen_link_close(link);
}

/* Writing */

static void flush(struct pen_link *link);

static void append(struct pen_link *link, const struct pen_msg *msg)
{
	if (pen_msg_write(msg, &link->out, &link->sequence, NULL) < 0)
		fail(link, "it does not read what it is sent");
}

static void end_transfer(struct pen_link *link)
{
	(void)close(link->transfers[0].fd);
	link->transfer_count--;
	memmove(link->transfers, link->transfers + 1,
		link->transfer_count * sizeof *link->transfers);
}

static void turn_transfers(struct pen_link *link)
{
	const struct transfer first = link->transfers[0];
	const size_t last = link->transfer_count - 1;

	memmove(link->transfers, link->transfers + 1, last * sizeof *link->transfers);
	link->transfers[last] = first;
}

/* One more piece of the first transfer, which then takes its turn behind the others. */
static void append_piece(struct pen_link *link)
{
	static_assert(PIECE_BYTES <= PEN_FRAME_PAYLOAD_MAX, "a piece fits a frame");
	struct transfer *transfer = &link->transfers[0];
	uint64_t left = transfer->size - transfer->offset;
	size_t size = left < PIECE_BYTES ? (size_t)left : PIECE_BYTES;
	void *piece = malloc(size > 0 ? size : 1);
	struct pen_msg msg = {
		.type = transfer->type,
		.u.scene_data = {.sha256 = transfer->sha256,
			.size = transfer->size,
			.offset = transfer->offset},
		.payload = piece,
		.payload_size = size,
	};

	if (!piece || pread(transfer->fd, piece, size, (off_t)transfer->offset) != (ssize_t)size) {
		fail(link, "its scene or asset cannot be read");
	} else {
		append(link, &msg);
		transfer->offset += size;
		if (transfer->offset == transfer->size)
			end_transfer(link);
		else
			turn_transfers(link);
	}
	free(piece);
}

static void handle_written(uv_write_t *write, int status)
{
	struct pen_link *link = write->data;

	link->writing = false;
	pen_buf_clear(&link->written);
	if (status < 0)
		fail(link, uv_strerror(status));
	else
		flush(link);
}

/* What is to be written next: messages as they are, or as TLS has them. */
static struct pen_buf *output_of(struct pen_link *link)
{
	if (!link->secure)
		return &link->out;
	if (link->out.size > 0 && pen_secure_is_open(link->secure)) {
		if (pen_secure_write(link->secure, link->out.data, link->out.size, &link->err) < 0)
			pen_link_close(link);
		pen_buf_clear(&link->out);
	}
	return pen_secure_out(link->secure);
}

/* What the socket takes now costs the loop no turn. The write that follows a failure tells of it.
 */
static void write_now(struct pen_link *link, struct pen_buf *out)
{
	const uv_buf_t data = uv_buf_init(out->data, (unsigned)out->size);
	const int n = out->size > 0 ? uv_try_write((uv_stream_t *)&link->tcp, &data, 1) : 0;

	if (n > 0)
		pen_buf_consume(out, (size_t)n);
}

static void flush(struct pen_link *link)
{
	struct pen_buf swap = link->written, *out;
	uv_buf_t data;
	int r;

	if (link->closing || link->writing)
		return;
	if (link->transfer_count > 0 && link->out.size < PIECE_BYTES)
		append_piece(link);
	out = link->closing ? NULL : output_of(link);
	if (link->closing)
		return;
	if (link->transfer_count == 0)
		write_now(link, out);
	if (out->size == 0) {
		if (link->finishing)
			pen_link_close(link);
		return;
	}
	link->written = *out;
	*out = swap;
	data = uv_buf_init(link->written.data, (unsigned)link->written.size);
	link->write.data = link;
	r = uv_write(&link->write, (uv_stream_t *)&link->tcp, &data, 1, handle_written);
	if (r < 0)
		fail(link, uv_strerror(r));
	else
		link->writing = true;
}

void pen_link_send(struct pen_link *link, const struct pen_msg *msg)
{
	if (link->closing || link->finishing)
		return;
	append(link, msg);
	flush(link);
}

void pen_link_send_file(struct pen_link *link, enum pen_frame_type type,
	const struct pen_sha256 *sha256, int fd, uint64_t size)
{
	struct pen_msg missing = {
		.type = type,
		.u.scene_data = {.sha256 = *sha256, .missing = true},
	};

	if (fd < 0) {
		pen_link_send(link, &missing);
		return;
	}
	if (link->closing || link->finishing || link->transfer_count == TRANSFERS_MAX) {
		(void)close(fd);
		if (link->transfer_count == TRANSFERS_MAX)
			fail(link, "it asks for too many files at once");
		return;
	}
	link->transfers[link->transfer_count++] =
		(struct transfer){.type = type, .sha256 = *sha256, .fd = fd, .size = size};
	flush(link);
}

static void handle_finish_late(uv_timer_t *timer)
{
	pen_link_close(timer->data);
}

void pen_link_finish(struct pen_link *link)
{
	if (link->closing || link->finishing)
		return;
	while (link->transfer_count > 0)
		end_transfer(link);
	link->finishing = true;
	(void)uv_read_stop((uv_stream_t *)&link->tcp);
	(void)uv_timer_start(&link->timer, handle_finish_late, FINISH_MS, 0);
	flush(link);
}

/* Reading */

static void handle_space(uv_handle_t *handle, size_t suggested, uv_buf_t *ret_buf)
{
	struct pen_link *link = handle->data;
	size_t size = RAW_BYTES;
	void *space = link->raw;

	(void)suggested;
	if (link->is_plain)
		space = pen_frame_reader_space(&link->reader, &size);
	*ret_buf = uv_buf_init(space, space ? (unsigned)size : 0);
}

static void handle_frames(struct pen_link *link)
{
	struct pen_frame frame;
	struct pen_msg msg;
	int r = 0;

	while (!link->closing && !link->finishing &&
		(r = pen_frame_reader_next(&link->reader, &frame, &link->err)) > 0) {
		pen_arena_reset(&link->arena);
		r = pen_msg_read(&frame, &link->arena, &msg, &link->err);
		if (r < 0)
			break;
		link->events.message(link->events.user, &msg);
	}
	if (r < 0)
		pen_link_close(link);
}

/* The first bytes are read before it is known that they are frames. */
static void begin_plain(struct pen_link *link, const char *data, size_t size)
{
	link->is_plain = true;
	while (size > 0 && !link->closing) {
		size_t room = 0;
		void *space = pen_frame_reader_space(&link->reader, &room);

		if (!space) {
			fail(link, "there is no memory to read it");
			return;
		}
		if (room > size)
			room = size;
		memcpy(space, data, room);
		pen_frame_reader_fed(&link->reader, room);
		handle_frames(link);
		data += room;
		size -= room;
	}
}

static int read_records(struct pen_link *link)
{
	size_t size = 1, room = 0;
	int r = 0;

	while (r == 0 && size > 0 && !link->closing && !link->finishing) {
		void *space = pen_frame_reader_space(&link->reader, &room);

		r = space ? pen_secure_read(link->secure, space, room, &size, &link->err)
			  : pen_error_memory(&link->err);
		if (r < 0 || size == 0)
			break;
		pen_frame_reader_fed(&link->reader, size);
		handle_frames(link);
	}
	return r;
}

/* What TLS says of the failure goes out if it can: the other end learns why. */
static void end_secure(struct pen_link *link)
{
	struct pen_buf *out = pen_secure_out(link->secure);
	uv_buf_t last = uv_buf_init(out->data, (unsigned)out->size);

	if (out->size > 0 && !link->writing)
		(void)uv_try_write((uv_stream_t *)&link->tcp, &last, 1);
	pen_link_close(link);
}

static void take_raw(struct pen_link *link, size_t size)
{
	int r = pen_secure_feed(link->secure, link->raw, size, &link->err);

	if (r == 0)
		r = pen_secure_shake(link->secure, &link->err);
	if (r > 0)
		r = read_records(link);
	if (r < 0)
		end_secure(link);
	else
		flush(link);
}

static void handle_read(uv_stream_t *stream, ssize_t size, const uv_buf_t *buf)
{
	struct pen_link *link = stream->data;

	(void)buf;
	if (size < 0) {
		fail(link, size == UV_EOF ? "it closed the connection" : uv_strerror((int)size));
	} else if (link->is_plain) {
		pen_frame_reader_fed(&link->reader, (size_t)size);
		handle_frames(link);
	} else if (size > 0 && !link->secure && link->raw[0] != PEN_SECURE_FIRST_BYTE) {
		if (link->allows_plain)
			begin_plain(link, link->raw, (size_t)size);
		else
			fail(link, "it shows no key");
	} else if (size > 0) {
		if (!link->secure && pen_secure_create_server(link->events.find_key,
					     link->events.user, &link->secure, &link->err) < 0)
			pen_link_close(link);
		else
			take_raw(link, (size_t)size);
	}
}

/* Opening */

static void format_address(struct pen_link *link)
{
	struct sockaddr_storage peer;
	int size = sizeof peer;
	char host[48] = "?";
	unsigned port = 0;

	if (uv_tcp_getpeername(&link->tcp, (struct sockaddr *)&peer, &size) == 0) {
		const struct sockaddr_in *ip4 = (const struct sockaddr_in *)&peer;
		const struct sockaddr_in6 *ip6 = (const struct sockaddr_in6 *)&peer;

		(void)uv_ip_name((const struct sockaddr *)&peer, host, sizeof host);
		port = ntohs(peer.ss_family == AF_INET6 ? ip6->sin6_port : ip4->sin_port);
	}
	(void)snprintf(link->address, sizeof link->address, strchr(host, ':') ? "[%s]:%u" : "%s:%u",
		host, port);
}

int pen_link_accept(uv_stream_t *listener, const struct pen_link_events *events, bool allows_plain,
	struct pen_link **ret_link, struct pen_error *err)
{
	struct pen_link *link = calloc(1, sizeof *link);
	int r;

	if (!link || !(link->raw = malloc(RAW_BYTES))) {
		free(link);
		return pen_error_memory(err);
	}
	link->events = *events;
	link->allows_plain = allows_plain;
	pen_frame_reader_init(&link->reader);
	pen_arena_init(&link->arena, ARENA_BYTES_MAX);
	pen_buf_init(&link->out, OUT_BYTES_MAX);
	pen_buf_init(&link->written, OUT_BYTES_MAX);
	(void)uv_tcp_init(listener->loop, &link->tcp);
	(void)uv_timer_init(listener->loop, &link->timer);
	link->tcp.data = link->timer.data = link;
	link->open_handles = 2;
	r = uv_accept(listener, (uv_stream_t *)&link->tcp);
	if (r == 0)
		r = uv_read_start((uv_stream_t *)&link->tcp, handle_space, handle_read);
	(void)uv_tcp_nodelay(&link->tcp, 1);
	(void)uv_tcp_keepalive(&link->tcp, 1, PEN_DEAD_MS / 1000);
	format_address(link);
	*ret_link = link;
	/* Even a link that could not be read from ends by its closed event. */
	if (r < 0)
		fail(link, uv_strerror(r));
	return 0;
}

const char *pen_link_address(const struct pen_link *link)
{
	return link->address;
}

const char *pen_link_name(const struct pen_link *link)
{
	return link->secure ? pen_secure_name(link->secure) : "";
}
