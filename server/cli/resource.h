/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_RESOURCE_H
#define PEN_SERVER_CLI_RESOURCE_H

#include "core/base/error.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

enum { PEN_RESOURCE_ID_MAX = 64 };

/* What the client reads in a render resource. */
struct pen_resource {
	char id[PEN_RESOURCE_ID_MAX + 1]; /* letters and digits only: safe in a path */
	char state[16];
	double progress;    /* 0..1 */
	double eta_seconds; /* < 0: unknown */
	double seconds;	    /* of rendering so far */
	uint64_t samples_done;
	uint32_t frame_first, frames_total, frames_done;
};

/* PEN_EPROTOCOL when tree is no render resource. */
int pen_resource_read(const json_t *tree, struct pen_resource *ret_resource, struct pen_error *err);

/* Whether text can be a render's id. */
bool pen_resource_id_valid(const char *text);

/* Whether the render is done, failed or cancelled. */
bool pen_resource_over(const struct pen_resource *resource);

/* Why a failed render failed: the text that tree gives, or a stand-in. Borrowed from tree. */
const char *pen_resource_reason(const json_t *tree);

#endif
