/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/json.h"

#include "core/base/limits.h"

#include <ctype.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* The scan before the tree. It returns what is wrong at text[at], or NULL. */
struct scan {
	const char *text;
	size_t size, at;
	size_t nodes, depth;
	char closers[PEN_SCENE_DEPTH_MAX]; /* what ends each open object or array */
	bool long_integers;		   /* there may be integers beyond 64 bits */
};

/* NUL, which JSON has no use for, stands for the end. */
static char peek(const struct scan *s)
{
	return s->at < s->size ? s->text[s->at] : '\0';
}

static char peek_token(struct scan *s)
{
	while (s->at < s->size && strchr(" \t\n\r", s->text[s->at]) && s->text[s->at])
		s->at++;
	return peek(s);
}

static int hex_value(char c)
{
	if (c >= '0' && c <= '9')
		return c - '0';
	c = (char)(c | 0x20);
	return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* The four digits behind \u; -1 when they are not four. */
static int scan_hex(struct scan *s)
{
	int code = 0;

	for (size_t i = 0; i < 4; i++) {
		int digit = hex_value(peek(s));

		if (digit < 0)
			return -1;
		code = code * 16 + digit;
		s->at++;
	}
	return code;
}

/* What follows a backslash. */
static const char *scan_escape(struct scan *s)
{
	char c = peek(s);
	int code;

	if (c == '\0' || !strchr("\"\\/bfnrtu", c))
		return "not an escape sequence";
	s->at++;
	if (c != 'u')
		return NULL;
	code = scan_hex(s);
	if (code < 0)
		return "expected four hexadecimal digits";
	if (code == 0)
		return "NUL characters are not accepted";
	if (code >= 0xDC00 && code <= 0xDFFF)
		return "lone surrogate";
	if (code < 0xD800 || code > 0xDBFF)
		return NULL;
	if (s->size - s->at < 6 || s->text[s->at] != '\\' || s->text[s->at + 1] != 'u')
		return "lone surrogate";
	s->at += 2;
	code = scan_hex(s);
	return code < 0xDC00 || code > 0xDFFF ? "lone surrogate" : NULL;
}

/* One character of two to four bytes, as Unicode's table of well-formed UTF-8 has it (D92). */
static const char *scan_utf8(struct scan *s)
{
	const unsigned char *c = (const unsigned char *)s->text + s->at;
	size_t left = s->size - s->at, length = c[0] < 0xE0 ? 2 : c[0] < 0xF0 ? 3 : 4;
	unsigned char low = 0x80, high = 0xBF;

	if (c[0] < 0xC2 || c[0] > 0xF4 || left < length)
		return "not UTF-8";
	if (c[0] == 0xE0)
		low = 0xA0;
	else if (c[0] == 0xED)
		high = 0x9F;
	else if (c[0] == 0xF0)
		low = 0x90;
	else if (c[0] == 0xF4)
		high = 0x8F;
	if (c[1] < low || c[1] > high)
		return "not UTF-8";
	for (size_t i = 2; i < length; i++)
		if ((c[i] & 0xC0) != 0x80)
			return "not UTF-8";
	s->at += length;
	return NULL;
}

static const char *scan_string(struct scan *s)
{
	size_t start = ++s->at;
	const char *wrong = NULL;

	while (!wrong && s->at < s->size && s->text[s->at] != '"') {
		unsigned char c = (unsigned char)s->text[s->at];

		if (s->at - start >= PEN_SCENE_STRING_MAX)
			return "string too long";
		if (c < 0x20)
			return "control character in a string";
		if (c >= 0x80) {
			wrong = scan_utf8(s);
			continue;
		}
		s->at++;
		if (c == '\\')
			wrong = scan_escape(s);
	}
	if (wrong)
		return wrong;
	if (s->at == s->size)
		return "the text ends within a string";
	if (s->at - start > PEN_SCENE_STRING_MAX)
		return "string too long";
	s->at++;
	return NULL;
}

static size_t scan_digits(struct scan *s)
{
	size_t start = s->at;

	while (isdigit((unsigned char)peek(s)))
		s->at++;
	return s->at - start;
}

/* Digits there must be at least one of. */
static const char *scan_some_digits(struct scan *s)
{
	return scan_digits(s) > 0 ? NULL : "expected a digit";
}

/* A fraction and an exponent, either of which may be missing. */
static const char *scan_decimals(struct scan *s, bool *ret_exponent)
{
	const char *wrong = NULL;

	if (peek(s) == '.') {
		s->at++;
		wrong = scan_some_digits(s);
	}
	*ret_exponent = !wrong && (peek(s) == 'e' || peek(s) == 'E');
	if (*ret_exponent) {
		s->at++;
		if (peek(s) == '+' || peek(s) == '-')
			s->at++;
		wrong = scan_some_digits(s);
	}
	return wrong;
}

static const char *scan_number(struct scan *s)
{
	size_t start = s->at, digits;
	const char *wrong;
	bool zero, exponent;

	if (peek(s) == '-')
		s->at++;
	zero = peek(s) == '0';
	digits = scan_digits(s);
	if (digits == 0)
		return "expected a value";
	if (zero && digits > 1)
		return "numbers do not begin with 0";
	wrong = scan_decimals(s, &exponent);
	if (wrong)
		return wrong;
	if (s->at - start > PEN_SCENE_STRING_MAX)
		return "number too long";
	s->long_integers |= digits > 18;

	/* strtod stops at the byte behind the number, which is there but in a broken text. */
	if ((exponent || digits > 300) && s->at < s->size && isinf(strtod(s->text + start, NULL))) {
		s->at = start;
		return "number beyond the range of a double";
	}
	return NULL;
}

static const char *scan_literal(struct scan *s)
{
	static const char *const literals[] = {"true", "false", "null"};

	for (size_t i = 0; i < 3; i++) {
		size_t length = strlen(literals[i]);

		if (s->size - s->at >= length &&
			memcmp(s->text + s->at, literals[i], length) == 0) {
			s->at += length;
			return NULL;
		}
	}
	return s->at == s->size ? "the text ends too early" : "expected a value";
}

static const char *scan_key(struct scan *s)
{
	const char *wrong;

	if (peek_token(s) != '"')
		return s->at == s->size ? "the text ends too early" : "expected a key in quotes";
	wrong = scan_string(s);
	if (wrong)
		return wrong;
	if (peek_token(s) != ':')
		return s->at == s->size ? "the text ends too early" : "expected a colon";
	s->at++;
	return NULL;
}

/* A scalar whole; of an object or array the beginning. Sets *ret_open when a value must follow. */
static const char *scan_value(struct scan *s, bool *ret_open)
{
	char c = peek_token(s);

	*ret_open = false;
	if (++s->nodes > PEN_SCENE_NODES_MAX)
		return "too many values";
	if (c == '"')
		return scan_string(s);
	if (c == '-' || isdigit((unsigned char)c))
		return scan_number(s);
	if (c != '{' && c != '[')
		return scan_literal(s);
	if (s->depth == PEN_SCENE_DEPTH_MAX)
		return "nested too deeply";
	s->at++;
	s->closers[s->depth++] = c == '{' ? '}' : ']';
	if (peek_token(s) == s->closers[s->depth - 1])
		return NULL;
	*ret_open = true;
	return c == '{' ? scan_key(s) : NULL;
}

/* What stands behind a value: closing brackets, then a comma or the end. */
static const char *scan_behind(struct scan *s)
{
	while (s->depth > 0 && peek_token(s) == s->closers[s->depth - 1]) {
		s->at++;
		s->depth--;
	}
	if (s->depth == 0)
		return NULL;
	if (peek_token(s) != ',')
		return s->at == s->size ? "the text ends too early"
					: "expected a comma or a closing bracket";
	s->at++;
	return s->closers[s->depth - 1] == '}' ? scan_key(s) : NULL;
}

static const char *scan_text(struct scan *s)
{
	const char *wrong = NULL;
	bool open;

	if (peek_token(s) != '{' && peek(s) != '[')
		return "expected an object or an array";
	do {
		wrong = scan_value(s, &open);
		if (!wrong && !open)
			wrong = scan_behind(s);
	} while (!wrong && s->depth > 0);
	if (!wrong && (peek_token(s) != '\0' || s->at < s->size))
		wrong = "expected the end of the text";
	return wrong;
}

static int refuse(const char *text, size_t offset, const char *wrong, struct pen_error *err)
{
	size_t line = 1, column = 1;

	for (size_t i = 0; i < offset; i++) {
		if (text[i] == '\n') {
			line++;
			column = 1;
		} else if (((unsigned char)text[i] & 0xC0) != 0x80) {
			column++;
		}
	}
	return pen_error_set(err, PEN_EINVALID, "not JSON: line %zu, column %zu, byte %zu: %s",
		line, column, offset, wrong);
}

int pen_json_parse(const char *text, size_t size, json_t **ret_tree, struct pen_error *err)
{
	struct scan scan = {.text = text, .size = size};
	json_error_t error;
	const char *wrong;
	json_t *tree;
	size_t flags = JSON_REJECT_DUPLICATES;

	if (size > PEN_SCENE_BYTES_MAX)
		return pen_error_set(err, PEN_ELIMIT, "the text has %zu bytes, more than %u", size,
			PEN_SCENE_BYTES_MAX);
	wrong = scan_text(&scan);
	if (wrong)
		return refuse(text, scan.at, wrong, err);
	if (scan.long_integers)
		flags |= JSON_DECODE_INT_AS_REAL;
	tree = json_loadb(text, size, flags, &error);
	/* Where memory lacked for a moment jansson may say that the text is not JSON. */
	if (!tree && json_error_code(&error) == json_error_invalid_syntax)
		tree = json_loadb(text, size, flags, &error);
	if (tree) {
		*ret_tree = tree;
		return 0;
	}
	if (json_error_code(&error) == json_error_out_of_memory || error.text[0] == '\0')
		return pen_error_memory(err);
	return refuse(text, (size_t)error.position,
		json_error_code(&error) == json_error_duplicate_key ? "duplicate key"
								    : "not accepted",
		err);
}
