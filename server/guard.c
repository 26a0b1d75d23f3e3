/* SPDX-License-Identifier: Apache-2.0 */
#include "server/guard.h"

#include "core/base/clock.h"
#include "core/base/log.h"
#include "server/fields.h"
#include "server/key_file.h"
#include "server/token.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct pen_guard {
	char path[PATH_MAX];
	struct pen_tokens tokens;
	uint64_t version; /* of the file that they were read from */
	int64_t looked_ms;
	bool is_closed;
	char *names[PEN_HOST_NAMES_MAX];
	uint32_t name_count;
};

static int load(struct pen_guard *guard, struct pen_error *err)
{
	int r;

	/* Looked at before it is read: a change in between is seen the next time. */
	guard->version = pen_key_file_version(guard->path);
	r = pen_tokens_load(&guard->tokens, guard->path, err);
	if (r == 0 && guard->tokens.count > 0)
		guard->is_closed = true;
	return r;
}

int pen_guard_create(const char *tokens_path, bool is_closed, struct pen_guard **ret_guard,
	struct pen_error *err)
{
	struct pen_guard *guard = calloc(1, sizeof *guard);
	int r;

	if (!guard)
		return pen_error_memory(err);
	(void)snprintf(guard->path, sizeof guard->path, "%s", tokens_path);
	guard->is_closed = is_closed;
	guard->looked_ms = pen_clock_ms();
	r = load(guard, err);
	if (r < 0) {
		pen_guard_destroy(guard);
		return r;
	}
	*ret_guard = guard;
	return 0;
}

void pen_guard_destroy(struct pen_guard *guard)
{
	if (!guard)
		return;
	pen_guard_forget_names(guard);
	pen_tokens_finish(&guard->tokens);
	free(guard);
}

void pen_guard_refresh(struct pen_guard *guard, int64_t now_ms)
{
	struct pen_error err = PEN_ERROR_INIT;

	if (now_ms - guard->looked_ms < PEN_KEY_AGE_MS)
		return;
	guard->looked_ms = now_ms;
	if (pen_key_file_version(guard->path) == guard->version)
		return;
	if (load(guard, &err) < 0)
		pen_log(PEN_LOG_ERROR, "the tokens stay as they were: %s", err.text);
	else
		pen_log(PEN_LOG_INFO, "there are %zu tokens now", guard->tokens.count);
}

bool pen_guard_is_closed(const struct pen_guard *guard)
{
	return guard->is_closed;
}

uint32_t pen_guard_tokens(const struct pen_guard *guard)
{
	return (uint32_t)guard->tokens.count;
}

bool pen_guard_knows(
	const struct pen_guard *guard, const char *authorization, struct pen_caller *ret_caller)
{
	static const char scheme[] = "Bearer ";
	const struct pen_token *token = NULL;

	if (authorization && strncasecmp(authorization, scheme, strlen(scheme)) == 0) {
		authorization += strlen(scheme);
		token = pen_tokens_find(&guard->tokens, authorization + strspn(authorization, " "));
	}
	if (!token)
		return false;
	memcpy(ret_caller->name, token->name, sizeof ret_caller->name);
	ret_caller->scopes = token->scopes;
	ret_caller->owner = (struct pen_owner){true, token->hash};
	return true;
}

int pen_guard_add_name(struct pen_guard *guard, const char *name, struct pen_error *err)
{
	char *copy;

	if (guard->name_count == PEN_HOST_NAMES_MAX)
		return pen_error_set(
			err, PEN_ELIMIT, "a service has at most %u names", PEN_HOST_NAMES_MAX);
	copy = strdup(name);
	if (!copy)
		return pen_error_memory(err);
	guard->names[guard->name_count++] = copy;
	return 0;
}

void pen_guard_forget_names(struct pen_guard *guard)
{
	while (guard->name_count > 0)
		free(guard->names[--guard->name_count]);
}

bool pen_guard_has_name(const struct pen_guard *guard, const char *host)
{
	const char *rest = host ? strchr(host, '.') : NULL;

	for (uint32_t i = 0; host && i < guard->name_count; i++) {
		const char *name = guard->names[i];

		if (strncmp(name, "*.", 2) == 0
				? rest && rest > host && pen_field_host_is(rest + 1, name + 2)
				: pen_field_host_is(host, name))
			return true;
	}
	return false;
}
