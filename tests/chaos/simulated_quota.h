/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_CHAOS_SIMULATED_QUOTA_H
#define PEN_TESTS_CHAOS_SIMULATED_QUOTA_H

#include "tests/chaos/world.h"

/*
 * What the pixels of a simulated job turn out to need where that is decided between rounds: drawn
 * from the numbers of job and cell, so that it is the same however often it is asked.
 */

/* What is known of a cell's needs after a decision at so many rounds; 0: before the first. */
struct pen_demand sim_quota_demand(const struct sim_job *job, uint32_t cell, uint32_t decided);

/* After how many rounds the decision that follows this one is made. */
uint32_t sim_quota_next(const struct sim_job *job, uint32_t decided);

/* Which pixels take part in a round; false: all. */
bool sim_quota_mask(const struct sim_job *job, uint32_t tile, uint32_t round, uint8_t *ret_mask);

/* Whether every tile of a frame has what it shall have; ret_final: and will need no more. */
bool sim_quota_is_met(const struct sim_job *job, uint32_t frame, bool *ret_final);

/* Whether a frame has all that it will ever need; how many have, from the first on. */
bool sim_quota_is_final(const struct sim_job *job, uint32_t frame);
uint32_t sim_quota_final_frames(const struct sim_job *job);

#endif
