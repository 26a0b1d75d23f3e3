/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_UPKEEP_H
#define PEN_SERVER_UPKEEP_H

#include "server/run.h"

#include <stdbool.h>

/*
 * What the coordinator does now and then, unasked: renders that were paused because the disk was
 * full go on when it no longer is, and finished ones are removed, oldest first, when they are older
 * or take more room than the operator allows. To be called every PEN_RUN_TICK_MS.
 */
void pen_upkeep_tick(struct pen_jobs *jobs);

/* Whether a render waits for room on the disk, or for memory. */
bool pen_upkeep_lacks_room(const struct pen_jobs *jobs);

/* Bytes that the frames of a render take on the disk, those that it has. */
uint64_t pen_upkeep_bytes(const struct pen_job *job);

#endif
