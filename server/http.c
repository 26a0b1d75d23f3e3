/* SPDX-License-Identifier: Apache-2.0 */
#include "server/http.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "core/base/log.h"
#include "core/base/text.h"
#include "server/api.h"
#include "server/asset_file.h"
#include "server/certificate.h"
#include "server/drain.h"
#include "server/exchange.h"
#include "server/framing.h"
#include "server/listener.h"
#include "server/response.h"
#include "server/turns.h"
#include "server/visitor.h"
#include "server/watch.h"

#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

/* A way in: a listening socket with a libmicrohttpd of its own. */
struct entrance {
	struct pen_http *http;
	struct MHD_Daemon *daemon;
	struct pen_turns turns;
	bool is_local; /* a socket in the file system, whose clients' users are known */
};

enum { PUBLIC, LOCAL, ENTRANCES };

struct pen_http {
	struct pen_api api;
	struct entrance entrances[ENTRANCES];
	unsigned open; /* of those that take turns */
	struct pen_drains drains;
	struct pen_unchanged unchanged;
	struct pen_visitors *visitors;
	const struct pen_certificate *certificate; /* or NULL */
	struct request *requests;
	uint64_t body_bytes;   /* of all requests */
	uint64_t answer_bytes; /* likewise, in memory */
	uint32_t instance;     /* a random number that is not another coordinator's, likely */
	uint64_t request_count;
	uint16_t port;
	const char *path; /* of the local entrance; NULL: none */
};

/* An exchange with libmicrohttpd's side of it. */
struct request {
	struct pen_exchange exchange;
	struct pen_http *http;		   /* NULL when the service has gone */
	struct entrance *entrance;	   /* valid as long as that */
	struct MHD_Connection *connection; /* NULL when the client has gone */
	struct MHD_Response *response;	   /* the answer */
	bool shares_response;
	unsigned status;
	uint64_t answer_bytes; /* its part of those of all */
	bool named_by_client;
	bool handled;	  /* by the API, which answers or has answered */
	bool suspended;	  /* until the answer comes */
	bool streams;	  /* the answer: events, as they come */
	unsigned refused; /* status: no room for the body, the rest of which is thrown away */
	struct request *previous, *next;
};

/* Requests */

static struct request *request_of(const struct pen_exchange *exchange)
{
	return (struct request *)(uintptr_t)exchange; /* its first member */
}

/* What a client calls it, if that may stand in a log and a field; else what nobody else is called.
 */
static void name_request(struct request *request)
{
	static const char allowed[] =
		"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.";
	const char *given =
		MHD_lookup_connection_value(request->connection, MHD_HEADER_KIND, "X-Request-Id");
	const size_t length = given ? strlen(given) : 0;
	struct pen_exchange *exchange = &request->exchange;
	char *end;

	if (length > 0 && length <= PEN_REQUEST_ID_MAX && strspn(given, allowed) == length) {
		memcpy(exchange->id, given, length + 1);
		request->named_by_client = true;
		return;
	}
	end = pen_text_hex(exchange->id, request->http->instance);
	*end++ = '-';
	*pen_text_hex(end, ++request->http->request_count) = '\0';
}

static bool is_owner(const struct entrance *entrance, struct MHD_Connection *connection)
{
	return entrance->is_local && pen_listener_peer_is_owner(MHD_get_connection_info(
					     connection, MHD_CONNECTION_INFO_CONNECTION_FD)
									->connect_fd);
}

static struct request *request_create(struct entrance *entrance, struct MHD_Connection *connection,
	const char *path, enum pen_method method)
{
	struct pen_http *http = entrance->http;
	struct request *request = calloc(1, sizeof *request);

	if (!request)
		return NULL;
	request->exchange.path = strdup(path);
	if (!request->exchange.path) {
		free(request);
		return NULL;
	}
	request->exchange.api = &http->api;
	request->exchange.method = method;
	pen_buf_init(&request->exchange.body, PEN_HTTP_BODY_MAX);
	request->exchange.is_local = entrance->is_local;
	request->exchange.is_owner = is_owner(entrance, connection);
	request->http = http;
	request->entrance = entrance;
	request->connection = connection;
	name_request(request);
	request->next = http->requests;
	if (request->next)
		request->next->previous = request;
	http->requests = request;
	return request;
}

