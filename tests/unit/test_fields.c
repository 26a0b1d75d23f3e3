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

/* Breaks if a preference that a client may write is not understood, or one that is none is. */
static void test_wait(void **state)
{
	(void)state;
	assert_int_equal(pen_field_wait("wait=10"), 10);
	assert_int_equal(pen_field_wait("respond-async, WAIT = 7"), 7);
	assert_int_equal(pen_field_wait("foo; bar=\"x\", wait=\"5\"; y"), 5);
	assert_int_equal(pen_field_wait("wait=99999999999999999999999"), UINT32_MAX);
	assert_int_equal(pen_field_wait("wait=0"), 0);
	assert_int_equal(pen_field_wait(NULL), 0);
	assert_int_equal(pen_field_wait(""), 0);
	assert_int_equal(pen_field_wait("wait"), 0);
	assert_int_equal(pen_field_wait("wait="), 0);
	assert_int_equal(pen_field_wait("wait=-1"), 0);
	assert_int_equal(pen_field_wait("wait=1x"), 0);
	assert_int_equal(pen_field_wait("wait=\"1"), 0);
	assert_int_equal(pen_field_wait("await=5"), 0);
	assert_int_equal(pen_field_wait("waiting=5"), 0);
}

static void test_directives(void **state)
{
	(void)state;
	assert_true(pen_field_has_directive("no-store", "no-store"));
	assert_true(pen_field_has_directive("max-age=0 , No-Store", "no-store"));
	assert_true(pen_field_has_directive("no-store,no-cache", "no-store"));
	assert_false(pen_field_has_directive(NULL, "no-store"));
	assert_false(pen_field_has_directive("", "no-store"));
	assert_false(pen_field_has_directive("no-store=1", "no-store"));
	assert_false(pen_field_has_directive("no-storex", "no-store"));
	assert_false(pen_field_has_directive("xno-store", "no-store"));
}

static void test_numbers(void **state)
{
	uint64_t number = 3;

	(void)state;
	assert_false(pen_field_number("", 10, &number));
	assert_false(pen_field_number("-1", 10, &number));
	assert_false(pen_field_number(" 1", 10, &number));
	assert_false(pen_field_number("1 ", 10, &number));
	assert_false(pen_field_number("11", 10, &number));
	assert_false(pen_field_number("99999999999999999999", UINT64_MAX, &number));
	assert_int_equal(number, 3);
	assert_true(pen_field_number("10", 10, &number) && number == 10);
	assert_true(pen_field_number("18446744073709551615", UINT64_MAX, &number));
	assert_true(number == UINT64_MAX);
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
		cmocka_unit_test(test_wait),
		cmocka_unit_test(test_directives),
		cmocka_unit_test(test_numbers),
		cmocka_unit_test(test_ranges),
		cmocka_unit_test(test_hosts),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
