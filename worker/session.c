/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/session.h"

#include "core/base/log.h"
#include "proto/frame.h"

#include <assert.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
	PROTOCOL = 1,
	BACKOFF_MIN_MS = 100,
	BACKOFF_MAX_MS = 5000,
	KEEPALIVE_S = 5,
	ARENA_MAX = 256 << 10,
	RAW_BYTES = 64 << 10
};

#define WRITE_QUEUE_MAX (64ul * PEN_FRAME_PAYLOAD_MAX)

enum session_state {
	STATE_WAITING,	  /* for the timer, to dial */
	STATE_RESOLVING,  /* the coordinator's name */
	STATE_CONNECTING, /* to addresses, one after the other */
	STATE_SECURING,	  /* both show that they have the key */
	STATE_GREETING,	  /* Hello sent */
	STATE_OPEN,
	STATE_CLOSING /* the connection's handle */
};

struct pen_session {
	uv_loop_t *loop;
	const struct pen_worker_config *config;
	const struct pen_session_events *events;
	void *user;
	const struct pen_key *key;
	struct pen_secure *secure; /* NULL without a key */
	enum session_state state;
	bool was_open;	/* closed must be told */
	bool refused;	/* dial no more */
	bool finishing; /* finished must be told */
	bool destroyed;
	uint32_t failures; /* dials in a row */
	uv_timer_t timer;  /* the next dial, or how long a greeting may take */
	uv_tcp_t tcp;
	uv_getaddrinfo_t resolve;
	uv_connect_t connect;
	uv_shutdown_t shutdown;
	struct addrinfo *addresses, *address; /* all, and the next to try */
	struct pen_frame_reader reader;
	struct pen_arena arena;
	uint32_t sequence;   /* of the next frame to send */
	char raw[RAW_BYTES]; /* what is read of TLS */
};

/* A frame on its way. */
struct write {
	uv_write_t request;
	char *data;
};

static void connect_next(struct pen_session *session);
static void handle_timer(uv_timer_t *timer);

static void free_addresses(struct pen_session *session)
{
	uv_freeaddrinfo(session->addresses);
	session->addresses = session->address = NULL;
}

/* Half to one and a half of the doubling pause, so that many workers do not return as one. */
static uint64_t next_pause_ms(struct pen_session *session)
{
	uint64_t pause_ms = BACKOFF_MIN_MS;
	uint32_t random = 0;

	for (uint32_t i = 0; i < session->failures && pause_ms < BACKOFF_MAX_MS; i++)
		pause_ms *= 2;
	if (pause_ms > BACKOFF_MAX_MS)
		pause_ms = BACKOFF_MAX_MS;
	session->failures++;
	(void)uv_random(NULL, NULL, &random, sizeof random, 0, NULL);
	return pause_ms / 2 + random % (pause_ms + 1);
}

static void wait_to_dial(struct pen_session *session, uint64_t pause_ms)
{
	session->state = STATE_WAITING;
	(void)uv_timer_start(&session->timer, handle_timer, pause_ms, 0);
}

static void handle_destroyed(uv_handle_t *handle)
{
	struct pen_session *session = handle->data;

	pen_secure_destroy(session->secure);
	pen_frame_reader_finish(&session->reader);
	pen_arena_finish(&session->arena);
	free_addresses(session);
	free(session);
}

/* The handle is free again: tell, then dial the next address, or later all of them again. */
static void handle_closed(uv_handle_t *handle)
{
	struct pen_session *session = handle->data;
	bool was_open = session->was_open;

	session->was_open = false;
	if (session->destroyed) {
		uv_close((uv_handle_t *)&session->timer, handle_destroyed);
		return;
	}
	if (was_open)
		session->events->closed(session->user);
	if (session->finishing) {
		session->state = STATE_WAITING;
		session->events->finished(session->user);
	} else if (session->refused) {
		session->state = STATE_WAITING;
	} else if (session->address) {
		connect_next(session);
	} else {
		free_addresses(session);
		wait_to_dial(session, next_pause_ms(session));
	}
}

static void hang_up(struct pen_session *session)
{
	if (session->state == STATE_CLOSING)
		return;
	session->state = STATE_CLOSING;
	(void)uv_timer_stop(&session->timer);
	uv_close((uv_handle_t *)&session->tcp, handle_closed);
}