/* The service lets go of a request: its answer has nowhere to go. */
static void request_detach(struct request *request)
{
	struct pen_http *http = request->http;

	http->body_bytes -= request->exchange.body.size;
	http->answer_bytes -= request->answer_bytes;
	if (request->previous)
		request->previous->next = request->next;
	else
		http->requests = request->next;
	if (request->next)
		request->next->previous = request->previous;
	request->http = NULL;
	request->exchange.api = NULL;
}

static void request_destroy(struct request *request)
{
	if (request->http)
		request_detach(request);
	if (request->response && !request->shares_response)
		MHD_destroy_response(request->response);
	pen_buf_finish(&request->exchange.body);
	pen_asset_upload_destroy(request->exchange.upload);
	free((char *)(uintptr_t)request->exchange.path);
	free(request);
}

/* Whether the API still holds the exchange. */
static bool request_awaited(const struct request *request)
{
	return request->handled && request->status == 0;
}

/* Answers */

static void look_again(void *user)
{
	struct entrance *entrance = user;

	pen_turns_ask(&entrance->turns);
}

static bool changes_nothing(const struct request *request)
{
	return request->exchange.method == PEN_GET || request->exchange.method == PEN_HEAD;
}

/*
 * Counts an answer until it is taken; when those of all fill the memory for them, it is refused,
 * unless it tells of something that was done: such a request is refused before that.
 */
static void hold_answer(struct request *request, struct pen_answer *answer)
{
	struct pen_http *http = request->http;

	if (!http || !answer->text)
		return;
	if (changes_nothing(request) && http->answer_bytes + answer->size > PEN_HTTP_ANSWERS_MAX) {
		pen_answer_finish(answer);
		pen_answer_problem(answer, 503, "too many answers wait to be taken");
		pen_answer_field(answer, "Retry-After", "5");
	}
	request->answer_bytes = answer->size;
	http->answer_bytes += answer->size;
}

/*
 * Of a 304, nobody needs to know by which name the logs call the request, unless the client gave
 * it; and one that is queued at once is queued before the next is asked for.
 */
static bool may_share(const struct request *request, const struct pen_answer *answer)
{
	return answer->status == 304 && !request->named_by_client && !request->suspended &&
	       request->http;
}

void pen_exchange_answer(struct pen_exchange *exchange, struct pen_answer *answer)
{
	struct request *request = request_of(exchange);

	assert(request_awaited(request));
	hold_answer(request, answer);
	request->shares_response = may_share(request, answer);
	request->response = request->shares_response
				    ? pen_unchanged_get(&request->http->unchanged, answer)
				    : pen_response_of(answer);
	if (!request->response) {
		pen_answer_error(answer, &(struct pen_error){PEN_ENOMEM, "out of memory"});
		request->response = pen_response_of(answer);
		request->shares_response = false;
	}
	request->status = answer->status;
	if (!request->connection) {
		request_destroy(request);
		return;
	}
	if (!request->suspended)
		return;
	request->suspended = false;
	MHD_resume_connection(request->connection);
	look_again(request->entrance);
}

void pen_exchange_stream(struct pen_exchange *exchange, const struct pen_answer *answer,
	const struct pen_stream_source *source)
{
	struct request *request = request_of(exchange);

	assert(request_awaited(request) && !request->suspended);
	request->response =
		pen_stream_response(source, request->connection, look_again, request->entrance);
	request->status = answer->status;
	request->streams = true;
	if (request->response && !pen_response_add_fields(request->response, answer)) {
		MHD_destroy_response(request->response);
		request->response = NULL;
	}
}

