/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/log.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
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
	pen_log_open("tester", PEN_LOG_INFO, PEN_LOG_TEXT);
	line = logged(PEN_LOG_WARNING, "disk is nearly full");
	assert_non_null(strstr(line, "Z tester["));
	assert_non_null(strstr(line, "] warning: disk is nearly full\n"));
	assert_ptr_equal(strchr(line, '\n'), line + strlen(line) - 1);
}

/* Broken by a level that is compared the wrong way round. */
static void lines_above_the_level_are_dropped(void **state)
{
	(void)state;
	pen_log_open("tester", PEN_LOG_WARNING, PEN_LOG_TEXT);
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
	pen_log_open("tester", PEN_LOG_INFO, PEN_LOG_TEXT);
	line = logged(PEN_LOG_INFO, message);
	assert_in_range(strlen(line), 512, 1024);
	assert_int_equal(line[strlen(line) - 1], '\n');
}

/* Broken by a line that is no JSON, an id that is missing, or one that is not known and yet there.
 */
static void json_has_the_ids(void **state)
{
	static const struct pen_log_about about = {.request = "r-1",
		.job = "abc",
		.trace = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01",
		.worker = 7,
		.has_unit = true,
		.frame = 1,
		.tile = 0,
		.round = 2};
	char text[2048], name[] = "/tmp/penumbra-log-XXXXXX";
	int fd = mkstemp(name), saved = dup(STDERR_FILENO);
	ssize_t size;

	(void)state;
	assert_true(fd >= 0 && saved >= 0 && unlink(name) == 0);
	assert_true(dup2(fd, STDERR_FILENO) >= 0);
	pen_log_open("tester", PEN_LOG_INFO, PEN_LOG_JSON);
	pen_log_of(&about, PEN_LOG_INFO, "a \"%s\"\n\\", "b");
	pen_log(PEN_LOG_ERROR, "alone");
	pen_log_open("tester", PEN_LOG_INFO, PEN_LOG_TEXT);
	assert_true(dup2(saved, STDERR_FILENO) >= 0);
	close(saved);
	size = pread(fd, text, sizeof text - 1, 0);
	close(fd);
	assert_true(size > 0);
	text[size] = '\0';
	assert_non_null(strstr(text, "\",\"level\":\"info\",\"program\":\"tester\",\"pid\":"));
	assert_non_null(strstr(text,
		",\"message\":\"a "
		"\\\"b\\\"\\u000a\\\\\",\"request\":\"r-1\",\"job\":\"abc\",\"frame\":1,"
		"\"tile\":0,\"round\":2,\"worker\":7,"
		"\"trace_id\":\"0af7651916cd43dd8448eb211c80319c\","
		"\"span_id\":\"b7ad6b7169203331\"}\n{\"time\":"));
	assert_non_null(strstr(text, ",\"message\":\"alone\"}\n"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_line_tells_who_and_how_bad),
		cmocka_unit_test(lines_above_the_level_are_dropped),
		cmocka_unit_test(long_lines_are_cut),
		cmocka_unit_test(json_has_the_ids),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
