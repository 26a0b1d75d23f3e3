/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/error.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

/* Broken by a setter that forgets the code, the text or to return the code. */
static void set_fills_code_and_text(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;

	(void)state;
	assert_int_equal(pen_error_set(&err, PEN_EINVALID, "%s is %d", "width", 0), PEN_EINVALID);
	assert_int_equal(err.code, PEN_EINVALID);
	assert_string_equal(err.text, "width is 0");
}

/* Broken by a setter that insists on a place for the text. */
static void null_is_accepted(void **state)
{
	(void)state;
	assert_int_equal(pen_error_set(NULL, PEN_EPROTOCOL, "lost"), PEN_EPROTOCOL);
	assert_int_equal(pen_error_system(NULL, ENOSPC, "lost"), PEN_ENOSPACE);
	assert_int_equal(pen_error_memory(NULL), PEN_ENOMEM);
}

/* Broken when the reason is left out or a full disk is told as any other refusal. */
static void system_appends_the_reason(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;

	(void)state;
	assert_int_equal(pen_error_system(&err, ENOENT, "open %s", "scene.json"), PEN_EIO);
	assert_string_equal(err.text, "open scene.json: No such file or directory");
	assert_int_equal(pen_error_system(&err, ENOSPC, "write"), PEN_ENOSPACE);
	assert_int_equal(pen_error_system(&err, EDQUOT, "write"), PEN_ENOSPACE);
	assert_int_equal(err.code, PEN_ENOSPACE);
}

/* Broken by a write past the text, or by a text without its end. */
static void long_texts_are_cut(void **state)
{
	struct {
		struct pen_error err;
		char guard;
	} place = {.err = PEN_ERROR_INIT, .guard = 'x'};
	char text[2 * sizeof place.err.text];

	(void)state;
	memset(text, 'a', sizeof text - 1);
	text[sizeof text - 1] = '\0';
	pen_error_set(&place.err, PEN_EIO, "%s", text);
	assert_int_equal(strlen(place.err.text), sizeof place.err.text - 1);
	pen_error_system(&place.err, ENOENT, "%s", text);
	assert_int_equal(strlen(place.err.text), sizeof place.err.text - 1);
	assert_int_equal(place.guard, 'x');
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(set_fills_code_and_text),
		cmocka_unit_test(null_is_accepted),
		cmocka_unit_test(system_appends_the_reason),
		cmocka_unit_test(long_texts_are_cut),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