void pen_exchange_problem(struct pen_exchange *exchange, unsigned status, const char *detail)
{
	struct pen_answer answer;

	pen_answer_problem(&answer, status, detail);
	pen_exchange_answer(exchange, &answer);
}

void pen_exchange_error(struct pen_exchange *exchange, const struct pen_error *err)
{
	struct pen_answer answer;

	pen_answer_error(&answer, err);
	pen_exchange_answer(exchange, &answer);
}

const char *pen_exchange_field(const struct pen_exchange *exchange, const char *name)
{
	struct MHD_Connection *connection = request_of(exchange)->connection;

	return connection ? MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name) : NULL;
}

const char *pen_exchange_query(const struct pen_exchange *exchange, const char *name)
{
	struct MHD_Connection *connection = request_of(exchange)->connection;

	return connection ? MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, name)
			  : NULL;
}

struct query_visit {
	void (*take)(void *user, const char *name, const char *value);
	void *user;
};

static enum MHD_Result visit_query(
	void *user, enum MHD_ValueKind kind, const char *name, const char *value)
{
	const struct query_visit *visit = user;

	(void)kind;
	visit->take(visit->user, name, value ? value : "");
	return MHD_YES;
}

void pen_exchange_each_query(const struct pen_exchange *exchange,
	void (*take)(void *user, const char *name, const char *value), void *user)
{
	struct query_visit visit = {take, user};
	struct MHD_Connection *connection = request_of(exchange)->connection;

	if (connection)
		(void)MHD_get_connection_values(
			connection, MHD_GET_ARGUMENT_KIND, visit_query, &visit);
}

/* What libmicrohttpd calls */

/* NULL when it is not watched. */
static struct pen_visitor *visitor_of(struct MHD_Connection *connection)
{
	return MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT)
		->socket_context;
}

static enum MHD_Result queue_answer(struct request *request)
{
	struct pen_visitor *visitor = visitor_of(request->connection);

	if (request->streams)
		pen_visitor_waits(visitor);
	else
		pen_visitor_takes(visitor);
	/* Without a response there was no memory for one: the connection ends. */
	if (!request->response)
		return MHD_NO;
	if (!request->shares_response && MHD_add_response_header(request->response, "X-Request-Id",
						 request->exchange.id) == MHD_NO)
		return MHD_NO;
	pen_log_of(&(struct pen_log_about){.request = request->exchange.id}, PEN_LOG_DEBUG,
		"request %s: %u", request->exchange.id, request->status);
	return MHD_queue_response(request->connection, request->status, request->response);
}

static enum pen_method method_of(const char *name)
{
	static const char *const names[] = {
		[PEN_GET] = "GET",
		[PEN_HEAD] = "HEAD",
		[PEN_POST] = "POST",
		[PEN_PUT] = "PUT",
		[PEN_PATCH] = "PATCH",
		[PEN_DELETE] = "DELETE",
		[PEN_OPTIONS] = "OPTIONS",
	};

	for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
		if (strcmp(name, names[i]) == 0)
			return (enum pen_method)i;
	}
	return PEN_METHOD_OTHER;
}

/* 0, or the status that refuses more bytes of a body. */
static unsigned refusal(const struct request *request, uint64_t more)
{
	if (more > PEN_HTTP_BODY_MAX - request->exchange.body.size)
		return 413;
	return request->http->body_bytes + more > PEN_HTTP_BODIES_MAX ? 503 : 0;
}

static const char *reason_of(const struct request *request, unsigned status)
{
	switch (status) {
	case 413:
		return request->exchange.upload
			       ? "the asset is too large: at most 1 GiB is taken"
			       : "the body is too large: at most 8 MiB of scene are taken";
	case 507: return "the disk of the data directory is full";
	case 500: return "the asset cannot be stored";
	default: return "too many requests with large bodies or answers at once";
	}
}

static enum MHD_Result refuse_body(struct request *request, unsigned status)
{
	struct pen_answer answer;

