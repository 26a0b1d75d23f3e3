/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SPAWN_H
#define PEN_SERVER_SPAWN_H

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/base/sandbox.h"
#include "server/farm.h"

#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

/*
 * The local worker: a penumbra-worker process that dies with this one, and is started again,
 * with growing pauses (0.1 to 30 s), whenever it ends.
 */
struct pen_spawn;

struct pen_spawn_options {
	struct pen_farm *farm; /* that it connects to, on loopback */
	const char *host;      /* "127.0.0.1" or "[::1]" */
	uint32_t processes;
	const char *isa; /* "v3"; NULL: its best */
	enum pen_log_level log_level;
	enum pen_log_format log_format;
	enum pen_sandbox_mode sandbox;
};

/* Borrows what options point to. A program that cannot be started is an error only this time. */
int pen_spawn_create(uv_loop_t *loop, const struct pen_spawn_options *options,
	struct pen_spawn **ret_spawn, struct pen_error *err);

/* Ends the worker: SIGTERM, SIGKILL three seconds later; memory goes when the loop has run. */
void pen_spawn_destroy(struct pen_spawn *spawn);

#endif
