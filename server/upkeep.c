/* SPDX-License-Identifier: Apache-2.0 */
#include "server/upkeep.h"

#include "core/base/clock.h"
#include "core/base/log.h"
#include "server/disk.h"
#include "server/frame_file.h"
#include "server/seal.h"

enum {
	TICKS_PER_LOOK = 8,	/* at the disk: two seconds */
	TICKS_PER_SWEEP = 40,	/* of finished renders: ten */
	REMOVALS_PER_SWEEP = 64 /* the loop has other things to do */
};

static uint64_t frame_bytes(const struct pen_job *job)
{
	const struct pen_framebuf framebuf = pen_frame_file_shape(job);

	return pen_framebuf_bytes(&framebuf) + pen_quota_bytes(&framebuf) +
	       pen_seal_bytes(&framebuf);
}

uint64_t pen_upkeep_bytes(const struct pen_job *job)
{
	uint32_t frames = job->frames_done;

	/* Those that had begun when it ended are there, too. */
	if (job->state != PEN_JOB_DONE && job->units_done > 0)
		frames += job->frame_count - frames < PEN_REEL_FRAMES_MAX
				  ? job->frame_count - frames
				  : PEN_REEL_FRAMES_MAX;
	return frames * frame_bytes(job);
}

/* For room, on the disk or in memory. */
static bool waits(const struct pen_run *run)
{
	const int code = run->job.error.code;

	return run->job.state == PEN_JOB_PAUSED && !run->ending &&
	       (code == PEN_ENOSPACE || code == PEN_ENOMEM);
}

static struct pen_run *find_waiting(const struct pen_jobs *jobs)
{
	struct pen_run *run;

	TAILQ_FOREACH (run, &jobs->unfinished, unfinished)
		if (waits(run))
			return run;
	return NULL;
}

bool pen_upkeep_lacks_room(const struct pen_jobs *jobs)
{
	return find_waiting(jobs) != NULL;
}

/* One at a time: it may fill the disk again. */
static void resume_one(struct pen_jobs *jobs)
{
	struct pen_run *run = find_waiting(jobs);
	struct pen_error err;

	if (!run || pen_disk_check_path(jobs->options.data_dir, PEN_DISK_ACCEPT,
			    2 * frame_bytes(&run->job), NULL) < 0)
		return;
	pen_log_of(&(struct pen_log_about){.job = run->job.id, .trace = run->job.trace},
		PEN_LOG_INFO, "render %s goes on: there is room", run->job.id);
	if (pen_jobs_set_state(jobs, &run->job, PEN_JOB_RUNNING, NULL, NULL, &err) < 0)
		pen_log_of(&(struct pen_log_about){.job = run->job.id, .trace = run->job.trace},
			PEN_LOG_WARNING, "render %s: %s", run->job.id, err.text);
}

static bool is_outdated(const struct pen_jobs *jobs, const struct pen_job *job, uint64_t bytes)
{
	const int64_t keep_ms = 1000 * (int64_t)jobs->options.keep_renders_s;

	return (keep_ms > 0 && job->finished_ms + keep_ms <= pen_clock_wall_ms()) ||
	       (jobs->options.keep_bytes > 0 && bytes > jobs->options.keep_bytes);
}

/* From the newest on: bytes is what a render and all newer ones take. */
static void remove_outdated(struct pen_jobs *jobs)
{
	struct pen_job *job = pen_jobs_older(jobs, UINT64_MAX), *next;
	uint32_t removals = 0;
	struct pen_error err;

	for (uint64_t bytes = 0; job && removals < REMOVALS_PER_SWEEP; job = next) {
		const struct pen_run *run = (const struct pen_run *)job;

		next = pen_jobs_older(jobs, job->number);
		bytes += pen_upkeep_bytes(job);
		if (!pen_job_is_over(job->state) || run->ending || job->is_preview ||
			!is_outdated(jobs, job, bytes))
			continue;
		if (pen_jobs_delete(jobs, job, NULL, NULL, &err) < 0)
			return;
		pen_log_of(&(struct pen_log_about){.job = job->id, .trace = job->trace},
			PEN_LOG_INFO, "render %s is removed: it is no longer to be kept", job->id);
		removals++;
	}
}

void pen_upkeep_tick(struct pen_jobs *jobs)
{
	const uint64_t tick = jobs->ticks++;

	if (tick % TICKS_PER_LOOK == 0) {
		pen_ballast_fill(jobs->options.data_dir);
		resume_one(jobs);
	}
	if (tick % TICKS_PER_SWEEP == 0 &&
		(jobs->options.keep_renders_s > 0 || jobs->options.keep_bytes > 0))
		remove_outdated(jobs);
}
