/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/findings.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static struct pen_control make(enum pen_control_type type, const char *pointer, const char *reason)
{
	struct pen_control control = {.type = (uint32_t)type};

	(void)snprintf(control.pointer, sizeof control.pointer, "%s", pointer);
	(void)snprintf(control.reason, sizeof control.reason, "%s", reason);
	return control;
}

/* Whether the coordinator would take the report: what it refuses costs the connection. */
static bool passes(const struct pen_msg_scene_report *report)
{
	struct pen_msg msg = {.type = PEN_FRAME_SCENE_REPORT, .u.scene_report = *report}, got;
	struct pen_frame frame = {.type = msg.type};
	struct pen_arena arena;
	struct pen_buf out;
	uint32_t sequence = 0;
	bool good;

	pen_buf_init(&out, 1 << 20);
	pen_arena_init(&arena, 1 << 20);
	assert_int_equal(pen_msg_write(&msg, &out, &sequence, NULL), 0);
	frame.control = (const uint8_t *)out.data + PEN_FRAME_HEADER;
	frame.control_size = out.size - PEN_FRAME_HEADER;
	good = pen_msg_read(&frame, &arena, &got, NULL) == 0;
	pen_arena_finish(&arena);
	pen_buf_finish(&out);
	return good;
}

/* Fails when a scene process can make its worker send what the coordinator does not take. */
static void test_hostile_texts(void **state)
{
	struct pen_findings findings = {0};
	struct pen_control control = make(PEN_CONTROL_ERROR, "/a\n", "whole\xff gone");
	struct pen_msg_scene_report report = {.job = 1};

	(void)state;
	pen_findings_add(&findings, &control);
	memset(control.reason, 'x', sizeof control.reason - 1);
	pen_findings_add(&findings, &control);
	pen_findings_report_errors(&findings, &report);
	assert_string_equal(report.pointers[0], "/a ");
	assert_string_equal(report.details[0], "whole? gone");
	assert_int_equal(strlen(report.details[1]), PEN_SCENE_ERROR_BYTES_MAX);
	assert_true(passes(&report));
	pen_findings_finish(&findings);
	assert_int_equal(findings.error_count, 0);
}

/* Fails when more findings than there is room for are taken, or fewer. */
static void test_counts(void **state)
{
	struct pen_findings findings = {0};
	struct pen_control error = make(PEN_CONTROL_ERROR, "/objects/0", "broken");
	struct pen_control warning = make(PEN_CONTROL_WARNING, "", "left out");
	struct pen_msg_scene_report errors = {.job = 1}, warnings = {.job = 1};

	(void)state;
	for (uint32_t n = 1; n <= PEN_SCENE_ERRORS_MAX + 1; n++) {
		pen_findings_add(&findings, &error);
		assert_int_equal(
			findings.error_count, n <= PEN_SCENE_ERRORS_MAX ? n : PEN_SCENE_ERRORS_MAX);
	}
	for (uint32_t n = 1; n <= PEN_SCENE_WARNINGS_MAX + 1; n++) {
		(void)snprintf(warning.reason, sizeof warning.reason, "%u", n);
		pen_findings_add(&findings, &warning);
		assert_int_equal(findings.warning_count,
			n <= PEN_SCENE_WARNINGS_MAX ? n : PEN_SCENE_WARNINGS_MAX);
	}
	pen_findings_report_errors(&findings, &errors);
	pen_findings_report_warnings(&findings, &warnings);
	assert_true(passes(&errors));
	assert_true(passes(&warnings));
	assert_string_equal(warnings.warnings[1], "2");
	pen_findings_finish(&findings);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_hostile_texts),
		cmocka_unit_test(test_counts),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
