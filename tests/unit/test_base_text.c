/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

/* Fails when a text is taken for plain past a byte that is not, or cut within a whole character. */
static void test_plain(void **state)
{
	static const struct {
		const char *text;
		size_t plain;
	} cases[] = {
		{"", 0},
		{"a b", 3},
		{"a\nb", 1},
		{"\x7f", 0},
		{"n\xc3\xa4h", 4},
		{"ab\xc3", 2},
		{"ab\xe2\x82", 2},
		{"ab\xe2\x82\xac", 5},
		{"\xf0\x9f\x92\xa1!", 5},
		{"!\xf0\x9f\x92", 1},
		{"!\xed\xa0\x80", 1},
		{"!\xc0\x80", 1},
	};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		assert_int_equal(pen_text_plain(cases[i].text), cases[i].plain);
}

/* Fails when a byte that is not plain stays, or one that is goes. */
static void test_clean(void **state)
{
	char text[] = "n\xc3\xa4h\n\xc3\x1b[\xe2\x82", plain[] = "\xe2\x82\xac 1", empty[] = "";

	(void)state;
	pen_text_clean(text);
	assert_string_equal(text, "n\xc3\xa4h ??[??");
	pen_text_clean(plain);
	assert_string_equal(plain, "\xe2\x82\xac 1");
	pen_text_clean(empty);
	assert_string_equal(empty, "");
}

/* Fails when a number too few, too many or none is taken, or one that is not finite. */
static void test_reals(void **state)
{
	static const char *const wrong[] = {
		"", "1", "1,2,", "1,2,3", "1;2", "1,x", ",2", "1,inf", "nan,2"};
	double n[2];

	(void)state;
	assert_true(pen_text_reals("-1.5,2e3", 2, n));
	assert_true(n[0] == -1.5 && n[1] == 2000.0);
	for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
		assert_false(pen_text_reals(wrong[i], 2, n));
}

/* Fails when a digit is lost at either end, or zeros stand in front. */
static void test_hex(void **state)
{
	static const struct {
		uint64_t number;
		const char *text;
	} cases[] = {
		{0, "0"},
		{0xf, "f"},
		{0x10, "10"},
		{0x8000000000000000, "8000000000000000"},
		{UINT64_MAX, "ffffffffffffffff"},
		{0x0123456789abcdef, "123456789abcdef"},
	};
	char text[17];

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		*pen_text_hex(text, cases[i].number) = '\0';
		assert_string_equal(text, cases[i].text);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_plain),
		cmocka_unit_test(test_clean),
		cmocka_unit_test(test_reals),
		cmocka_unit_test(test_hex),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
