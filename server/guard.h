/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_GUARD_H
#define PEN_SERVER_GUARD_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "server/owner.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * Who may ask for what: the tokens of a file, which is read again when it has changed, and the
 * names by which this service is known. What is wrong with a changed file is logged, and the
 * tokens stay as they were.
 */
struct pen_guard;

/* Who asks; without tokens it is nobody, who may do all. */
struct pen_caller {
	char name[PEN_KEY_NAME_MAX + 1]; /* "": nobody in particular */
	unsigned scopes;		 /* of enum pen_scope */
	struct pen_owner owner;		 /* of what is asked for */
};

/*
 * The file need not exist. Without tokens everybody may do all, unless is_closed; but once there
 * were some, what is left of them is asked for as long as this runs.
 */
int pen_guard_create(const char *tokens_path, bool is_closed, struct pen_guard **ret_guard,
	struct pen_error *err);
void pen_guard_destroy(struct pen_guard *guard);

/* Looks whether the file has changed, if it is PEN_KEY_AGE_MS since the last time. */
void pen_guard_refresh(struct pen_guard *guard, int64_t now_ms);

/* Whether a token is asked for. */
bool pen_guard_is_closed(const struct pen_guard *guard);

/* How many tokens there are. */
uint32_t pen_guard_tokens(const struct pen_guard *guard);

/* Whose token the field Authorization holds; false: nobody's. */
bool pen_guard_knows(
	const struct pen_guard *guard, const char *authorization, struct pen_caller *ret_caller);

/*
 * A name or address that Host may have beside those of this machine itself; one that begins with
 * "*." has any label for the star. PEN_ELIMIT past PEN_HOST_NAMES_MAX.
 */
int pen_guard_add_name(struct pen_guard *guard, const char *name, struct pen_error *err);

void pen_guard_forget_names(struct pen_guard *guard);

/* Whether host, as in Host, is one of them. */
bool pen_guard_has_name(const struct pen_guard *guard, const char *host);

#endif
