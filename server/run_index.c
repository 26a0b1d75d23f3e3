/* SPDX-License-Identifier: Apache-2.0 */
#include "server/run_index.h"

/* False when it has no content address, or none can be made of it. */
static bool content_key(const struct pen_job *job, struct pen_sha256 *ret_key)
{
	struct pen_sha256 content;

	return pen_sha256_parse(job->content, &content) &&
	       pen_owner_mix(&job->owner, &content, ret_key, NULL) == 0;
}

void pen_run_index(struct pen_jobs *jobs, struct pen_run *run)
{
	struct pen_sha256 content;

	if (run->job.has_key)
		pen_job_index_put(&jobs->keys, &run->job.key, &run->job);
	if (run->job.state == PEN_JOB_DONE && !run->job.is_preview &&
		content_key(&run->job, &content))
		pen_job_index_put(&jobs->contents, &content, &run->job);
}

void pen_run_unindex(struct pen_jobs *jobs, const struct pen_run *run)
{
	struct pen_sha256 content;

	if (run->job.has_key)
		pen_job_index_drop(&jobs->keys, &run->job.key, &run->job);
	if (content_key(&run->job, &content))
		pen_job_index_drop(&jobs->contents, &content, &run->job);
}