static void lose(struct pen_session *session, const char *reason)
{
	enum pen_log_level level = session->failures > 0 ? PEN_LOG_DEBUG : PEN_LOG_WARNING;

	if (session->state == STATE_CLOSING)
		return;
	pen_log(level, "%s:%s: %s", session->config->host, session->config->port, reason);
	hang_up(session);
}

static void handle_welcome(struct pen_session *session, const struct pen_msg *msg)
{
	(void)uv_timer_stop(&session->timer);
	free_addresses(session);
	session->state = STATE_OPEN;
	session->was_open = true;
	session->failures = 0;
	pen_log_of(&(struct pen_log_about){.worker = msg->u.welcome.worker}, PEN_LOG_INFO,
		"connected to %s:%s as worker %llu", session->config->host, session->config->port,
		(unsigned long long)msg->u.welcome.worker);
	session->events->open(session->user, &msg->u.welcome);
}

static void handle_refuse(struct pen_session *session, const struct pen_msg *msg)
{
	session->refused = true;
	hang_up(session);
	session->events->refused(session->user, msg->u.text.reason);
}

static void handle_message(struct pen_session *session, const struct pen_msg *msg)
{
	bool greeting = session->state == STATE_GREETING;

	switch (msg->type) {
	case PEN_FRAME_WELCOME:
		if (greeting)
			handle_welcome(session, msg);
		else
			lose(session, "welcomed twice");
		break;
	case PEN_FRAME_REFUSE: handle_refuse(session, msg); break;
	case PEN_FRAME_SCENE_DATA:
	case PEN_FRAME_ASSET_DATA:
	case PEN_FRAME_LEASE:
	case PEN_FRAME_REVOKE:
	case PEN_FRAME_DRAIN:
		if (greeting)
			lose(session, "spoke before it welcomed");
		else
			session->events->message(session->user, msg);
		break;
	default: lose(session, "sent what only workers send"); break;
	}
}

static void read_frames(struct pen_session *session)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_frame frame;
	struct pen_msg msg;
	int r = 0;

	while (session->state == STATE_GREETING || session->state == STATE_OPEN) {
		r = pen_frame_reader_next(&session->reader, &frame, &err);
		if (r <= 0)
			break;
		pen_arena_reset(&session->arena);
		r = pen_msg_read(&frame, &session->arena, &msg, &err);
		if (r < 0)
			break;
		handle_message(session, &msg);
	}
	if (r < 0)
		lose(session, err.text);
}

static void handle_space(uv_handle_t *handle, size_t suggested, uv_buf_t *buf)
{
	struct pen_session *session = handle->data;
	size_t size = sizeof session->raw;

	(void)suggested;
	buf->base =
		session->secure ? session->raw : pen_frame_reader_space(&session->reader, &size);
	buf->len = buf->base ? size : 0;
}

static void handle_written(uv_write_t *request, int status)
{
	struct write *write = request->data;
	struct pen_session *session = request->handle->data;

	if (status < 0 && status != UV_ECANCELED)
		lose(session, uv_strerror(status));
	free(write->data);
	free(write);
}

/* Sends what is in out, whose bytes it takes; false: it was not to be, and the session is lost. */
static bool write_bytes(struct pen_session *session, struct pen_buf *out)
{
	struct write *write = calloc(1, sizeof *write);
	uv_buf_t buf = uv_buf_init(out->data, (unsigned int)out->size);

	if (!write) {
		lose(session, "out of memory");
		return false;
	}
	write->request.data = write;
	write->data = pen_buf_take(out);
	if (uv_write(&write->request, (uv_stream_t *)&session->tcp, &buf, 1, handle_written) == 0)
		return true;
	lose(session, "cannot be written to");
	free(write->data);
	free(write);
	return false;
}

static void write_message(struct pen_session *session, const struct pen_msg *msg)
{
	size_t waiting = uv_stream_get_write_queue_size((uv_stream_t *)&session->tcp);
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_buf out;
	int r;

	pen_buf_init(&out, WRITE_QUEUE_MAX > waiting ? WRITE_QUEUE_MAX - waiting : 0);
	r = pen_msg_write(msg, &out, &session->sequence, &err);
	if (r == 0 && session->secure)
		r = pen_secure_write(session->secure, out.data, out.size, &err);
	if (r < 0)
		lose(session, err.text);
	else
		(void)write_bytes(
			session, session->secure ? pen_secure_out(session->secure) : &out);
	pen_buf_finish(&out);
}

