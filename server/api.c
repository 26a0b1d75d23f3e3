/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api.h"

#include "core/base/clock.h"
#include "server/api_asset.h"
#include "server/api_document.h"
#include "server/api_events.h"
#include "server/api_farm.h"
#include "server/api_iiif.h"
#include "server/api_image.h"
#include "server/api_page.h"
#include "server/api_render.h"
#include "server/api_scene.h"
#include "server/api_submit.h"
#include "server/gate.h"
#include "server/token.h"

#include <stdio.h>
#include <string.h>

typedef void handler_fn(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
typedef bool admit_fn(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

/* What is asked for most comes first. HEAD goes where GET goes. */
static const struct route {
	const char *pattern;
	enum pen_method method;
	handler_fn *handler;
	enum pen_scope scope; /* PEN_SCOPE_NONE: for everybody */
} routes[] = {
	{"/v1/renders/{id}", PEN_GET, pen_api_render_get, PEN_SCOPE_READ},
	{"/v1/renders/{id}/image.{extension}", PEN_GET, pen_api_image_get, PEN_SCOPE_READ},
	{"/v1/renders/{id}", PEN_PATCH, pen_api_render_patch, PEN_SCOPE_SUBMIT},
	{"/v1/renders/{id}", PEN_DELETE, pen_api_render_delete, PEN_SCOPE_SUBMIT},
	{"/v1/renders/{id}/scene", PEN_GET, pen_api_render_scene, PEN_SCOPE_READ},
	{"/v1/renders/{id}/events", PEN_GET, pen_api_events, PEN_SCOPE_READ},
	{"/v1/renders/{id}/image", PEN_GET, pen_api_image_get, PEN_SCOPE_READ},
	{"/v1/renders/{id}/frames/{number}", PEN_GET, pen_api_image_get, PEN_SCOPE_READ},
	{"/v1/renders/{id}/frames/{number}.{extension}", PEN_GET, pen_api_image_get,
		PEN_SCOPE_READ},
	{"/v1/renders/{id}/iiif", PEN_GET, pen_api_iiif_base, PEN_SCOPE_READ},
	{"/v1/renders/{id}/iiif/info.json", PEN_GET, pen_api_iiif_info, PEN_SCOPE_READ},
	{"/v1/renders/{id}/iiif/{region}/{size}/{turn}/{quality}.{extension}", PEN_GET,
		pen_api_iiif_image, PEN_SCOPE_READ},
	{"/v1/renders", PEN_GET, pen_api_render_list, PEN_SCOPE_READ},
	{"/v1/renders", PEN_POST, pen_api_submit, PEN_SCOPE_SUBMIT},
	{"/v1/assets/sha256/{hash}", PEN_GET, pen_api_asset_get, PEN_SCOPE_READ},
	{"/v1/assets/sha256/{hash}", PEN_PUT, pen_api_asset_put, PEN_SCOPE_SUBMIT},
	{"/v1/assets/missing", PEN_POST, pen_api_assets_missing, PEN_SCOPE_SUBMIT},
	{"/v1/scenes/sha256/{hash}", PEN_GET, pen_api_scene_get, PEN_SCOPE_READ},
	{"/v1/scenes/sha256/{hash}", PEN_PUT, pen_api_scene_put, PEN_SCOPE_SUBMIT},
	{"/v1/workers", PEN_GET, pen_api_workers, PEN_SCOPE_READ},
	{"/v1/workers/{id}/drain", PEN_POST, pen_api_worker_drain, PEN_SCOPE_ADMIN},
	{"/v1/workers/{id}/reset", PEN_POST, pen_api_worker_reset, PEN_SCOPE_ADMIN},
	{"/v1/farm", PEN_GET, pen_api_farm, PEN_SCOPE_READ},
	{"/metrics", PEN_GET, pen_api_metrics, PEN_SCOPE_METRICS},
	{"/livez", PEN_GET, pen_api_livez, PEN_SCOPE_NONE},
	{"/readyz", PEN_GET, pen_api_readyz, PEN_SCOPE_NONE},
	{"/openapi.json", PEN_GET, pen_api_openapi, PEN_SCOPE_NONE},
	{"/scene.schema.json", PEN_GET, pen_api_scene_schema, PEN_SCOPE_NONE},
	{"/", PEN_GET, pen_api_page, PEN_SCOPE_NONE},
	{"/web/{page}", PEN_GET, pen_api_page, PEN_SCOPE_NONE},
};

enum { ROUTES = sizeof routes / sizeof routes[0] };

/* Whose bodies may be too large to be kept in memory. */
static const struct {
	const char *pattern;
	enum pen_method method;
	admit_fn *admit;
} admissions[] = {
	{"/v1/renders", PEN_POST, pen_api_submit_admit},
	{"/v1/assets/sha256/{hash}", PEN_PUT, pen_api_asset_admit},
};

enum { ADMISSIONS = sizeof admissions / sizeof admissions[0] };

/* The pieces of a path that stand for {…}, told by its first letter. */
#define PIECE(letter, member, ends)                                                                \
	{                                                                                          \
		letter, ends, offsetof(struct pen_api_parameters, member),                         \
			sizeof((struct pen_api_parameters *)0)->member                             \
	}
static const struct piece {
	char letter;
	const char *ends; /* some have a point in them, and a page may be in a folder */
	size_t offset, size;
} pieces[] = {
	PIECE('i', id, "/."),
	PIECE('h', hash, "/."),
	PIECE('n', frame, "/."),
	PIECE('e', extension, "/."),
	PIECE('p', page, ""),
	PIECE('r', region, "/"),
	PIECE('s', size, "/"),
	PIECE('t', turn, "/"),
	PIECE('q', quality, "/."),
};
#undef PIECE

static const struct piece *piece_of(char letter)
{
	const struct piece *piece = pieces;

	while (piece->letter != letter)
		piece++;
	return piece;
}

/*
 * Takes what stands for {…} off the path; with ret_parameters NULL only looks whether it may. False
 * when it is empty or too long.
 */
static bool take_piece(char letter, const char **path, struct pen_api_parameters *ret_parameters)
{
	const struct piece *piece = piece_of(letter);
	const size_t length = strcspn(*path, piece->ends);

	if (length == 0 || length >= piece->size)
		return false;
	if (ret_parameters)
		memcpy((char *)ret_parameters + piece->offset, *path, length);
	*path += length;
	return true;
}

/* ret_parameters, all of it 0, is filled in; it may be NULL. */
static bool match(const char *pattern, const char *path, struct pen_api_parameters *ret_parameters)
{
	while (*pattern) {
		if (*pattern != '{') {
			if (*pattern++ != *path++)
				return false;
			continue;
		}
		if (!take_piece(pattern[1], &path, ret_parameters))
			return false;
		pattern = strchr(pattern, '}') + 1;
	}
	return *path == '\0';
}

static const char *method_name(enum pen_method method)
{
	switch (method) {
	case PEN_GET: return "GET, HEAD";
	case PEN_POST: return "POST";
	case PEN_PUT: return "PUT";
	case PEN_PATCH: return "PATCH";
	case PEN_DELETE: return "DELETE";
	default: return "";
	}
}

/* What may be done at a path, for OPTIONS and for those who tried something else. */
static void answer_methods(struct pen_exchange *exchange)
{
	struct pen_answer answer;
	char allow[64] = "";
	size_t used = 0;

	for (size_t i = 0; i < ROUTES; i++) {
		if (match(routes[i].pattern, exchange->path, NULL))
			used += (size_t)snprintf(allow + used, sizeof allow - used, "%s%s",
				used > 0 ? ", " : "", method_name(routes[i].method));
	}
	if (exchange->method == PEN_OPTIONS)
		pen_answer_init(&answer, 204);
	else
		pen_answer_problem(&answer, 405, "this resource has no such method: see Allow");
	pen_answer_field_of(&answer, "Allow", "%s, OPTIONS", allow);
	pen_exchange_answer(exchange, &answer);
}

static const struct route *find_route(const struct pen_exchange *exchange)
{
	enum pen_method method = exchange->method == PEN_HEAD ? PEN_GET : exchange->method;

	for (size_t i = 0; i < ROUTES; i++)
		if (routes[i].method == method && match(routes[i].pattern, exchange->path, NULL))
			return &routes[i];
	return NULL;
}

/* What is not there takes a token of any scope: without one nobody learns what is. */
static unsigned scope_of(const struct pen_exchange *exchange)
{
	struct pen_guard *guard = exchange->api->guard;
	const struct route *route;

	if (guard)
		pen_guard_refresh(guard, pen_clock_ms());
	if (!pen_gate_asks_for_token(exchange))
		return PEN_SCOPE_NONE;
	route = find_route(exchange);
	return route ? route->scope : PEN_SCOPE_ALL;
}

/*
 * Answered before the body is read where libmicrohttpd can do that; else nothing of the body is
 * kept.
 */
static bool is_stopped(struct pen_exchange *exchange)
{
	exchange->gate = pen_gate_check(exchange, scope_of(exchange));
	exchange->ignores_body = exchange->gate != PEN_GATE_OPEN;
	if (exchange->gate == PEN_GATE_OPEN ||
		(exchange->method != PEN_POST && exchange->method != PEN_PUT))
		return false;
	pen_gate_refuse(exchange);
	return true;
}

bool pen_api_admit(struct pen_exchange *exchange)
{
	struct pen_api_parameters parameters = {.id = ""};

	if (is_stopped(exchange))
		return false;
	for (size_t i = 0; i < ADMISSIONS; i++)
		if (admissions[i].method == exchange->method &&
			match(admissions[i].pattern, exchange->path, &parameters))
			return admissions[i].admit(exchange, &parameters);
	return true;
}

static bool is_known(const char *path)
{
	for (size_t i = 0; i < ROUTES; i++)
		if (match(routes[i].pattern, path, NULL))
			return true;
	return false;
}

void pen_api_handle(struct pen_exchange *exchange)
{
	struct pen_api_parameters parameters = {.id = ""};
	const struct route *route;

	if (exchange->gate != PEN_GATE_OPEN) {
		pen_gate_refuse(exchange);
		return;
	}
	route = find_route(exchange);
	if (route) {
		(void)match(route->pattern, exchange->path, &parameters);
		route->handler(exchange, &parameters);
	} else if (is_known(exchange->path))
		answer_methods(exchange);
	else
		pen_exchange_problem(exchange, 404, "there is nothing at this path");
}

bool pen_api_may_see(const struct pen_exchange *exchange, const struct pen_owner *owner)
{
	const struct pen_caller *caller = &exchange->caller;

	return (caller->scopes & PEN_SCOPE_ADMIN) != 0 ||
	       (caller->owner.is_known && pen_owner_equal(&caller->owner, owner));
}

struct pen_job *pen_api_look_for_render(const struct pen_exchange *exchange, const char *id)
{
	struct pen_job *job = pen_jobs_find(exchange->api->jobs, id);

	return job && pen_api_may_see(exchange, &job->owner) ? job : NULL;
}

struct pen_job *pen_api_find_render(struct pen_exchange *exchange, const char *id)
{
	struct pen_job *job = pen_api_look_for_render(exchange, id);
	const struct pen_owner *removed;

	if (job)
		return job;
	removed = pen_jobs_find_removed(exchange->api->jobs, id);
	if (removed && pen_api_may_see(exchange, removed))
		pen_exchange_problem(exchange, 410, "this render was removed");
	else
		pen_exchange_problem(exchange, 404, "there is no such render");
	return NULL;
}
