/* SPDX-License-Identifier: Apache-2.0 */
#include "server/frame_file.h"

#include <limits.h>
#include <stdio.h>

void pen_frame_file_path(
	const char *data_dir, const struct pen_job *job, uint32_t frame, char *ret_path)
{
	if (job->frame_count == 1)
		(void)snprintf(ret_path, PATH_MAX, "%s/frames/%s.f32", data_dir, job->id);
	else
		(void)snprintf(ret_path, PATH_MAX, "%s/frames/%s.%u.%u.f32", data_dir, job->id,
			job->restarts, frame);
}

struct pen_framebuf pen_frame_file_shape(const struct pen_job *job)
{
	const struct pen_sampling_desc *sampling = &job->sampling;

	return (struct pen_framebuf){
		.tiling = job->tiling,
		.film = pen_job_film(job),
		.rounds = pen_sampling_rounds(sampling),
		.threshold = sampling->threshold,
		.error = sampling->error,
		.confidence = sampling->confidence,
	};
}