static void say_hello(struct pen_session *session)
{
	char equivalence_class[PEN_CLASS_TEXT];
	struct pen_msg msg = {
		.type = PEN_FRAME_HELLO,
		.u.hello =
			{
				.protocol = PROTOCOL,
				.name = session->config->name,
				.processes = session->config->processes,
				.equivalence_class = equivalence_class,
				.version = PEN_VERSION,
				.pid = (uint32_t)getpid(),
			},
	};

	pen_class_format(session->config->isa, equivalence_class);
	write_message(session, &msg);
}

/* A key that is good once will not be taken the next time either: whoever started us has another.
 */
static void give_up_key(struct pen_session *session, const char *reason)
{
	if (!session->key->is_single_use) {
		lose(session, reason);
		return;
	}
	session->refused = true;
	hang_up(session);
	session->events->refused(session->user, reason);
}

static int read_records(struct pen_session *session, struct pen_error *err)
{
	size_t size = 1, room = 0;
	int r = 0;

	while (r == 0 && size > 0 &&
		(session->state == STATE_GREETING || session->state == STATE_OPEN)) {
		void *space = pen_frame_reader_space(&session->reader, &room);

		r = space ? pen_secure_read(session->secure, space, room, &size, err)
			  : pen_error_memory(err);
		if (r < 0 || size == 0)
			break;
		pen_frame_reader_fed(&session->reader, size);
		read_frames(session);
	}
	return r;
}

/* 1: both know each other. */
static int shake(struct pen_session *session, struct pen_error *err)
{
	struct pen_buf *out = pen_secure_out(session->secure);
	int r = pen_secure_shake(session->secure, err);

	if (out->size > 0 && !write_bytes(session, out))
		return 0;
	if (r > 0 && session->state == STATE_SECURING) {
		session->state = STATE_GREETING;
		say_hello(session);
	}
	return r;
}

static void take_raw(struct pen_session *session, size_t size)
{
	struct pen_error err = PEN_ERROR_INIT;
	bool securing = session->state == STATE_SECURING;
	int r = pen_secure_feed(session->secure, session->raw, size, &err);

	if (r == 0)
		r = shake(session, &err);
	if (r > 0)
		r = read_records(session, &err);
	if (r < 0 && securing)
		give_up_key(session, "the coordinator does not know this worker's key");
	else if (r < 0)
		lose(session, err.text);
}

static void handle_read(uv_stream_t *stream, ssize_t size, const uv_buf_t *buf)
{
	struct pen_session *session = stream->data;

	(void)buf;
	if (size < 0) {
		lose(session, size == UV_EOF ? "closed the connection" : uv_strerror((int)size));
	} else if (size > 0 && session->secure) {
		take_raw(session, (size_t)size);
	} else if (size > 0) {
		pen_frame_reader_fed(&session->reader, (size_t)size);
		read_frames(session);
	}
}

/* What was left of the last connection goes. */
static int begin_stream(struct pen_session *session, struct pen_error *err)
{
	pen_frame_reader_finish(&session->reader);
	pen_frame_reader_init(&session->reader);
	session->sequence = 0;
	pen_secure_destroy(session->secure);
	session->secure = NULL;
	if (session->key->name[0] == '\0')
		return 0;
	return pen_secure_create_client(
		session->key->name, session->key->bits, &session->secure, err);
}

static void set_options(struct pen_session *session)
{
	const unsigned int timeout_ms = PEN_DEAD_MS;
	uv_os_fd_t fd;

	(void)uv_tcp_nodelay(&session->tcp, 1);
	(void)uv_tcp_keepalive(&session->tcp, 1, KEEPALIVE_S);
	if (uv_fileno((uv_handle_t *)&session->tcp, &fd) == 0)
		(void)setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &timeout_ms, sizeof timeout_ms);
}

