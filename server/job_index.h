/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_JOB_INDEX_H
#define PEN_SERVER_JOB_INDEX_H

#include "core/base/digest.h"
#include "server/job.h"

/* Jobs by a digest; the newest of those that share one. */
struct pen_job_index {
	void *entries;
};

void pen_job_index_finish(struct pen_job_index *index);

/* Without memory for it nobody will find it. */
void pen_job_index_put(
	struct pen_job_index *index, const struct pen_sha256 *key, struct pen_job *job);

/* Does nothing when another job has taken its place. */
void pen_job_index_drop(
	struct pen_job_index *index, const struct pen_sha256 *key, const struct pen_job *job);

/* NULL when there is none. */
struct pen_job *pen_job_index_find(const struct pen_job_index *index, const struct pen_sha256 *key);

#endif
