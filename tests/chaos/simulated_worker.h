/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_CHAOS_SIMULATED_WORKER_H
#define PEN_TESTS_CHAOS_SIMULATED_WORKER_H

#include "tests/chaos/world.h"

/* Workers that render nothing, but do so as long and as badly as the faults want. */
void sim_worker_handle(struct sim *sim, const struct event *event);

/* It asks to leave, finishes what it renders, and comes back later. */
void sim_worker_drain(struct sim *sim, uint32_t index);

/* The connection is lost, or the worker dead; it dials again after away_ms. */
void sim_worker_lose(struct sim *sim, uint32_t index, int64_t away_ms);

#endif
