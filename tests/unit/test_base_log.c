/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/log.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* Runs pen_log with standard error in a pipe; the text it wrote, or "". */
static const char *logged(enum pen_log_level level, const char *message)
{
	static char text[4096];
	int saved = dup(STDERR_FILENO);
	int ends[2];
	ssize_t size;

	assert_int_equal(pipe(ends), 0);
	assert_true(dup2(ends[1], STDERR_FILENO) >= 0);
	close(ends[1]);
	pen_log(level, "%s", message);
	assert_true(dup2(saved, STDERR_FILENO) >= 0);
	close(saved);
	size = read(ends[0], text, sizeof text - 1);
	close(ends[0]);
	assert_true(size >= 0);
	text[size] = '\0';
	return text;
}

/* Broken by a line without time, name, level or text, or that is not one line. */
static void a_line_tells_who_and_how_bad(void **state)
{
	const char *line;

	(void)state;
	pen_log_open("tester", PEN_LOG_INFO);
	line = logged(PEN_LOG_WARNING, "disk is nearly full");
	assert_non_null(strstr(line, "Z tester["));
	assert_non_null(strstr(line, "] warning: disk is nearly full\n"));
	assert_ptr_equal(strchr(line, '\n'), line + strlen(line) - 1);
}

/* Broken by a level that is compared the wrong way round. */
static void lines_above_the_level_are_dropped(void **state)
{
	(void)state;
	pen_log_open("tester", PEN_LOG_WARNING);
	assert_string_equal(logged(PEN_LOG_INFO, "chatter"), "");
	assert_string_not_equal(logged(PEN_LOG_WARNING, "trouble"), "");
	assert_string_not_equal(logged(PEN_LOG_ERROR, "disaster"), "");
}

/* Broken by a write past the line, or a cut line without its end. */
static void long_lines_are_cut(void **state)
{
	char message[3000];
	const char *line;

	(void)state;
	memset(message, 'a', sizeof message - 1);
	message[sizeof message - 1] = '\0';
	pen_log_open("tester", PEN_LOG_INFO);
	line = logged(PEN_LOG_INFO, message);
	assert_in_range(strlen(line), 512, 1024);
	assert_int_equal(line[strlen(line) - 1], '\n');
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_line_tells_who_and_how_bad),
		cmocka_unit_test(lines_above_the_level_are_dropped),
		cmocka_unit_test(long_lines_are_cut),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
