/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_JOB_TEXTS_H
#define PEN_SERVER_JOB_TEXTS_H

#include "core/base/error.h"
#include "server/job.h"

/* The texts of a job that stand in memory of their own. */

/* job is a plain copy: gives it texts of its own. On PEN_ENOMEM it has none. */
int pen_job_texts_copy(struct pen_job *job, struct pen_error *err);

void pen_job_texts_free(struct pen_job *job);

#endif
