/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/buf.h"

#include "core/base/error.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Broken by a lost byte at any growth step, or by a missing NUL. */
static void appends_keep_every_byte(void **state)
{
	struct pen_buf buf;

	(void)state;
	pen_buf_init(&buf, 100000);
	for (size_t i = 0; i < 5000; i++) {
		char byte = (char)('a' + i % 26);

		assert_int_equal(pen_buf_append(&buf, &byte, 1), 0);
		assert_int_equal(buf.data[buf.size], '\0');
	}
	assert_int_equal(buf.size, 5000);
	for (size_t i = 0; i < buf.size; i++)
		assert_int_equal(buf.data[i], 'a' + i % 26);
	pen_buf_finish(&buf);
	assert_null(buf.data);
}

/* Broken by a ceiling that is off by one: max - 1 and max fit, max + 1 does not. */
static void ceiling_is_exact(void **state)
{
	static const char bytes[1025];
	struct pen_buf buf;

	(void)state;
	for (size_t size = 1023; size <= 1025; size++) {
		pen_buf_init(&buf, 1024);
		assert_int_equal(pen_buf_append(&buf, bytes, size), size <= 1024 ? 0 : PEN_ELIMIT);
		assert_int_equal(buf.size, size <= 1024 ? size : 0);
		pen_buf_finish(&buf);
	}
}

/* Broken by a sum that wraps around: a huge size must not look small. */
static void huge_sizes_are_refused(void **state)
{
	struct pen_buf buf;

	(void)state;
	pen_buf_init(&buf, 1024);
	assert_int_equal(pen_buf_text(&buf, "x"), 0);
	assert_null(pen_buf_reserve(&buf, SIZE_MAX));
	assert_int_equal(buf.size, 1);
	pen_buf_finish(&buf);
}

/* Broken when a short append after a refused one leaves a hole in the text. */
static void failure_sticks_until_cleared(void **state)
{
	struct pen_buf buf;

	(void)state;
	pen_buf_init(&buf, 4);
	assert_int_equal(pen_buf_text(&buf, "12345"), PEN_ELIMIT);
	assert_true(buf.failed);
	assert_int_not_equal(pen_buf_text(&buf, "1"), 0);
	pen_buf_clear(&buf);
	assert_false(buf.failed);
	assert_int_equal(pen_buf_text(&buf, "1234"), 0);
	assert_string_equal(buf.data, "1234");
	pen_buf_finish(&buf);
}

/* Broken by a printf that cuts at the old capacity or counts the NUL. */
static void printf_appends_whole_texts(void **state)
{
	struct pen_buf buf;

	(void)state;
	pen_buf_init(&buf, 4096);
	assert_int_equal(pen_buf_printf(&buf, "%d-", 7), 0);
	assert_int_equal(pen_buf_printf(&buf, "%01000d", 1), 0);
	assert_int_equal(buf.size, 1002);
	assert_int_equal(strlen(buf.data), 1002);
	assert_int_equal(pen_buf_printf(&buf, "%04000d", 1), PEN_ELIMIT);
	assert_int_equal(buf.size, 1002);
	pen_buf_finish(&buf);
}

/* Broken by a move that loses the tail or the NUL behind it. */
static void consume_drops_the_front(void **state)
{
	struct pen_buf buf;

	(void)state;
	pen_buf_init(&buf, 64);
	pen_buf_consume(&buf, 0);
	assert_int_equal(pen_buf_text(&buf, "headtail"), 0);
	pen_buf_consume(&buf, 4);
	assert_string_equal(buf.data, "tail");
	pen_buf_consume(&buf, 4);
	assert_int_equal(buf.size, 0);
	pen_buf_finish(&buf);
}

/* Broken when the buffer frees, or goes on using, what it has handed over. */
static void take_hands_over(void **state)
{
	struct pen_buf buf;
	char *text;

	(void)state;
	pen_buf_init(&buf, 64);
	assert_null(pen_buf_take(&buf));
	assert_int_equal(pen_buf_text(&buf, "mine"), 0);
	text = pen_buf_take(&buf);
	assert_int_equal(buf.size, 0);
	assert_int_equal(pen_buf_text(&buf, "other"), 0);
	pen_buf_finish(&buf);
	assert_string_equal(text, "mine");
	free(text);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(appends_keep_every_byte),
		cmocka_unit_test(ceiling_is_exact),
		cmocka_unit_test(huge_sizes_are_refused),
		cmocka_unit_test(failure_sticks_until_cleared),
		cmocka_unit_test(printf_appends_whole_texts),
		cmocka_unit_test(consume_drops_the_front),
		cmocka_unit_test(take_hands_over),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
