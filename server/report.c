/* SPDX-License-Identifier: Apache-2.0 */
#include "server/report.h"

static char *text_of(json_t *list)
{
	char *text = json_dumps(list, JSON_COMPACT);

	json_decref(list);
	return text;
}

char *pen_report_errors(const struct pen_msg_scene_report *report)
{
	json_t *list = json_array();

	for (uint32_t i = 0; i < report->error_count; i++)
		(void)json_array_append_new(
			list, json_pack("{s:s, s:s}", "pointer", report->pointers[i], "detail",
				      report->details[i]));
	return text_of(list);
}

char *pen_report_warnings(const struct pen_msg_scene_report *report)
{
	json_t *list = json_array();

	for (uint32_t i = 0; i < report->warning_count; i++)
		(void)json_array_append_new(list, json_string(report->warnings[i]));
	return text_of(list);
}

json_t *pen_report_json(const char *text)
{
	json_t *list = text ? json_loads(text, 0, NULL) : NULL;

	return list ? list : json_array();
}
