/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_FINDINGS_H
#define PEN_WORKER_FINDINGS_H

#include "core/base/limits.h"
#include "proto/msg.h"
#include "worker/channel.h"

/*
 * What a scene process has told of its scene: errors and warnings, the first of each, with '?'
 * where they are no plain text. All 0 is an empty one; it may be moved by copying it.
 */
struct pen_findings {
	uint32_t error_count, warning_count;
	char *pointers[PEN_SCENE_ERRORS_MAX], *details[PEN_SCENE_ERRORS_MAX];
	char *warnings[PEN_SCENE_WARNINGS_MAX];
};

/* Takes an ERROR or a WARNING; one beyond the bounds, or without memory, is dropped. */
void pen_findings_add(struct pen_findings *findings, const struct pen_control *control);

/* Empties it. */
void pen_findings_finish(struct pen_findings *findings);

/* Adds the errors, or the warnings, to a report that has neither; the texts stay the findings'. */
void pen_findings_report_errors(
	const struct pen_findings *findings, struct pen_msg_scene_report *report);
void pen_findings_report_warnings(
	const struct pen_findings *findings, struct pen_msg_scene_report *report);

#endif
