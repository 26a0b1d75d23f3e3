/* SPDX-License-Identifier: Apache-2.0 */
#include "server/gate.h"

#include "server/api.h"
#include "server/fields.h"
#include "server/token.h"

#include <string.h>

static bool is_our_name(const struct pen_exchange *exchange, const char *host)
{
	const struct pen_guard *guard = exchange->api->guard;

	return pen_field_host_is_local(host) || (guard && pen_guard_has_name(guard, host));
}

/* A page of another site may post here without being asked, but the browser tells its origin. */
static bool is_foreign(const struct pen_exchange *exchange)
{
	const char *origin, *host;

	if (exchange->method == PEN_GET || exchange->method == PEN_HEAD)
		return false;
	origin = pen_exchange_field(exchange, "Origin");
	host = origin ? strstr(origin, "://") : NULL;
	return origin && !(host && is_our_name(exchange, host + strlen("://")));
}

bool pen_gate_asks_for_token(const struct pen_exchange *exchange)
{
	const struct pen_guard *guard = exchange->api->guard;

	return exchange->is_local ? !exchange->is_owner : guard && pen_guard_is_closed(guard);
}

static enum pen_gate check_caller(struct pen_exchange *exchange, unsigned scope)
{
	const struct pen_guard *guard = exchange->api->guard;
	const char *authorization;

	exchange->caller = (struct pen_caller){.scopes = PEN_SCOPE_ALL};
	if (!pen_gate_asks_for_token(exchange))
		return PEN_GATE_OPEN;
	exchange->caller.scopes = PEN_SCOPE_NONE;
	if (scope == PEN_SCOPE_NONE)
		return PEN_GATE_OPEN;
	authorization = pen_exchange_field(exchange, "Authorization");
	if (!authorization)
		return PEN_GATE_NO_TOKEN;
	if (!guard || !pen_guard_knows(guard, authorization, &exchange->caller))
		return PEN_GATE_WRONG_TOKEN;
	exchange->needs = scope;
	return (exchange->caller.scopes & scope) != 0 ? PEN_GATE_OPEN : PEN_GATE_NO_SCOPE;
}

enum pen_gate pen_gate_check(struct pen_exchange *exchange, unsigned scope)
{
	const char *host = pen_exchange_field(exchange, "Host");

	/* Another site's page may resolve its own name to this machine; its requests tell that
	 * name. No page reaches a socket in the file system. */
	if (!host)
		return PEN_GATE_NO_HOST;
	if (!exchange->is_local && !is_our_name(exchange, host))
		return PEN_GATE_WRONG_HOST;
	if (!exchange->is_local && is_foreign(exchange))
		return PEN_GATE_FOREIGN;
	return check_caller(exchange, scope);
}

void pen_gate_refuse(struct pen_exchange *exchange)
{
	static const struct {
		unsigned status;
		const char *detail, *challenge;
	} refusals[] = {
		[PEN_GATE_NO_HOST] = {400, "the request has no Host field", NULL},
		[PEN_GATE_WRONG_HOST] = {421, "this service does not answer for that host name",
			NULL},
		[PEN_GATE_FOREIGN] = {403, "pages of other sites may not change anything here",
			NULL},
		[PEN_GATE_NO_TOKEN] = {401,
			"a token is needed: Authorization: Bearer, and what penumbra token add "
			"printed",
			"Bearer realm=\"penumbra\""},
		[PEN_GATE_WRONG_TOKEN] = {401, "the token is not one of this service's",
			"Bearer realm=\"penumbra\", error=\"invalid_token\""},
		[PEN_GATE_NO_SCOPE] = {403, "the token's scopes do not allow this", ""},
	};
	struct pen_answer answer;
	char scopes[PEN_SCOPES_TEXT];

	pen_answer_problem(
		&answer, refusals[exchange->gate].status, refusals[exchange->gate].detail);
	pen_scopes_format(exchange->needs, scopes);
	if (exchange->gate == PEN_GATE_NO_SCOPE)
		pen_answer_field_of(&answer, "WWW-Authenticate",
			"Bearer realm=\"penumbra\", error=\"insufficient_scope\", scope=\"%s\"",
			scopes);
	else if (refusals[exchange->gate].challenge)
		pen_answer_field(&answer, "WWW-Authenticate", refusals[exchange->gate].challenge);
	pen_exchange_answer(exchange, &answer);
}
