/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/json.h"

#include "core/base/buf.h"
#include "core/base/limits.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#define TEXT(literal)                                                                              \
	{                                                                                          \
		literal, sizeof(literal) - 1                                                       \
	}

struct text {
	const char *data;
	size_t size;
};

/* The bytes stand at the end of their own heap block, so that a sanitizer sees a read past them. */
static int parse(const char *data, size_t size, json_t **ret_tree, struct pen_error *err)
{
	char *copy = malloc(size + 1);
	int r;

	assert_non_null(copy);
	memcpy(copy + 1, data, size);
	r = pen_json_parse(copy + 1, size, ret_tree, err);
	free(copy);
	return r;
}

static int code_of(const char *data, size_t size, struct pen_error *err)
{
	json_t *tree = NULL;
	int r = parse(data, size, &tree, err);

	assert_true((r == 0) == (tree != NULL));
	json_decref(tree);
	return r;
}

/* A text of repeated pieces between a head and a tail. */
static int code_of_repeated(const char *head, const char *piece, size_t count, const char *tail)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_buf buf;
	int r;

	pen_buf_init(&buf, 2 * PEN_SCENE_BYTES_MAX);
	(void)pen_buf_text(&buf, head);
	for (size_t i = 0; i < count; i++)
		(void)pen_buf_text(&buf, piece);
	(void)pen_buf_text(&buf, tail);
	assert_false(buf.failed);
	r = code_of(buf.data, buf.size, &err);
	pen_buf_finish(&buf);
	return r;
}

/* Broken by a scan that is stricter than RFC 8259. */
static void takes_all_of_json(void **state)
{
	static const struct text texts[] = {
		TEXT("{}"),
		TEXT("[]"),
		TEXT(" \t\r\n[ ] \n"),
		TEXT("{\"a\":{\"b\":[true,false,null,\"\",[],{}]}}"),
		TEXT("[0,-0,1,-1,0.5,1e3,1E+3,1e-3,-1.25e-300,1e308,1e-400]"),
		TEXT("[123456789012345678901234567890]"),
		TEXT("[\"\\\"\\\\\\/\\b\\f\\n\\r\\t\\u00e9\\ud83d\\ude00\"]"),
		TEXT("[\"\x7f\xc2\x80\xdf\xbf\xe0\xa0\x80\xed\x9f\xbf\xee\x80\x80\xf0\x90\x80\x80"
		     "\xf4\x8f\xbf\xbf\"]"),
	};
	struct pen_error err = PEN_ERROR_INIT;

	(void)state;
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
		assert_int_equal(code_of(texts[i].data, texts[i].size, &err), 0);
}

struct refusal {
	struct text text;
	const char *place, *reason;
};

/* Broken by a wrong line, column (of characters) or byte, or by a message that misses the cause. */
static void refuses_what_is_no_json(void **state)
{
	static const struct refusal refusals[] = {
		{TEXT(""), "line 1, column 1, byte 0", "expected an object"},
		{TEXT("hello"), "line 1, column 1, byte 0", "expected an object"},
		{TEXT("17"), "line 1, column 1, byte 0", "expected an object"},
		{TEXT("\xef\xbb\xbf{}"), "line 1, column 1, byte 0", "expected an object"},
		{TEXT("{\n  \"a\": x}"), "line 2, column 8, byte 9", "expected a value"},
		{TEXT("[\"\xc3\xa9\", +1]"), "line 1, column 7, byte 7", "expected a value"},
		{TEXT("[1,]"), "line 1, column 4, byte 3", "expected a value"},
		{TEXT("[1 2]"), "line 1, column 4, byte 3", "comma"},
		{TEXT("[1}"), "line 1, column 3, byte 2", "comma"},
		{TEXT("{\"a\" 1}"), "line 1, column 6, byte 5", "colon"},
		{TEXT("{a:1}"), "line 1, column 2, byte 1", "key"},
		{TEXT("{\"a\":1,}"), "line 1, column 8, byte 7", "key"},
		{TEXT("[] []"), "line 1, column 4, byte 3", "end of the text"},
		{TEXT("[]\0"), "line 1, column 3, byte 2", "end of the text"},
		{TEXT("[01]"), "line 1, column 4, byte 3", "begin with 0"},
		{TEXT("[1.]"), "line 1, column 4, byte 3", "digit"},
		{TEXT("[1e]"), "line 1, column 4, byte 3", "digit"},
		{TEXT("[NaN]"), "line 1, column 2, byte 1", "expected a value"},
		{TEXT("[-Infinity]"), "line 1, column 3, byte 2", "expected a value"},
		{TEXT("[1, 1e400]"), "line 1, column 5, byte 4", "range of a double"},
		{TEXT("[-1e309]"), "line 1, column 2, byte 1", "range of a double"},
		{TEXT("[\"a\nb\"]"), "line 1, column 4, byte 3", "control character"},
		{TEXT("[\"a\0b\"]"), "line 1, column 4, byte 3", "control character"},
		{TEXT("[\"\\x\"]"), "line 1, column 4, byte 3", "escape"},
		{TEXT("[\"\\u12g4\"]"), "line 1, column 7, byte 6", "hexadecimal"},
		{TEXT("[\"\\u0000\"]"), "line 1, column 9, byte 8", "NUL"},
		{TEXT("[\"\\ud800\"]"), "line 1, column 9, byte 8", "surrogate"},
		{TEXT("[\"\\ud800\\u0041\"]"), "line 1, column 15, byte 14", "surrogate"},
		{TEXT("[\"\\udc00\"]"), "line 1, column 9, byte 8", "surrogate"},
		{TEXT("[\"\xff\"]"), "line 1, column 3, byte 2", "UTF-8"},
		{TEXT("[\"\xc0\x80\"]"), "line 1, column 3, byte 2", "UTF-8"},
		{TEXT("[\"\xe0\x9f\xbf\"]"), "line 1, column 3, byte 2", "UTF-8"},
		{TEXT("[\"\xed\xa0\x80\"]"), "line 1, column 3, byte 2", "UTF-8"},
		{TEXT("[\"\xf4\x90\x80\x80\"]"), "line 1, column 3, byte 2", "UTF-8"},
		{TEXT("[\"\xe2\x82\"]"), "line 1, column 3, byte 2", "UTF-8"},
		{TEXT("{\"a\":1,\"a\":2}"), "line 1, column ", "duplicate key"},
	};

	(void)state;
	for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
		const struct refusal *refusal = &refusals[i];
		struct pen_error err = PEN_ERROR_INIT;

		assert_int_equal(
			code_of(refusal->text.data, refusal->text.size, &err), PEN_EINVALID);
		if (!strstr(err.text, refusal->place) || !strstr(err.text, refusal->reason))
			fail_msg("%s: \"%s\" lacks \"%s\" or \"%s\"", refusal->text.data, err.text,
				refusal->place, refusal->reason);
	}
}

