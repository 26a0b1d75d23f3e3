/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_TOKEN_H
#define PEN_SERVER_TOKEN_H

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/limits.h"

#include <stddef.h>

/*
 * What clients show to be let in: names with scopes, and of each secret its SHA-256 alone. A
 * secret has 256 random bits, so that a hash without salt or slowness is enough.
 */
enum pen_scope {
	PEN_SCOPE_NONE = 0, /* open to everybody */
	PEN_SCOPE_SUBMIT = 1,
	PEN_SCOPE_READ = 2,
	PEN_SCOPE_METRICS = 4,
	PEN_SCOPE_ADMIN = 8, /* all of the others too */
	PEN_SCOPE_ALL = 15
};

enum {
	PEN_TOKEN_TEXT = 48, /* "pnb_", 43 digits of base64url and a NUL */
	PEN_SCOPES_TEXT = 64
};

struct pen_token {
	char name[PEN_KEY_NAME_MAX + 1];
	unsigned scopes; /* of enum pen_scope; with PEN_SCOPE_ADMIN, all */
	struct pen_sha256 hash;
};

/* All of a file; zeroed, there are none. */
struct pen_tokens {
	struct pen_token *list;
	size_t count;
};

/* "submit,read"; PEN_EINVALID names those that there are. */
int pen_scopes_parse(const char *text, unsigned *ret_scopes, struct pen_error *err);

/* ret_text holds PEN_SCOPES_TEXT characters. */
void pen_scopes_format(unsigned scopes, char *ret_text);

/* Of a file that is not there, none. As pen_key_file_read; tokens stay as they are on failure. */
int pen_tokens_load(struct pen_tokens *tokens, const char *path, struct pen_error *err);
int pen_tokens_save(const struct pen_tokens *tokens, const char *path, struct pen_error *err);
void pen_tokens_finish(struct pen_tokens *tokens);

/*
 * A new token, whose secret is told here and nowhere else; ret_secret holds PEN_TOKEN_TEXT
 * characters. PEN_ECONFLICT: there is one of that name. PEN_ELIMIT: there are PEN_TOKENS_MAX.
 */
int pen_tokens_add(struct pen_tokens *tokens, const char *name, unsigned scopes, char *ret_secret,
	struct pen_error *err);

/* PEN_ENOTFOUND. */
int pen_tokens_remove(struct pen_tokens *tokens, const char *name, struct pen_error *err);

/* Whose secret it is, in time that does not depend on which; NULL: nobody's. */
const struct pen_token *pen_tokens_find(const struct pen_tokens *tokens, const char *secret);

#endif
