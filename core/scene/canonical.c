/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/canonical.h"

#include "core/base/limits.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Numbers, as ECMAScript's Number::toString prints them (RFC 8785, section 3.2.2.3). */

/* A number above zero: 0.d1d2d3... * 10^exponent, as few digits as name it and no other. */
struct decimal {
	char digits[24];
	int count, exponent;
};

static void decimal_trim(struct decimal *d)
{
	while (d->count > 1 && d->digits[d->count - 1] == '0')
		d->count--;
}

/*
 * Most numbers of a scene are small multiples of 1e-6. Quotients of integers below 2^53 are rounded
 * correctly, and of decimals of up to 15 digits at most one is nearest to a double: where the
 * quotient is the number, these are its digits.
 */
static bool decimal_from_millionths(struct decimal *d, double number)
{
	double millionths = number < 1e9 ? rint(number * 1e6) : 0;

	if (millionths < 1 || millionths / 1e6 != number)
		return false;
	d->count = snprintf(d->digits, sizeof d->digits, "%lld", (long long)millionths);
	d->exponent = d->count - 6;
	decimal_trim(d);
	return true;
}

/* One more in the last digit; 9...9 does not occur, for 10...0 has fewer digits. */
static void decimal_increment(struct decimal *d)
{
	int i = d->count - 1;

	while (i > 0 && d->digits[i] == '9')
		d->digits[i--] = '0';
	d->digits[i]++;
}

static bool decimal_is(const struct decimal *d, double number)
{
	char text[48];

	(void)snprintf(text, sizeof text, "0.%.*se%d", d->count, d->digits, d->exponent);
	return strtod(text, NULL) == number;
}

static void decimal_round(struct decimal *d, double number, int count)
{
	char text[40];

	(void)snprintf(text, sizeof text, "%.*e", count - 1, number);
	d->count = count;
	d->digits[0] = text[0];
	memcpy(d->digits + 1, text + 2, (size_t)count - 1);
	d->exponent = (int)strtol(strchr(text, 'e') + 1, NULL, 10) + 1;
}

static void decimal_init(struct decimal *d, double number)
{
	int unused, count = number < DBL_MIN ? 1 : 15;
	bool power_of_two = frexp(number, &unused) == 0.5;

	if (decimal_from_millionths(d, number))
		return;
	for (; count < 17; count++) {
		decimal_round(d, number, count);
		if (decimal_is(d, number))
			break;
		/* The doubles above a power of two lie twice as far apart as those below. */
		if (power_of_two) {
			decimal_increment(d);
			if (decimal_is(d, number))
				break;
		}
	}
	if (count == 17)
		decimal_round(d, number, count);
	decimal_trim(d);
}

enum { ZEROS = 21 };

static int write_decimal(const struct decimal *d, struct pen_buf *out)
{
	static const char zeros[ZEROS + 1] = "000000000000000000000";
	int n = d->count, k = d->exponent;

	if (n <= k && k <= ZEROS)
		return pen_buf_printf(out, "%.*s%.*s", n, d->digits, k - n, zeros);
	if (0 < k && k <= ZEROS)
		return pen_buf_printf(out, "%.*s.%.*s", k, d->digits, n - k, d->digits + k);
	if (-6 < k && k <= 0)
		return pen_buf_printf(out, "0.%.*s%.*s", -k, zeros, n, d->digits);
	return pen_buf_printf(
		out, "%c%s%.*se%+d", d->digits[0], n > 1 ? "." : "", n - 1, d->digits + 1, k - 1);
}

static int write_number(double number, struct pen_buf *out, struct pen_error *err)
{
	struct decimal decimal;

	if (!isfinite(number))
		return pen_error_set(err, PEN_EINVALID, "a number is not finite");
	if (number == 0)
		return pen_buf_append(out, "0", 1);
	if (number < 0)
		(void)pen_buf_append(out, "-", 1);
	decimal_init(&decimal, fabs(number));
	return write_decimal(&decimal, out);
}

static int write_string(const char *text, struct pen_buf *out)
{
	static const char escapes[] = "\"\"\\\\\bb\ff\nn\rr\tt";

	(void)pen_buf_append(out, "\"", 1);
	while (*text) {
		size_t plain = 0;
		const char *escape;

		while ((unsigned char)text[plain] >= 0x20 && text[plain] != '"' &&
			text[plain] != '\\')
			plain++;
		(void)pen_buf_append(out, text, plain);
		text += plain;
		if (!*text)
			break;
		escape = strchr(escapes, *text);
		if (escape)
			(void)pen_buf_printf(out, "\\%c", escape[1]);
		else
			(void)pen_buf_printf(out, "\\u%04x", (unsigned char)*text);
		text++;
	}
	return pen_buf_append(out, "\"", 1);
}

