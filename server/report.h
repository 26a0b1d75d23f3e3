/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_REPORT_H
#define PEN_SERVER_REPORT_H

#include "proto/msg.h"

#include <jansson.h>

/*
 * What a worker has found in a job's scene, as the job, the store and the render resource have it:
 * JSON arrays, of {"pointer", "detail"} and of strings. The texts are heap; NULL without memory.
 */
char *pen_report_errors(const struct pen_msg_scene_report *report);
char *pen_report_warnings(const struct pen_msg_scene_report *report);

/* Such a text (or NULL, for nothing) as a tree. */
json_t *pen_report_json(const char *text);

#endif