/* Broken by any state of the scan in which the end of the text counts as good, or is read past. */
static void refuses_every_truncation(void **state)
{
	static const char text[] =
		"{\"a\":[-1.5e+3,true,false,null,\"\\u00e9\\ud83d\\ude00\xf0\x9f\x98\x80\"],"
		"\"b\":{\"c\":0}}";
	struct pen_error err = PEN_ERROR_INIT;

	(void)state;
	for (size_t size = 0; size < sizeof text - 1; size++)
		assert_int_equal(code_of(text, size, &err), PEN_EINVALID);
	assert_int_equal(code_of(text, sizeof text - 1, &err), 0);
}

/* Broken by a bound that is off by one. */
static void bounds_are_exact(void **state)
{
	const size_t bytes = PEN_SCENE_BYTES_MAX, depth = PEN_SCENE_DEPTH_MAX;
	const size_t nodes = PEN_SCENE_NODES_MAX, string = PEN_SCENE_STRING_MAX;

	(void)state;
	assert_int_equal(code_of_repeated("[]", " ", bytes - 3, ""), 0);
	assert_int_equal(code_of_repeated("[]", " ", bytes - 2, ""), 0);
	assert_int_equal(code_of_repeated("[]", " ", bytes - 1, ""), PEN_ELIMIT);

	/* The array itself is a value. */
	assert_int_equal(code_of_repeated("[1", ",1", nodes - 3, "]"), 0);
	assert_int_equal(code_of_repeated("[1", ",1", nodes - 2, "]"), 0);
	assert_int_equal(code_of_repeated("[1", ",1", nodes - 1, "]"), PEN_EINVALID);

	assert_int_equal(code_of_repeated("[\"", "x", string - 1, "\"]"), 0);
	assert_int_equal(code_of_repeated("[\"", "x", string, "\"]"), 0);
	assert_int_equal(code_of_repeated("[\"", "x", string + 1, "\"]"), PEN_EINVALID);
	assert_int_equal(code_of_repeated("{\"", "x", string, "\":1}"), 0);
	assert_int_equal(code_of_repeated("{\"", "x", string + 1, "\":1}"), PEN_EINVALID);

	for (size_t levels = depth - 1; levels <= depth + 1; levels++) {
		char text[2 * (PEN_SCENE_DEPTH_MAX + 1)];
		struct pen_error err = PEN_ERROR_INIT;

		memset(text, '[', levels);
		memset(text + levels, ']', levels);
		assert_int_equal(
			code_of(text, 2 * levels, &err), levels <= depth ? 0 : PEN_EINVALID);
	}
}

/* Broken by recursion, or by a tree that is built before the depth is known. */
static void hostile_texts_end_at_once(void **state)
{
	clock_t start = clock();

	(void)state;
	assert_int_equal(code_of_repeated("", "[", 10000, ""), PEN_EINVALID);
	assert_int_equal(code_of_repeated("", "{\"a\":", 10000, ""), PEN_EINVALID);
	assert_int_equal(code_of_repeated("[1", "0", 100000, "]"), PEN_EINVALID);
	assert_in_range(clock() - start, 0, CLOCKS_PER_SEC / 20);
}

/* Broken by losing a long integer, which the canonical text of 1e20 is. */
static void long_integers_are_numbers(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	json_t *tree = NULL;

	(void)state;
	assert_int_equal(parse("[100000000000000000000, 7]", 26, &tree, &err), 0);
	assert_true(json_number_value(json_array_get(tree, 0)) == 1e20);
	assert_true(json_number_value(json_array_get(tree, 1)) == 7);
	json_decref(tree);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(takes_all_of_json),
		cmocka_unit_test(refuses_what_is_no_json),
		cmocka_unit_test(refuses_every_truncation),
		cmocka_unit_test(bounds_are_exact),
		cmocka_unit_test(hostile_texts_end_at_once),
		cmocka_unit_test(long_integers_are_numbers),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