/*
 * UTF-8 sorts by code point. UTF-16 does too, but that U+E000 to U+FFFF (lead bytes EE and EF)
 * follow the surrogates of all that is beyond (lead bytes from F0).
 */
static int key_rank(unsigned char byte)
{
	return byte == 0xEE || byte == 0xEF ? byte + 0x10 : byte;
}

struct member {
	const char *key;
	const json_t *value;
};

static int compare_members(const void *a, const void *b)
{
	const char *p = ((const struct member *)a)->key, *q = ((const struct member *)b)->key;

	while (*p && *p == *q) {
		p++;
		q++;
	}
	return key_rank((unsigned char)*p) - key_rank((unsigned char)*q);
}

static int write_value(
	const json_t *value, size_t depth, struct pen_buf *out, struct pen_error *err);

static int write_array(
	const json_t *array, size_t depth, struct pen_buf *out, struct pen_error *err)
{
	size_t count = json_array_size(array);
	int r = pen_buf_append(out, "[", 1);

	for (size_t i = 0; r == 0 && i < count; i++) {
		if (i > 0)
			(void)pen_buf_append(out, ",", 1);
		r = write_value(json_array_get(array, i), depth, out, err);
	}
	(void)pen_buf_append(out, "]", 1);
	return r;
}

static int write_object(json_t *object, size_t depth, struct pen_buf *out, struct pen_error *err)
{
	size_t count = json_object_size(object), i = 0;
	struct member *members = malloc((count + 1) * sizeof *members);
	const char *key;
	json_t *value;
	int r = 0;

	if (!members)
		return pen_error_memory(err);
	json_object_foreach (object, key, value)
		members[i++] = (struct member){key, value};
	qsort(members, count, sizeof *members, compare_members);
	(void)pen_buf_append(out, "{", 1);
	for (i = 0; r == 0 && i < count; i++) {
		if (i > 0)
			(void)pen_buf_append(out, ",", 1);
		(void)write_string(members[i].key, out);
		(void)pen_buf_append(out, ":", 1);
		r = write_value(members[i].value, depth, out, err);
	}
	(void)pen_buf_append(out, "}", 1);
	free(members);
	return r;
}

/* Appends fail silently here: the buffer remembers. */
static int write_value(
	const json_t *value, size_t depth, struct pen_buf *out, struct pen_error *err)
{
	if (depth > PEN_SCENE_DEPTH_MAX)
		return pen_error_set(
			err, PEN_ELIMIT, "nested more than %u levels deep", PEN_SCENE_DEPTH_MAX);
	switch (json_typeof(value)) {
	case JSON_OBJECT:
		/* jansson iterates only what is not const. */
		return write_object((json_t *)(uintptr_t)value, depth + 1, out, err);
	case JSON_ARRAY: return write_array(value, depth + 1, out, err);
	case JSON_STRING: (void)write_string(json_string_value(value), out); return 0;
	case JSON_INTEGER:
	case JSON_REAL: return write_number(json_number_value(value), out, err);
	case JSON_TRUE: (void)pen_buf_text(out, "true"); return 0;
	case JSON_FALSE: (void)pen_buf_text(out, "false"); return 0;
	case JSON_NULL: (void)pen_buf_text(out, "null"); return 0;
	}
	assert(false);
	return 0;
}

int pen_json_canonical(const json_t *tree, struct pen_buf *out, struct pen_error *err)
{
	int r = write_value(tree, 0, out, err);

	if (!out->failed)
		return r;
	return out->starved ? pen_error_memory(err)
			    : pen_error_set(err, PEN_ELIMIT,
				      "the canonical text has more than %zu bytes", out->max);
}

/* RFC 7396, section 2; its depth is that of the patch. False when memory runs out. */
static bool merge(json_t *target, json_t *patch)
{
	const char *key;
	json_t *value, *member;

	json_object_foreach (patch, key, value) {
		if (json_is_null(value)) {
			(void)json_object_del(target, key);
			continue;
		}
		if (!json_is_object(value))
			member = json_deep_copy(value);
		else if (json_is_object(json_object_get(target, key)))
			member = json_incref(json_object_get(target, key));
		else
			member = json_object();
		if (!member || json_object_set_new(target, key, member) < 0)
			return false;
		if (json_is_object(value) && !merge(member, value))
			return false;
	}
	return true;
}

int pen_json_merge_patch(json_t *target, const json_t *patch, struct pen_error *err)
{
	assert(json_is_object(target));
	if (!json_is_object(patch))
		return pen_error_set(err, PEN_EINVALID, "a merge patch must be an object");
	if (!merge(target, (json_t *)(uintptr_t)patch))
		return pen_error_memory(err);
	return 0;
}
