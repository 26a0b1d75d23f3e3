/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SUBMISSION_H
#define PEN_SERVER_SUBMISSION_H

#include "core/base/error.h"
#include "core/scene/parse.h"
#include "server/job.h"

#include <stddef.h>

struct pen_shelf;

/*
 * What the body of a POST asks for: a scene, or the envelope {"scene", "override", "options"}.
 * Reading it touches nothing else but the shelf, which has the scenes that are named by their hash,
 * so that any thread may do it.
 */
struct pen_submission_reading {
	struct pen_submission submission; /* its name lies in name; unset after a failure */
	char name[PEN_NAME_MAX + 1];
	struct pen_scene_errors errors; /* of a failure, when count > 0 */
	const char *prefix;		/* of the pointers in errors: "" or "/scene" */
};

/*
 * On failure err tells why, and errors each offender if there is a place to point at. On success
 * the caller owns scene and canonical of the submission.
 */
int pen_submission_read(const char *text, size_t size, struct pen_shelf *shelf,
	struct pen_submission_reading *ret_reading, struct pen_error *err);

#endif
