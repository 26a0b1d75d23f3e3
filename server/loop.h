/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_LOOP_H
#define PEN_SERVER_LOOP_H

#include "core/base/error.h"
#include "server/config.h"

/*
 * The coordinator: everything on one loop. Serves until SIGTERM or SIGINT, then stops its workers
 * and returns 0 with all it holds stored; a second signal ends the process at once. Negative when
 * it cannot start, or when it can no longer store anything.
 */
int pen_server_run(const struct pen_config *config, struct pen_error *err);

#endif
