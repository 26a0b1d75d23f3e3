/* SPDX-License-Identifier: Apache-2.0 */
#include "server/trace_context.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define TRACE  "0af7651916cd43dd8448eb211c80319c"
#define PARENT "b7ad6b7169203331"

/* Broken by another trace, the same parent, or flags that the standard does not know. */
static void test_goes_on(void **state)
{
	static const char *const good[] = {
		"00-" TRACE "-" PARENT "-01",
		"00-" TRACE "-" PARENT "-ff",
		"cc-" TRACE "-" PARENT "-01",
		"cc-" TRACE "-" PARENT "-01-what-the-future-will-be-like",
	};
	char own[PEN_TRACEPARENT_TEXT];

	(void)state;
	for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
		assert_true(pen_trace_context_continue(good[i], own));
		assert_true(pen_trace_context_valid(own));
		assert_memory_equal(own, "00-" TRACE "-", 36);
		assert_memory_not_equal(own + 36, PARENT, 16);
		assert_string_equal(own + 52, "-01");
	}
	assert_true(pen_trace_context_continue("00-" TRACE "-" PARENT "-02", own));
	assert_string_equal(own + 52, "-00");
}

/* Broken by taking what the standard has ignored. */
static void test_malformed(void **state)
{
	static const char *const bad[] = {
		"",
		"00",
		"00-" TRACE "-" PARENT,
		"00-" TRACE "-" PARENT "-",
		"00-" TRACE "-" PARENT "-0",
		"00-" TRACE "-" PARENT "-01-",
		"00-" TRACE "-" PARENT "-01-more",
		"00-" TRACE "-" PARENT "-01.",
		"00-" TRACE "-" PARENT "-0x",
		"cc-" TRACE "-" PARENT "-01.",
		"ff-" TRACE "-" PARENT "-01",
		"0-" TRACE "-" PARENT "-01",
		"000-" TRACE "-" PARENT "-01",
		"00-00000000000000000000000000000000-" PARENT "-01",
		"00-" TRACE "-0000000000000000-01",
		"00-0AF7651916CD43DD8448EB211C80319C-" PARENT "-01",
		"00-" TRACE "-B7AD6B7169203331-01",
		"00_" TRACE "-" PARENT "-01",
		"00-" TRACE "_" PARENT "-01",
		" 00-" TRACE "-" PARENT "-01",
	};
	char own[PEN_TRACEPARENT_TEXT] = "as it was";

	(void)state;
	assert_false(pen_trace_context_continue(NULL, own));
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		assert_false(pen_trace_context_continue(bad[i], own));
	assert_string_equal(own, "as it was");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_goes_on), cmocka_unit_test(test_malformed)};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