	request->handled = true;
	pen_answer_problem(&answer, status, reason_of(request, status));
	if (status == 503)
		pen_answer_field(&answer, "Retry-After", "5");
	pen_exchange_answer(&request->exchange, &answer);
	return queue_answer(request);
}

static enum MHD_Result refuse_framing(struct request *request, struct pen_framing_defect defect)
{
	struct pen_answer answer;

	request->handled = true;
	pen_answer_problem(&answer, defect.status, defect.detail);
	pen_answer_field(&answer, "Connection", "close");
	pen_exchange_answer(&request->exchange, &answer);
	return queue_answer(request);
}

static bool keeps_body(const struct request *request)
{
	return !request->exchange.upload && !request->exchange.ignores_body;
}

/* The header is complete and its body has not begun: one that nobody wants is refused now. */
static enum MHD_Result begin(struct request *request, const char *version)
{
	const struct pen_framing_defect defect = pen_framing_check(request->connection, version);
	const char *length = pen_exchange_field(&request->exchange, "Content-Length");
	const union MHD_ConnectionInfo *info;
	unsigned status = 0;

	if (defect.status != 0)
		return refuse_framing(request, defect);
	request->handled = true;
	if (pen_api_admit(&request->exchange)) {
		request->handled = false;
		if (length && keeps_body(request))
			status = refusal(request, strtoull(length, NULL, 10));
		if (status == 0)
			return MHD_YES;
	}
	info = MHD_get_connection_info(request->connection, MHD_CONNECTION_INFO_CONNECTION_FD);
	pen_drains_add(&request->http->drains, info->connect_fd);
	return request->handled ? queue_answer(request) : refuse_body(request, status);
}

static void take_upload(struct request *request, const char *data, size_t size)
{
	struct pen_error err = PEN_ERROR_INIT;

	if (request->refused != 0 ||
		pen_asset_upload_append(request->exchange.upload, data, size, &err) == 0)
		return;
	request->refused = err.code == PEN_ELIMIT ? 413 : err.code == PEN_ENOSPACE ? 507 : 500;
}

/* A body of unknown length is read to its end even when it turns out to be too large. */
static void take_body(struct request *request, const char *data, size_t size)
{
	pen_visitor_sent(visitor_of(request->connection), size);
	if (request->exchange.upload)
		take_upload(request, data, size);
	if (!keeps_body(request))
		return;
	if (request->refused == 0)
		request->refused = refusal(request, size);
	if (request->refused == 0 && pen_buf_append(&request->exchange.body, data, size) < 0)
		request->refused = 503;
	if (request->refused == 0)
		request->http->body_bytes += size;
}

static enum MHD_Result finish_request(struct request *request)
{
	if (request->refused == 0 && !request->handled && !changes_nothing(request) &&
		request->http->answer_bytes >= PEN_HTTP_ANSWERS_MAX)
		request->refused = 503;
	if (request->refused != 0)
		return refuse_body(request, request->refused);
	if (!request->handled) {
		request->handled = true;
		pen_api_handle(&request->exchange);
	}
	if (!request_awaited(request))
		return queue_answer(request);
	request->suspended = true;
	pen_visitor_waits(visitor_of(request->connection));
	MHD_suspend_connection(request->connection);
	return MHD_YES;
}

static enum MHD_Result access_handler(void *user, struct MHD_Connection *connection,
	const char *url, const char *method, const char *version, const char *upload_data,
	size_t *upload_data_size, void **con_cls)
{
	struct entrance *entrance = user;
	struct request *request = *con_cls;

	pen_turns_moved(&entrance->turns);
	if (!request) {
		request = request_create(entrance, connection, url, method_of(method));
		*con_cls = request;
		pen_visitor_sends(visitor_of(connection));
		return request ? begin(request, version) : MHD_NO;
	}
	if (*upload_data_size > 0) {
		take_body(request, upload_data, *upload_data_size);
		*upload_data_size = 0;
		return MHD_YES;
	}
	return finish_request(request);
}

static void request_completed(void *user, struct MHD_Connection *connection, void **con_cls,
	enum MHD_RequestTerminationCode code)
{
	struct request *request = *con_cls;

