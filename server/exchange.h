/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_EXCHANGE_H
#define PEN_SERVER_EXCHANGE_H

#include "core/base/buf.h"
#include "core/base/limits.h"
#include "server/answer.h"
#include "server/guard.h"
#include "server/stream.h"

struct pen_api;
struct pen_asset_upload;

/*
 * One request and its answer, as the API sees them; http.c makes and frees it. It lives until it
 * is answered, which every handler does exactly once, at once or later from the loop.
 */
enum pen_method {
	PEN_GET,
	PEN_HEAD,
	PEN_POST,
	PEN_PUT,
	PEN_PATCH,
	PEN_DELETE,
	PEN_OPTIONS,
	PEN_METHOD_OTHER
};

/* Why a request may not go on; see server/gate.h. */
enum pen_gate {
	PEN_GATE_OPEN,
	PEN_GATE_NO_HOST,
	PEN_GATE_WRONG_HOST,
	PEN_GATE_FOREIGN,
	PEN_GATE_NO_TOKEN,
	PEN_GATE_WRONG_TOKEN,
	PEN_GATE_NO_SCOPE
};

struct pen_exchange {
	struct pen_api
		*api; /* NULL when the service has gone: then only the answer is left to do */
	enum pen_method method;
	const char *path;		 /* percent-decoded, without the query */
	char id[PEN_REQUEST_ID_MAX + 1]; /* the client's, or one that no other has */
	struct pen_buf body;
	struct pen_asset_upload *upload; /* what takes the body instead of body, or NULL */
	bool ignores_body;		 /* nothing takes it */
	enum pen_gate gate;
	bool is_local;	/* came in by a socket in the file system, */
	bool is_owner;	/* from a process of our user, or of root */
	unsigned needs; /* scope of what is asked for, once a token was */
	struct pen_caller caller;
};

/* A field of the request or a parameter of its query; NULL without one. Before the answer only. */
const char *pen_exchange_field(const struct pen_exchange *exchange, const char *name);
const char *pen_exchange_query(const struct pen_exchange *exchange, const char *name);

/* Calls take for each parameter of the query; one without a value has "". Before the answer only.
 */
void pen_exchange_each_query(const struct pen_exchange *exchange,
	void (*take)(void *user, const char *name, const char *value), void *user);

/* Sends the answer, whose body passes to it; the exchange must not be used any more. */
void pen_exchange_answer(struct pen_exchange *exchange, struct pen_answer *answer);

/*
 * Sends the answer, which has no body, with that of a stream; only before the handler returns. The
 * source is finished in any case.
 */
void pen_exchange_stream(struct pen_exchange *exchange, const struct pen_answer *answer,
	const struct pen_stream_source *source);

/* Answers with a problem. */
void pen_exchange_problem(struct pen_exchange *exchange, unsigned status, const char *detail);
void pen_exchange_error(struct pen_exchange *exchange, const struct pen_error *err);

#endif
