/* SPDX-License-Identifier: Apache-2.0 */
#include "server/fields.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

/* Breaks if a stale picture is kept, or a fresh one sent again, for a list that a client may send.
 */
static void test_etags(void **state)
{
	(void)state;
	assert_true(pen_field_etag_matches("\"a\"", "\"a\""));
	assert_true(pen_field_etag_matches("W/\"a\"", "\"a\""));
	assert_true(pen_field_etag_matches("\"a\"", "W/\"a\""));
	assert_true(pen_field_etag_matches("\"x\" , W/\"y\",\"a\"", "\"a\""));
	assert_true(pen_field_etag_matches("\"x,\",\"a\"", "\"a\""));
	assert_true(pen_field_etag_matches("*", "\"a\""));
	assert_false(pen_field_etag_matches(NULL, "\"a\""));
	assert_false(pen_field_etag_matches("", "\"a\""));
	assert_false(pen_field_etag_matches("a", "\"a\""));
	assert_false(pen_field_etag_matches("\"ab\"", "\"a\""));
	assert_false(pen_field_etag_matches("\"a", "\"a\""));
	assert_false(pen_field_etag_matches("\"x,\"a\"", "\"a\""));
}

static void test_media_types(void **state)
{
	(void)state;
	assert_true(pen_field_media_type_is("application/json", "application/json"));
	assert_true(pen_field_media_type_is("Application/JSON;charset=utf-8", "application/json"));
	assert_true(pen_field_media_type_is("application/json ; x=y", "application/json"));
	assert_false(pen_field_media_type_is("application/json5", "application/json"));
	assert_false(pen_field_media_type_is("application/jso", "application/json"));
	assert_false(pen_field_media_type_is(NULL, "application/json"));
}

/* Breaks if the preference of RFC 9110, section 12.5.1, is not the one that is followed. */
static void test_accept(void **state)
{
	static const char *const types[] = {"image/png", "image/jpeg", "image/x-exr"};
	static const struct {
		const char *accept;
		size_t choice;
	} cases[] = {
		{NULL, 0},
		{"*/*", 0},
		{"image/*", 0},
		{"IMAGE/JPEG", 1},
		{"image/jpeg, image/png", 0},
		{"image/jpeg;q=0.8, image/png;q=0.7", 1},
		{"*/*;q=0.1, image/x-exr", 2},
		{"image/*;q=0.5, image/png;q=0", 1},
		{"*/*, image/png;q=0.2", 1},
		{"image/jpeg;level=1;q=0.3, image/x-exr;q=0.4", 2},
		{"text/html,application/xhtml+xml,image/avif,*/*;q=0.8", 0},
		{"text/html", 3},
		{"image/png;q=0", 3},
		{"", 3},
	};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
		assert_int_equal(pen_field_accept(cases[i].accept, types, 3), cases[i].choice);
}

static void expect_part(const char *range, uint64_t size, uint64_t first, uint64_t count)
{
	uint64_t found_first, found_count;

	assert_int_equal(pen_field_range(range, size, &found_first, &found_count), PEN_RANGE_PART);
	assert_int_equal(found_first, first);
	assert_int_equal(found_count, count);
}

/* Breaks if a part reaches past the file, or arithmetic on a huge number overflows. */
static void test_ranges(void **state)
{
	static const char *const wholes[] = {"bytes=", "bytes=-", "bytes=x-", "bytes=5-4",
		"bytes=0-1,3-4", "items=0-1", "bytes=1-2 x", "bytes 0-1"};
	uint64_t first, count;

	(void)state;
	expect_part("bytes=0-0", 10, 0, 1);
	expect_part("bytes=3-", 10, 3, 7);
	expect_part("bytes=3-99", 10, 3, 7);
	expect_part("bytes=-3", 10, 7, 3);
	expect_part("bytes=-99", 10, 0, 10);
	expect_part("Bytes=2-18446744073709551615", 10, 2, 8);
	expect_part("bytes=2-99999999999999999999999", 10, 2, 8);
	assert_int_equal(pen_field_range(NULL, 10, &first, &count), PEN_RANGE_WHOLE);
	for (size_t i = 0; i < sizeof wholes / sizeof wholes[0]; i++)
		assert_int_equal(pen_field_range(wholes[i], 10, &first, &count), PEN_RANGE_WHOLE);
	assert_int_equal(pen_field_range("bytes=10-", 10, &first, &count), PEN_RANGE_UNSATISFIABLE);
	assert_int_equal(pen_field_range("bytes=-0", 10, &first, &count), PEN_RANGE_UNSATISFIABLE);
	assert_int_equal(pen_field_range("bytes=99999999999999999999999-", 10, &first, &count),
		PEN_RANGE_UNSATISFIABLE);
}

/* Breaks if a name that only looks like this machine passes. */
static void test_hosts(void **state)
{
	static const char *const local[] = {
		"localhost", "LocalHost:8080", "127.0.0.1", "127.0.0.1:0", "[::1]", "[::1]:80"};
	static const char *const foreign[] = {"", "localhost.", "localhost.example", "localhost:8o",
		"127.0.0.1.example", "127.0.0.2", "::1", "[::1", "[::1]x", "example:80",
		"localhost@x"};

	(void)state;
	for (size_t i = 0; i < sizeof local / sizeof local[0]; i++)
		assert_true(pen_field_host_is_local(local[i]));
	for (size_t i = 0; i < sizeof foreign / sizeof foreign[0]; i++)
		assert_false(pen_field_host_is_local(foreign[i]));
	assert_false(pen_field_host_is_local(NULL));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_etags),
		cmocka_unit_test(test_media_types),
		cmocka_unit_test(test_accept),
		cmocka_unit_test(test_ranges),
		cmocka_unit_test(test_hosts),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
