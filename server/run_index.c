/* SPDX-License-Identifier: Apache-2.0 */
#include "server/run_index.h"

void pen_run_index(struct pen_jobs *jobs, struct pen_run *run)
{
	struct pen_sha256 content;

	if (run->job.has_key)
		pen_job_index_put(&jobs->keys, &run->job.key, &run->job);
	if (run->job.state == PEN_JOB_DONE && !run->job.is_preview &&
		pen_sha256_parse(run->job.content, &content))
		pen_job_index_put(&jobs->contents, &content, &run->job);
}

void pen_run_unindex(struct pen_jobs *jobs, const struct pen_run *run)
{
	struct pen_sha256 content;

	if (run->job.has_key)
		pen_job_index_drop(&jobs->keys, &run->job.key, &run->job);
	if (pen_sha256_parse(run->job.content, &content))
		pen_job_index_drop(&jobs->contents, &content, &run->job);
}
