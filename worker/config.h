/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_CONFIG_H
#define PEN_WORKER_CONFIG_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "core/base/log.h"
#include "core/base/sandbox.h"
#include "core/render/render.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

/* What the command line asks for. */
struct pen_worker_config {
	char host[PEN_NAME_MAX + 1];
	char port[6];
	char name[PEN_NAME_MAX + 1];
	uint32_t processes; /* render processes */
	enum pen_isa isa;
	bool has_sandbox; /* asked for; else the coordinator's host decides */
	enum pen_sandbox_mode sandbox;
	enum pen_log_level log_level;
	enum pen_log_format log_format;
	uint64_t asset_bytes; /* of assets that are kept for later scenes */
	int key_fd;	      /* -1 without */
	const char *key_file; /* NULL: without */
	pid_t parent;	      /* end when it does; 0: live on */
	bool help, version;   /* asked for: print and leave */
};

/* PEN_EINVALID names the option and its cure. */
int pen_worker_config_parse(
	int argc, char **argv, struct pen_worker_config *ret_config, struct pen_error *err);

const char *pen_worker_config_usage(void);

#endif
