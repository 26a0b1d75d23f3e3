/* SPDX-License-Identifier: Apache-2.0 */
#include "server/token.h"

#include "core/base/buf.h"
#include "server/key_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

static const struct {
	enum pen_scope scope;
	const char *name;
} scope_names[] = {
	{PEN_SCOPE_SUBMIT, "submit"},
	{PEN_SCOPE_READ, "read"},
	{PEN_SCOPE_ADMIN, "admin"},
	{PEN_SCOPE_METRICS, "metrics"},
};

enum { SCOPES = sizeof scope_names / sizeof scope_names[0], SECRET_BYTES = 32 };

static const char secret_prefix[] = "pnb_";

static unsigned scope_of(const char *name, size_t length)
{
	for (size_t i = 0; i < SCOPES; i++)
		if (strlen(scope_names[i].name) == length &&
			memcmp(scope_names[i].name, name, length) == 0)
			return scope_names[i].scope;
	return PEN_SCOPE_NONE;
}

int pen_scopes_parse(const char *text, unsigned *ret_scopes, struct pen_error *err)
{
	unsigned scopes = 0;

	for (;;) {
		size_t length = strcspn(text, ",");
		unsigned scope = scope_of(text, length);

		if (scope == PEN_SCOPE_NONE)
			return pen_error_set(err, PEN_EINVALID,
				"scopes are submit, read, admin and metrics, with commas between");
		scopes |= scope;
		if (text[length] == '\0')
			break;
		text += length + 1;
	}
	*ret_scopes = scopes & PEN_SCOPE_ADMIN ? PEN_SCOPE_ALL : scopes;
	return 0;
}

void pen_scopes_format(unsigned scopes, char *ret_text)
{
	size_t used = 0;

	if (scopes & PEN_SCOPE_ADMIN)
		scopes = PEN_SCOPE_ADMIN;
	ret_text[0] = '\0';
	for (size_t i = 0; i < SCOPES; i++)
		if (scopes & scope_names[i].scope)
			used += (size_t)snprintf(ret_text + used, PEN_SCOPES_TEXT - used, "%s%s",
				used > 0 ? "," : "", scope_names[i].name);
}

static struct pen_token *find_name(const struct pen_tokens *tokens, const char *name)
{
	for (size_t i = 0; i < tokens->count; i++)
		if (strcmp(tokens->list[i].name, name) == 0)
			return &tokens->list[i];
	return NULL;
}

static int append(struct pen_tokens *tokens, const char *name, unsigned scopes,
	const struct pen_sha256 *hash, struct pen_error *err)
{
	struct pen_token *list, token = {.scopes = scopes, .hash = *hash};

	if (!pen_key_name_valid(name))
		return pen_error_set(err, PEN_EINVALID,
			"a name has 1 to %u letters, digits, dots, dashes and underscores",
			PEN_KEY_NAME_MAX);
	if (find_name(tokens, name))
		return pen_error_set(err, PEN_ECONFLICT, "there is a token %s already", name);
	if (tokens->count == PEN_TOKENS_MAX)
		return pen_error_set(
			err, PEN_ELIMIT, "there are %u tokens: remove some", PEN_TOKENS_MAX);
	list = realloc(tokens->list, (tokens->count + 1) * sizeof *list);
	if (!list)
		return pen_error_memory(err);
	(void)snprintf(token.name, sizeof token.name, "%s", name);
	list[tokens->count++] = token;
	tokens->list = list;
	return 0;
}

static int take_line(void *user, char *words[PEN_KEY_WORDS_MAX], struct pen_error *err)
{
	struct pen_sha256 hash;
	unsigned scopes = 0;
	int r = pen_scopes_parse(words[1], &scopes, err);

	if (r == 0 &&
		(strlen(words[2]) != PEN_SHA256_TEXT - 1 || !pen_sha256_parse(words[2], &hash)))
		r = pen_error_set(err, PEN_EINVALID, "a line is NAME SCOPES SHA-256");
	return r == 0 ? append(user, words[0], scopes, &hash, err) : r;
}

