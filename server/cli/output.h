/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_OUTPUT_H
#define PEN_SERVER_CLI_OUTPUT_H

#include "core/base/error.h"
#include "core/base/format.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * An image file that appears under its name only when it is whole: it is written beside it under
 * another name, which is gone after finish in any case.
 */
struct pen_output {
	const char *path; /* borrowed */
	enum pen_image_format format;
	char *temporary; /* NULL once it has its name */
	int fd;
};

/* The format that path's extension stands for; false when it stands for none. */
bool pen_output_format(const char *path, enum pen_image_format *ret_format);

/* Opens the file, so that a place that cannot be written to is told before the render. */
int pen_output_open(struct pen_output *output, const char *path, struct pen_error *err);

/* Gives the written file its name. */
int pen_output_commit(struct pen_output *output, struct pen_error *err);

void pen_output_finish(struct pen_output *output);

/* Whether path has a run of # in its last part, which stands for a frame's number. */
bool pen_output_has_frames(const char *path);

/* The path of one frame (heap): the number with as many digits as there are #. NULL: no memory. */
char *pen_output_frame_path(const char *path, uint32_t frame);

#endif
