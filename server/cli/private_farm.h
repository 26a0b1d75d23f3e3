/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_PRIVATE_FARM_H
#define PEN_SERVER_CLI_PRIVATE_FARM_H

#include "core/base/error.h"

#include <stdint.h>
#include <sys/types.h>

/*
 * A coordinator with its workers for one command alone: a child that runs `penumbra serve` on
 * loopback ports of the system's choice, its data in a directory that nobody else can read and
 * that goes when the farm stops. The child ends when this process does.
 */
struct pen_private_farm {
	char directory[256];
	pid_t pid; /* of the coordinator; also its process group. 0: not running */
	uint16_t port;
};

struct pen_private_farm_options {
	const char *processes; /* NULL: serve's default */
	const char *isa;       /* NULL: serve's default */
};

/* Returns when the coordinator takes requests. On failure nothing is left behind. */
int pen_private_farm_start(struct pen_private_farm *farm,
	const struct pen_private_farm_options *options, struct pen_error *err);

/*
 * When the coordinator has ended by itself, replaces err's text by what it said last: that is the
 * reason why it stopped answering.
 */
void pen_private_farm_explain(struct pen_private_farm *farm, struct pen_error *err);

/* Ends the coordinator, by force after some seconds, and removes the directory. */
void pen_private_farm_stop(struct pen_private_farm *farm);

#endif