int pen_tokens_load(struct pen_tokens *tokens, const char *path, struct pen_error *err)
{
	struct pen_tokens loaded = {0};
	int r = pen_key_file_read(path, take_line, &loaded, err);

	if (r < 0 && r != PEN_ENOTFOUND) {
		pen_tokens_finish(&loaded);
		return r;
	}
	pen_tokens_finish(tokens);
	*tokens = loaded;
	return 0;
}

int pen_tokens_save(const struct pen_tokens *tokens, const char *path, struct pen_error *err)
{
	char scopes[PEN_SCOPES_TEXT], hash[PEN_SHA256_TEXT];
	struct pen_buf text;
	int r;

	pen_buf_init(&text, PEN_KEY_FILE_MAX);
	for (size_t i = 0; i < tokens->count; i++) {
		pen_scopes_format(tokens->list[i].scopes, scopes);
		pen_sha256_format(&tokens->list[i].hash, hash);
		(void)pen_buf_printf(&text, "%s %s %s\n", tokens->list[i].name, scopes, hash);
	}
	r = text.failed ? pen_error_memory(err)
			: pen_key_file_write(path, text.data ? text.data : "", text.size, err);
	pen_buf_finish(&text);
	return r;
}

void pen_tokens_finish(struct pen_tokens *tokens)
{
	free(tokens->list);
	*tokens = (struct pen_tokens){0};
}

/* RFC 4648 base64url without padding; the last digit holds four bits. */
static void format_secret(const uint8_t *bits, char *ret_secret)
{
	static const char digits[] =
		"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
	char *out = ret_secret + strlen(secret_prefix);

	/* The digits follow. NOLINTNEXTLINE(bugprone-not-null-terminated-result) */
	memcpy(ret_secret, secret_prefix, strlen(secret_prefix));
	for (size_t bit = 0; bit < SECRET_BYTES * 8; bit += 6) {
		unsigned pair = (unsigned)bits[bit / 8] << 8;

		if (bit / 8 + 1 < SECRET_BYTES)
			pair |= bits[bit / 8 + 1];
		*out++ = digits[pair >> (10 - bit % 8) & 63];
	}
	*out = '\0';
}

int pen_tokens_add(struct pen_tokens *tokens, const char *name, unsigned scopes, char *ret_secret,
	struct pen_error *err)
{
	char secret[PEN_TOKEN_TEXT];
	uint8_t bits[SECRET_BYTES];
	struct pen_sha256 hash;
	int r;

	if (getrandom(bits, sizeof bits, 0) != sizeof bits)
		return pen_error_system(err, errno, "no random bits");
	format_secret(bits, secret);
	r = pen_sha256_of(secret, strlen(secret), &hash, err);
	if (r == 0)
		r = append(tokens, name, scopes, &hash, err);
	if (r == 0)
		memcpy(ret_secret, secret, sizeof secret);
	explicit_bzero(bits, sizeof bits);
	explicit_bzero(secret, sizeof secret);
	return r;
}

int pen_tokens_remove(struct pen_tokens *tokens, const char *name, struct pen_error *err)
{
	struct pen_token *token = find_name(tokens, name);

	if (!token)
		return pen_error_set(err, PEN_ENOTFOUND, "there is no token %s", name);
	tokens->count--;
	memmove(token, token + 1, (size_t)(tokens->list + tokens->count - token) * sizeof *token);
	return 0;
}

static bool equal_in_constant_time(const struct pen_sha256 *a, const struct pen_sha256 *b)
{
	volatile uint8_t difference = 0;

	for (size_t i = 0; i < sizeof a->bytes; i++)
		difference = difference | (uint8_t)(a->bytes[i] ^ b->bytes[i]);
	return difference == 0;
}

const struct pen_token *pen_tokens_find(const struct pen_tokens *tokens, const char *secret)
{
	const struct pen_token *found = NULL;
	size_t length = strnlen(secret, PEN_TOKEN_TEXT);
	struct pen_sha256 hash;

	if (length != PEN_TOKEN_TEXT - 1 || pen_sha256_of(secret, length, &hash, NULL) < 0)
		return NULL;
	for (size_t i = 0; i < tokens->count; i++)
		if (equal_in_constant_time(&tokens->list[i].hash, &hash))
			found = &tokens->list[i];
	return found;
}
