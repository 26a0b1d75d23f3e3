/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_RUN_INDEX_H
#define PEN_SERVER_RUN_INDEX_H

#include "server/run.h"

/* So that it is found by its key, and by its content when it is done; and no longer. */
void pen_run_index(struct pen_jobs *jobs, struct pen_run *run);
void pen_run_unindex(struct pen_jobs *jobs, const struct pen_run *run);

#endif
