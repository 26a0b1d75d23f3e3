/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ALLOWANCE_H
#define PEN_SERVER_ALLOWANCE_H

#include "core/base/error.h"
#include "server/job.h"

/*
 * Whether one more render may wait: waiting_max of all together, and of one token
 * PEN_OWNER_JOBS_MAX with PEN_OWNER_SAMPLES_MAX samples to come; a token that waits for nothing may
 * ask for any one render. What the submission replaces makes room for it.
 *
 * PEN_ELIMIT, with submission->retry_s set to when there will be room, as far as that can be told:
 * from how fast renders go now, or PEN_RETRY_UNKNOWN_S while none does.
 */
int pen_allowance_check(
	const struct pen_jobs *jobs, struct pen_submission *submission, struct pen_error *err);

#endif
