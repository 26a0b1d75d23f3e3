/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_RENDERS_H
#define PEN_SERVER_CLI_RENDERS_H

#include "core/base/buf.h"
#include "core/base/format.h"
#include "server/cli/client.h"
#include "server/cli/progress.h"
#include "server/cli/resource.h"

/* What a client does with renders. Each leaves the server's answer in client. */

/* Submits a scene with override, a JSON Merge Patch onto it (NULL: as it is). */
int pen_renders_submit(struct pen_client *client, const struct pen_buf *scene,
	const json_t *override, struct pen_resource *ret_resource, struct pen_error *err);

int pen_renders_get(struct pen_client *client, const char *id, struct pen_resource *ret_resource,
	struct pen_error *err);

/* state: "cancelled", "paused" or "running". */
int pen_renders_set_state(struct pen_client *client, const char *id, const char *state,
	struct pen_resource *ret_resource, struct pen_error *err);

/* priority: 0..100; the server refuses others. */
int pen_renders_set_priority(struct pen_client *client, const char *id, unsigned priority,
	struct pen_resource *ret_resource, struct pen_error *err);

/*
 * Asks again and again, at most every interval_ms, until the render is over, showing progress.
 * A server that has gone may come back within patience_ms.
 */
struct pen_follow {
	int64_t interval_ms;
	int64_t patience_ms;
	struct pen_progress *progress;
	/* May be NULL: called with each answer; a failure ends the following. */
	int (*news)(void *user, const struct pen_resource *resource, struct pen_error *err);
	void *user;
};

int pen_renders_follow(struct pen_client *client, const struct pen_follow *follow,
	struct pen_resource *resource, struct pen_error *err);

/* 0 when the render is done, else an error that says how and why it ended. */
int pen_renders_outcome(
	struct pen_client *client, const struct pen_resource *resource, struct pen_error *err);

/* Writes the image to fd, of one frame (0: whichever the server has); waits while the server has
 * too many to encode. */
int pen_renders_download(struct pen_client *client, const char *id, uint32_t frame,
	enum pen_image_format format, int fd, struct pen_error *err);

#endif