	(void)user, (void)code;
	*con_cls = NULL;
	pen_visitor_rests(visitor_of(connection));
	if (!request)
		return;
	request->connection = NULL;
	if (!request_awaited(request))
		request_destroy(request);
}

static size_t unescape(void *user, struct MHD_Connection *connection, char *text)
{
	(void)user, (void)connection;
	return pen_framing_unescape(text);
}

static enum MHD_Result connection_welcome(
	void *user, const struct sockaddr *address, socklen_t size)
{
	const struct pen_http *http = user;

	(void)size;
	return pen_visitors_welcome(http->visitors, address) ? MHD_YES : MHD_NO;
}

static void connection_changed(void *user, struct MHD_Connection *connection, void **socket_context,
	enum MHD_ConnectionNotificationCode code)
{
	struct pen_http *http = user;
	const struct sockaddr *address;
	int fd;

	if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
		pen_visitor_leave(*socket_context);
		*socket_context = NULL;
		return;
	}
	fd = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
	address = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS)
			  ->client_addr;
	*socket_context = pen_visitor_enter(http->visitors, fd, address);
}

/* The loop's side */

/*
 * A connection gets a copy of what is shown now, so that the certificate may change while others
 * are in the middle of their handshake.
 */
static int show_certificate(struct gnutls_session_int *session,
	const struct gnutls_cert_retr_st *info, struct gnutls_pcert_st **ret_certs,
	unsigned *ret_count, struct gnutls_ocsp_data_st **ret_ocsp, unsigned *ret_ocsp_count,
	struct gnutls_privkey_st **ret_key, unsigned *ret_flags)
{
	const struct pen_visitor *visitor = visitor_of(pen_certificate_user(session));
	const struct pen_http *http = visitor ? pen_visitor_user(visitor) : NULL;

	(void)info;
	*ret_ocsp = NULL;
	*ret_ocsp_count = 0;
	return pen_certificate_present(
		http ? http->certificate : NULL, ret_certs, ret_count, ret_key, ret_flags);
}

/* TLS 1.3 and nothing before it. */
static const char tls_priorities[] = "NORMAL:-VERS-ALL:+VERS-TLS1.3";

/* The socket passes to the daemon. */
static int start_daemon(
	struct entrance *entrance, int fd, unsigned connections_max, struct pen_error *err)
{
	struct pen_http *http = entrance->http;
	const bool has_tls = http->certificate && !entrance->is_local;
	unsigned flags = MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | (has_tls ? MHD_USE_TLS : 0);
	struct MHD_OptionItem tls[] = {
		{MHD_OPTION_HTTPS_CERT_CALLBACK2, 0, (void *)(uintptr_t)show_certificate},
		{MHD_OPTION_HTTPS_PRIORITIES, 0, (void *)(uintptr_t)tls_priorities},
		{MHD_OPTION_END, 0, NULL},
	};

	if (!has_tls)
		tls[0].option = MHD_OPTION_END;
	entrance->daemon = MHD_start_daemon(flags, 0, connection_welcome, http, access_handler,
		entrance, MHD_OPTION_LISTEN_SOCKET, fd, MHD_OPTION_NOTIFY_COMPLETED,
		request_completed, http, MHD_OPTION_NOTIFY_CONNECTION, connection_changed, http,
		MHD_OPTION_UNESCAPE_CALLBACK, unescape, NULL, MHD_OPTION_STRICT_FOR_CLIENT, 1,
		MHD_OPTION_CONNECTION_LIMIT, connections_max, MHD_OPTION_CONNECTION_TIMEOUT,
		PEN_HTTP_IDLE_S, MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)PEN_HTTP_MEMORY,
		MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1, MHD_OPTION_ARRAY, tls, MHD_OPTION_END);
	if (entrance->daemon)
		return 0;
	(void)close(fd);
	return pen_error_set(err, PEN_EIO, "the HTTP server does not start");
}

