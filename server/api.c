/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api.h"

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
#include "server/fields.h"

#include <stdio.h>
#include <string.h>

typedef void handler_fn(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
typedef bool admit_fn(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

/* HEAD goes where GET goes. */
static const struct route {
	const char *pattern;
	enum pen_method method;
	handler_fn *handler;
} routes[] = {
	{"/v1/renders/{id}", PEN_GET, pen_api_render_get},
	{"/v1/renders/{id}", PEN_PATCH, pen_api_render_patch},
	{"/v1/renders/{id}", PEN_DELETE, pen_api_render_delete},
	{"/v1/renders/{id}/scene", PEN_GET, pen_api_render_scene},
	{"/v1/renders/{id}/events", PEN_GET, pen_api_events},
	{"/v1/renders/{id}/image", PEN_GET, pen_api_image_get},
	{"/v1/renders/{id}/image.{extension}", PEN_GET, pen_api_image_get},
	{"/v1/renders/{id}/frames/{number}", PEN_GET, pen_api_image_get},
	{"/v1/renders/{id}/frames/{number}.{extension}", PEN_GET, pen_api_image_get},
	{"/v1/renders/{id}/iiif", PEN_GET, pen_api_iiif_base},
	{"/v1/renders/{id}/iiif/info.json", PEN_GET, pen_api_iiif_info},
	{"/v1/renders/{id}/iiif/{region}/{size}/{turn}/{quality}.{extension}", PEN_GET,
		pen_api_iiif_image},
	{"/v1/renders", PEN_GET, pen_api_render_list},
	{"/v1/renders", PEN_POST, pen_api_submit},
	{"/v1/assets/sha256/{hash}", PEN_GET, pen_api_asset_get},
	{"/v1/assets/sha256/{hash}", PEN_PUT, pen_api_asset_put},
	{"/v1/assets/missing", PEN_POST, pen_api_assets_missing},
	{"/v1/scenes/sha256/{hash}", PEN_GET, pen_api_scene_get},
	{"/v1/scenes/sha256/{hash}", PEN_PUT, pen_api_scene_put},
	{"/v1/workers", PEN_GET, pen_api_workers},
	{"/v1/workers/{id}/drain", PEN_POST, pen_api_worker_drain},
	{"/v1/workers/{id}/reset", PEN_POST, pen_api_worker_reset},
	{"/v1/farm", PEN_GET, pen_api_farm},
	{"/metrics", PEN_GET, pen_api_metrics},
	{"/livez", PEN_GET, pen_api_livez},
	{"/readyz", PEN_GET, pen_api_readyz},
	{"/openapi.json", PEN_GET, pen_api_openapi},
	{"/scene.schema.json", PEN_GET, pen_api_scene_schema},
	{"/", PEN_GET, pen_api_page},
	{"/web/{page}", PEN_GET, pen_api_page},
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

/*
 * Takes the piece of path that stands for {…}, told by its first letter; false when it is empty or
 * too long.
 */
static bool capture(char letter, const char **path, struct pen_api_parameters *found)
{
	const struct {
		char letter;
		char *text;
		size_t size;
	} places[] = {
		{'i', found->id, sizeof found->id},
		{'h', found->hash, sizeof found->hash},
		{'n', found->frame, sizeof found->frame},
		{'e', found->extension, sizeof found->extension},
		{'p', found->page, sizeof found->page},
		{'r', found->region, sizeof found->region},
		{'s', found->size, sizeof found->size},
		{'t', found->turn, sizeof found->turn},
		{'q', found->quality, sizeof found->quality},
	};
	/* Of these some have a point in them, and a page may be in a folder. */
	const char *ends = letter == 'p' ? "" : strchr("rst", letter) ? "/" : "/.";
	size_t length = strcspn(*path, ends), i = 0;

	while (places[i].letter != letter)
		i++;
	if (length == 0 || length >= places[i].size)
		return false;
	memcpy(places[i].text, *path, length);
	places[i].text[length] = '\0';
	*path += length;
	return true;
}

static bool match(const char *pattern, const char *path, struct pen_api_parameters *ret_parameters)
{
	struct pen_api_parameters *found = ret_parameters;

	*found = (struct pen_api_parameters){.id = ""};
	while (*pattern) {
		if (*pattern != '{') {
			if (*pattern++ != *path++)
				return false;
			continue;
		}
		if (!capture(pattern[1], &path, found))
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
	struct pen_api_parameters parameters;
	struct pen_answer answer;
	char allow[64] = "";
	size_t used = 0;

	for (size_t i = 0; i < ROUTES; i++) {
		if (match(routes[i].pattern, exchange->path, &parameters))
			used += (size_t)snprintf(allow + used, sizeof allow - used, "%s%s",
				used > 0 ? ", " : "", method_name(routes[i].method));
	}
	if (exchange->method == PEN_OPTIONS)
		pen_answer_init(&answer, 204);
	else
		pen_answer_problem(&answer, 405, "this resource has no such method: see Allow");
	pen_answer_field(&answer, "Allow", "%s, OPTIONS", allow);
	pen_exchange_answer(exchange, &answer);
}

/* Another site's page may resolve its own name to this machine; its requests tell that name. */
static bool host_refused(struct pen_exchange *exchange)
{
	const char *host = pen_exchange_field(exchange, "Host");

	if (pen_field_host_is_local(host))
		return false;
	pen_exchange_problem(exchange, host ? 421 : 400,
		host ? "this service does not answer for that host name"
		     : "the request has no Host field");
	return true;
}

/* A page of another site may post here without being asked, but the browser tells its origin. */
static bool origin_refused(struct pen_exchange *exchange)
{
	const char *origin = pen_exchange_field(exchange, "Origin");
	const char *host = origin ? strstr(origin, "://") : NULL;

	if (!origin || exchange->method == PEN_GET || exchange->method == PEN_HEAD ||
		(host && pen_field_host_is_local(host + strlen("://"))))
		return false;
	pen_exchange_problem(exchange, 403, "pages of other sites may not change anything here");
	return true;
}

bool pen_api_admit(struct pen_exchange *exchange)
{
	struct pen_api_parameters parameters;

	for (size_t i = 0; i < ADMISSIONS; i++)
		if (admissions[i].method == exchange->method &&
			match(admissions[i].pattern, exchange->path, &parameters))
			return !host_refused(exchange) && !origin_refused(exchange) &&
			       admissions[i].admit(exchange, &parameters);
	return true;
}

void pen_api_handle(struct pen_exchange *exchange)
{
	enum pen_method method = exchange->method == PEN_HEAD ? PEN_GET : exchange->method;
	struct pen_api_parameters parameters;
	bool known = false;

	if (host_refused(exchange) || origin_refused(exchange))
		return;
	for (size_t i = 0; i < ROUTES; i++) {
		if (!match(routes[i].pattern, exchange->path, &parameters))
			continue;
		if (routes[i].method == method) {
			routes[i].handler(exchange, &parameters);
			return;
		}
		known = true;
	}
	if (known)
		answer_methods(exchange);
	else
		pen_exchange_problem(exchange, 404, "there is nothing at this path");
}

struct pen_job *pen_api_find_job(struct pen_exchange *exchange, const char *id)
{
	bool removed = false;
	struct pen_job *job = pen_jobs_find(exchange->api->jobs, id, &removed);

	if (!job)
		pen_exchange_problem(exchange, removed ? 410 : 404,
			removed ? "this render was removed" : "there is no such render");
	return job;
}
