/* SPDX-License-Identifier: Apache-2.0 */
#include "server/allowance.h"

#include "core/base/limits.h"
#include "server/run.h"

#include <math.h>
#include <string.h>

/* What waits, of one owner or of all. */
struct backlog_sum {
	const struct pen_owner *owner; /* NULL: of all */
	const char *replaced;	       /* not counted */
	uint32_t count;
	uint64_t samples; /* to come */
	double rate;	  /* of them a second, now */
	double soonest_s; /* until one of the renders ends; < 0: nobody knows */
};

static void add(struct backlog_sum *sum, const struct pen_run *run)
{
	const struct pen_job *job = &run->job;
	const uint64_t total = pen_job_samples(job);
	const uint64_t left = total > job->samples_done ? total - job->samples_done : 0;

	if (run->ending || strcmp(job->id, sum->replaced) == 0 ||
		(sum->owner && !pen_owner_equal(sum->owner, &job->owner)))
		return;
	sum->count++;
	sum->samples += left;
	if (job->state != PEN_JOB_RUNNING || job->eta_seconds < 0)
		return;
	sum->rate += (double)left / fmax(job->eta_seconds, 1e-3);
	if (sum->soonest_s < 0 || job->eta_seconds < sum->soonest_s)
		sum->soonest_s = job->eta_seconds;
}

static struct backlog_sum sum_of(
	const struct pen_jobs *jobs, const struct pen_owner *owner, const char *replaced)
{
	struct backlog_sum sum = {.owner = owner, .replaced = replaced, .soonest_s = -1};
	const struct pen_run *run;

	TAILQ_FOREACH (run, &jobs->unfinished, unfinished) {
		add(&sum, run);
	}
	TAILQ_FOREACH (run, &jobs->accepting, unfinished) {
		add(&sum, run);
	}
	return sum;
}

static uint32_t seconds_until(double seconds)
{
	if (seconds < 0)
		return PEN_RETRY_UNKNOWN_S;
	return seconds < PEN_RETRY_S_MAX ? (uint32_t)fmax(ceil(seconds), 1) : PEN_RETRY_S_MAX;
}

static uint64_t samples_of(const struct pen_scene *scene)
{
	return pen_rect_area(scene->image.crop) * scene->sampling.samples *
	       (scene->frames.last - scene->frames.first + 1);
}

static int check_owner(
	const struct pen_jobs *jobs, struct pen_submission *submission, struct pen_error *err)
{
	const struct backlog_sum sum = sum_of(jobs, &submission->owner, submission->replaces);
	const uint64_t samples = samples_of(submission->scene);

	if (sum.count >= PEN_OWNER_JOBS_MAX) {
		submission->retry_s = seconds_until(sum.soonest_s);
		return pen_error_set(err, PEN_ELIMIT, "%u renders of this token wait already",
			PEN_OWNER_JOBS_MAX);
	}
	if (sum.count > 0 && sum.samples + samples > PEN_OWNER_SAMPLES_MAX) {
		const double excess = (double)(sum.samples + samples - PEN_OWNER_SAMPLES_MAX);

		submission->retry_s = seconds_until(sum.rate > 0 ? excess / sum.rate : -1);
		return pen_error_set(err, PEN_ELIMIT,
			"the renders of this token that wait have too many samples already");
	}
	return 0;
}

int pen_allowance_check(
	const struct pen_jobs *jobs, struct pen_submission *submission, struct pen_error *err)
{
	if (submission->owner.is_known && check_owner(jobs, submission, err) < 0)
		return PEN_ELIMIT;
	if (jobs->unfinished_count < jobs->options.waiting_max)
		return 0;
	submission->retry_s = seconds_until(sum_of(jobs, NULL, submission->replaces).soonest_s);
	return pen_error_set(err, PEN_ELIMIT, "%u renders wait already", jobs->options.waiting_max);
}
