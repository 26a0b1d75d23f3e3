/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_PROGRESS_H
#define PEN_SERVER_CLI_PROGRESS_H

#include "server/cli/resource.h"

#include <stdbool.h>
#include <stdint.h>

enum pen_progress_style { PEN_PROGRESS_NONE, PEN_PROGRESS_LINES, PEN_PROGRESS_BAR };

/* How far a render is, on standard error: a bar on a terminal, else a line every few seconds. */
struct pen_progress {
	enum pen_progress_style style;
	int64_t shown_ms; /* when something was shown last */
	bool drawn;	  /* a bar stands on the line */
};

void pen_progress_init(struct pen_progress *progress, bool quiet);

/* Shows the render's state when it is time to. */
void pen_progress_update(struct pen_progress *progress, const struct pen_resource *resource);

/* Shows that a share (0..1) of a file has been uploaded, when it is time to. */
void pen_progress_transfer(struct pen_progress *progress, const char *name, double share);

/* Takes the bar away, so that the next text starts on an empty line. */
void pen_progress_finish(struct pen_progress *progress);

#endif