static int open_entrance(struct pen_http *http, uv_loop_t *loop, int which, int fd,
	unsigned connections_max, struct pen_error *err)
{
	struct entrance *entrance = &http->entrances[which];
	int r;

	*entrance = (struct entrance){.http = http, .is_local = which == LOCAL};
	r = start_daemon(entrance, fd, connections_max, err);
	if (r == 0)
		r = pen_turns_start(&entrance->turns, loop, entrance->daemon, http->visitors, err);
	if (r == 0)
		http->open++;
	return r;
}

static int open_entrances(struct pen_http *http, uv_loop_t *loop,
	const struct pen_http_options *options, struct pen_error *err)
{
	int fd = options->socket;
	int r = fd < 0 ? pen_listener_tcp(&options->address, &fd, err) : 0;

	if (r < 0)
		return r;
	http->port = pen_listener_port(fd);
	r = open_entrance(http, loop, PUBLIC, fd, PEN_HTTP_CONNECTIONS_MAX, err);
	if (r < 0 || !options->path)
		return r;
	r = pen_listener_unix(options->path, &fd, err);
	if (r < 0)
		return r;
	http->path = options->path;
	return open_entrance(http, loop, LOCAL, fd, PEN_HTTP_LOCAL_MAX, err);
}

int pen_http_create(uv_loop_t *loop, const struct pen_http_options *options,
	struct pen_http **ret_http, struct pen_error *err)
{
	struct pen_http *http = calloc(1, sizeof *http);
	int r;

	if (!http)
		return pen_error_memory(err);
	(void)!getrandom(&http->instance, sizeof http->instance, 0);
	http->api = (struct pen_api){
		.loop = loop,
		.jobs = options->jobs,
		.farm = options->farm,
		.encoders = options->encoders,
		.shelf = options->shelf,
		.guard = options->guard,
		.assets_dir = options->assets_dir,
		.scenes_dir = options->scenes_dir,
		.boot = (uint64_t)pen_clock_wall_ms(),
	};
	http->certificate = options->certificate;
	http->drains.loop = loop;
	r = pen_watches_create(loop, options->jobs, &http->api.watches, err);
	if (r == 0)
		r = pen_visitors_create(loop, http, &http->visitors, err);
	if (r == 0)
		r = open_entrances(http, loop, options, err);
	if (r < 0) {
		pen_http_destroy(http);
		return r;
	}
	*ret_http = http;
	return 0;
}

uint16_t pen_http_port(const struct pen_http *http)
{
	return http->port;
}

void pen_http_drain(struct pen_http *http)
{
	http->api.draining = true;
}

/* Requests that the API still holds stay with it, without a client to answer. */
static void let_go_of_requests(struct pen_http *http)
{
	struct request *next;

	for (struct request *request = http->requests; request; request = next) {
		next = request->next;
		if (request->suspended) {
			request->suspended = false;
			MHD_resume_connection(request->connection);
		}
		if (request_awaited(request))
			request_detach(request);
	}
}

static void entrance_closed(void *user)
{
	struct pen_http *http = user;

	if (--http->open == 0)
		free(http);
}

static void close_entrances(struct pen_http *http)
{
	for (int i = 0; i < ENTRANCES; i++) {
		struct entrance *entrance = &http->entrances[i];

		if (entrance->turns.handles > 0)
			pen_turns_close(&entrance->turns, entrance_closed, http);
		if (entrance->daemon)
			MHD_stop_daemon(entrance->daemon);
	}
	if (http->path)
		pen_listener_remove(http->path);
}

void pen_http_destroy(struct pen_http *http)
{
	if (!http)
		return;
	pen_drains_finish(&http->drains);
	pen_unchanged_finish(&http->unchanged);
	let_go_of_requests(http);
	pen_watches_destroy(http->api.watches);
	pen_recent_finish(&http->api.recent);
	pen_held_finish(&http->api.held);
	close_entrances(http);
	pen_visitors_destroy(http->visitors);
	if (http->open == 0)
		free(http);
}
