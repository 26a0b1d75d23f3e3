/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_HELPER_H
#define PEN_SERVER_HELPER_H

#include "core/base/error.h"
#include "core/base/sandbox.h"
#include "server/encoding.h"

#include <stdbool.h>
#include <uv.h>

/* One penumbra-encoder process, which does one request at a time (server/encoding.h). */
struct pen_helper;

/*
 * From the loop: the reply to the request that was sent, or NULL when the process has ended, by
 * itself or because a request took too long; after NULL the helper only waits to be destroyed.
 */
typedef void pen_helper_fn(void *user, const struct pen_encoding_reply *reply);

int pen_helper_create(uv_loop_t *loop, const char *program, enum pen_sandbox_mode sandbox,
	pen_helper_fn *fn, void *user, struct pen_helper **ret_helper, struct pen_error *err);

/*
 * The helper must be idle. The descriptors stay the caller's, who may close them at once. A process
 * that cannot be sent to is ended, which fn tells.
 */
void pen_helper_send(struct pen_helper *helper, const struct pen_encoding_request *request,
	int framebuffer_fd, int file_fd);

/* Ends the process; fn is not called any more; memory goes when the loop has seen the end. */
void pen_helper_destroy(struct pen_helper *helper);

#endif
