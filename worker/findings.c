/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/findings.h"

#include "core/base/text.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static char *plain_copy(const char *text, size_t max)
{
	char *copy = strndup(text, max);

	if (copy)
		pen_text_clean(copy);
	return copy;
}

static void add_error(struct pen_findings *findings, const struct pen_control *control)
{
	const uint32_t place = findings->error_count;
	char *pointer, *detail;

	if (place == PEN_SCENE_ERRORS_MAX)
		return;
	pointer = plain_copy(control->pointer, PEN_SCENE_ERROR_BYTES_MAX);
	detail = plain_copy(control->reason, PEN_SCENE_ERROR_BYTES_MAX);
	if (!pointer || !detail) {
		free(pointer);
		free(detail);
		return;
	}
	findings->pointers[place] = pointer;
	findings->details[place] = detail;
	findings->error_count++;
}

static void add_warning(struct pen_findings *findings, const struct pen_control *control)
{
	char *warning;

	if (findings->warning_count == PEN_SCENE_WARNINGS_MAX)
		return;
	warning = plain_copy(control->reason, PEN_SCENE_WARNING_BYTES_MAX);
	if (warning)
		findings->warnings[findings->warning_count++] = warning;
}

void pen_findings_add(struct pen_findings *findings, const struct pen_control *control)
{
	assert(control->type == PEN_CONTROL_ERROR || control->type == PEN_CONTROL_WARNING);
	if (control->type == PEN_CONTROL_ERROR)
		add_error(findings, control);
	else
		add_warning(findings, control);
}

void pen_findings_finish(struct pen_findings *findings)
{
	for (uint32_t i = 0; i < findings->error_count; i++) {
		free(findings->pointers[i]);
		free(findings->details[i]);
	}
	for (uint32_t i = 0; i < findings->warning_count; i++)
		free(findings->warnings[i]);
	*findings = (struct pen_findings){0};
}

void pen_findings_report_errors(
	const struct pen_findings *findings, struct pen_msg_scene_report *report)
{
	report->error_count = findings->error_count;
	report->pointers = (const char *const *)findings->pointers;
	report->details = (const char *const *)findings->details;
}

void pen_findings_report_warnings(
	const struct pen_findings *findings, struct pen_msg_scene_report *report)
{
	report->warning_count = findings->warning_count;
	report->warnings = (const char *const *)findings->warnings;
}
