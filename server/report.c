/* SPDX-License-Identifier: Apache-2.0 */
#include "server/report.h"

#include "server/tree.h"

char *pen_report_errors(const struct pen_msg_scene_report *report)
{
	json_t *list = json_array();

	for (uint32_t i = 0; i < report->error_count; i++)
		pen_tree_append(&list, json_pack("{s:s, s:s}", "pointer", report->pointers[i],
					       "detail", report->details[i]));
	return pen_tree_text(list);
}

char *pen_report_warnings(const struct pen_msg_scene_report *report)
{
	json_t *list = json_array();

	for (uint32_t i = 0; i < report->warning_count; i++)
		pen_tree_append(&list, json_string(report->warnings[i]));
	return pen_tree_text(list);
}

json_t *pen_report_json(const char *text)
{
	json_error_t error = {0};
	json_t *list = text ? json_loads(text, 0, &error) : json_array();

	/* A lack of memory often has no text. */
	if (!list && error.text[0] != '\0' && json_error_code(&error) != json_error_out_of_memory)
		return json_array();
	return list;
}
