/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_CHAOS_SIMULATED_COORDINATOR_H
#define PEN_TESTS_CHAOS_SIMULATED_COORDINATOR_H

#include "tests/chaos/world.h"

/*
 * The real dispatch and scheduler, with simulated connections, framebuffers and rows around them,
 * and the ledger that they are checked against.
 */
void sim_coordinator_start(struct sim *sim);

/* It dies and another one starts; power: what is not synced may be lost. */
void sim_coordinator_restart(struct sim *sim, bool power);

/* An event of a job, or a message of a worker; late ones are dropped. */
void sim_coordinator_handle(struct sim *sim, const struct event *event);

/* What users do. */
void sim_coordinator_pause(struct sim *sim, struct sim_job *job, bool paused);
void sim_coordinator_cancel(struct sim *sim, struct sim_job *job);

#endif
