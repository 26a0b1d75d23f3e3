/* SPDX-License-Identifier: Apache-2.0 */
#include "server/sched_state.h"

#include <string.h>

/* What a unit is taken to cost while none of its job has been measured. */
#define UNMEASURED_SECONDS 0.01

/* How much a single unit changes the mean. */
#define MEAN_STEP 0.25

static double samples_of(const struct pen_sched_turn *job, const struct pen_sched_lease *lease)
{
	return (double)pen_backlog_samples(pen_reel_backlog(&job->reel, lease->frame), lease->tile);
}

double pen_sched_predict(const struct pen_sched_turn *job, const struct pen_sched_lease *lease)
{
	if (job->seconds_per_sample <= 0)
		return UNMEASURED_SECONDS;
	return job->seconds_per_sample * samples_of(job, lease);
}

void pen_sched_measure(struct pen_sched_turn *job, double seconds, double samples)
{
	const double pace = seconds / samples;

	job->seconds_per_sample +=
		(job->seconds_per_sample > 0 ? MEAN_STEP : 1.0) * (pace - job->seconds_per_sample);
	job->paces[job->pace_count++ % PEN_SCHED_PACES] = (float)pace;
}

static float median_pace(const struct pen_sched_turn *job)
{
	const uint32_t count =
		job->pace_count < PEN_SCHED_PACES ? job->pace_count : PEN_SCHED_PACES;
	float sorted[PEN_SCHED_PACES] = {0};

	for (uint32_t i = 0; i < count; i++) {
		uint32_t place = i;

		for (; place > 0 && sorted[place - 1] > job->paces[i]; place--)
			sorted[place] = sorted[place - 1];
		sorted[place] = job->paces[i];
	}
	return sorted[count / 2];
}

double pen_sched_lateness(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_sched_lease *lease)
{
	double usual_ms;

	if (job->pace_count == 0 || lease->begun_ms < 0)
		return 0;
	usual_ms = 1e3 * (double)median_pace(job) * samples_of(job, lease);
	return (double)(sched->now_ms - lease->begun_ms) /
	       (usual_ms > PEN_STRAGGLER_MS ? usual_ms : PEN_STRAGGLER_MS);
}

void pen_sched_note_begin(const struct pen_sched *sched, struct pen_sched_hand *worker)
{
	uint32_t begun = 0;

	for (uint32_t i = 0; i < worker->lease_max; i++)
		begun += worker->leases[i].id != 0 && worker->leases[i].begun_ms >= 0;
	while (begun < worker->processes && begun < worker->lease_count) {
		struct pen_sched_lease *oldest = NULL;

		for (uint32_t i = 0; i < worker->lease_max; i++) {
			struct pen_sched_lease *lease = &worker->leases[i];

			if (lease->id != 0 && lease->begun_ms < 0 &&
				(!oldest || lease->id < oldest->id))
				oldest = lease;
		}
		if (!oldest)
			return;
		oldest->begun_ms = sched->now_ms;
		begun++;
	}
}
