/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_POOL_H
#define PEN_WORKER_POOL_H

#include "worker/config.h"
#include "worker/key.h"
#include "worker/zygote.h"

/* Exit codes of the program. */
enum { PEN_WORKER_DONE = 0, PEN_WORKER_FAILED = 1, PEN_WORKER_USAGE = 2, PEN_WORKER_REFUSED = 3 };

/*
 * The pool process: takes leases from the coordinator, keeps them in order of arrival, gives each
 * free slot one unit of a scene that is ready, watches deadlines, and sends results, failures and
 * heartbeats. key is borrowed. A slot renders one unit at a time over all scenes. It never renders
 * and never reads a scene itself. Returns an exit code, after SIGTERM or SIGINT, a refusal, or an
 * error in *err.
 */
int pen_pool_run(const struct pen_worker_config *config, const struct pen_zygote *zygote,
	const struct pen_key *key, struct pen_error *err);

#endif