static void handle_connected(uv_connect_t *request, int status)
{
	struct pen_session *session = request->handle->data;
	struct pen_error err = PEN_ERROR_INIT;

	if (session->state == STATE_CLOSING)
		return;
	if (status < 0) {
		lose(session, uv_strerror(status));
		return;
	}
	set_options(session);
	if (begin_stream(session, &err) < 0) {
		lose(session, err.text);
		return;
	}
	session->state = session->secure ? STATE_SECURING : STATE_GREETING;
	(void)uv_read_start((uv_stream_t *)&session->tcp, handle_space, handle_read);
	if (!session->secure)
		say_hello(session);
	else if (shake(session, &err) < 0)
		lose(session, err.text);
}

static void connect_next(struct pen_session *session)
{
	const struct addrinfo *address = session->address;
	int r;

	session->address = address->ai_next;
	session->state = STATE_CONNECTING;
	(void)uv_tcp_init(session->loop, &session->tcp);
	session->tcp.data = session;
	(void)uv_timer_start(&session->timer, handle_timer, PEN_HELLO_MS, 0);
	r = uv_tcp_connect(&session->connect, &session->tcp, address->ai_addr, handle_connected);
	if (r < 0)
		lose(session, uv_strerror(r));
}

static void handle_resolved(uv_getaddrinfo_t *request, int status, struct addrinfo *addresses)
{
	struct pen_session *session = request->data;

	session->addresses = session->address = addresses;
	if (session->finishing || session->destroyed) {
		/* The timer does what is left. */
		wait_to_dial(session, 0);
	} else if (status < 0) {
		pen_log(PEN_LOG_WARNING, "%s: %s", session->config->host, uv_strerror(status));
		wait_to_dial(session, next_pause_ms(session));
	} else {
		connect_next(session);
	}
}

static void dial(struct pen_session *session)
{
	const struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM};
	int r;

	free_addresses(session);
	session->state = STATE_RESOLVING;
	session->resolve.data = session;
	r = uv_getaddrinfo(session->loop, &session->resolve, handle_resolved, session->config->host,
		session->config->port, &hints);
	if (r < 0)
		wait_to_dial(session, next_pause_ms(session));
}

static void handle_timer(uv_timer_t *timer)
{
	struct pen_session *session = timer->data;

	if (session->state != STATE_WAITING)
		lose(session, "does not answer");
	else if (session->destroyed)
		uv_close((uv_handle_t *)&session->timer, handle_destroyed);
	else if (session->finishing)
		session->events->finished(session->user);
	else
		dial(session);
}

static void handle_shutdown(uv_shutdown_t *request, int status)
{
	(void)status;
	hang_up(request->handle->data);
}

int pen_session_create(uv_loop_t *loop, const struct pen_worker_config *config,
	const struct pen_key *key, const struct pen_session_events *events, void *user,
	struct pen_session **ret_session, struct pen_error *err)
{
	struct pen_session *session = calloc(1, sizeof *session);

	if (!session)
		return pen_error_memory(err);
	session->loop = loop;
	session->config = config;
	session->events = events;
	session->user = user;
	session->key = key;
	pen_arena_init(&session->arena, ARENA_MAX);
	pen_frame_reader_init(&session->reader);
	(void)uv_timer_init(loop, &session->timer);
	session->timer.data = session;
	wait_to_dial(session, 0);
	*ret_session = session;
	return 0;
}

bool pen_session_is_open(const struct pen_session *session)
{
	return session->state == STATE_OPEN;
}

void pen_session_send(struct pen_session *session, const struct pen_msg *msg)
{
	if (session->state == STATE_OPEN)
		write_message(session, msg);
}

void pen_session_finish(struct pen_session *session)
{
	session->finishing = true;
	if (session->state == STATE_OPEN &&
		uv_shutdown(&session->shutdown, (uv_stream_t *)&session->tcp, handle_shutdown) == 0)
		return;
	if (session->state == STATE_WAITING)
		wait_to_dial(session, 0);
	else if (session->state != STATE_RESOLVING)
		hang_up(session);
}

void pen_session_destroy(struct pen_session *session)
{
	if (!session)
		return;
	session->destroyed = true;
	if (session->state == STATE_WAITING)
		wait_to_dial(session, 0);
	else if (session->state != STATE_RESOLVING)
		hang_up(session);
}
