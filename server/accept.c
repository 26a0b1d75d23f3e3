/* SPDX-License-Identifier: Apache-2.0 */
#include "server/accept.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "core/scene/planes.h"
#include "server/disk.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

int pen_accept_check_disk(const char *dir, const struct pen_scene *scene, struct pen_error *err)
{
	/* Frames of a long animation are the disk's concern as they come. */
	uint32_t frames = scene->frames.last - scene->frames.first + 1;
	uint64_t need =
		pen_rect_area(scene->image.crop) * pen_scene_film(scene).channels * sizeof(float);

	need *= frames < PEN_JOB_FRAMES_MAX ? frames : PEN_JOB_FRAMES_MAX;
	return pen_disk_check_path(dir, PEN_DISK_ACCEPT, need, err);
}

/* 128 random bits in RFC 4648 base32, lower case, without padding. */
static int make_id(char *ret_id, struct pen_error *err)
{
	static const char digits[] = "abcdefghijklmnopqrstuvwxyz234567";
	unsigned char bits[16];

	if (getrandom(bits, sizeof bits, 0) != sizeof bits)
		return pen_error_system(err, errno, "no random bits");
	for (unsigned i = 0; i < PEN_JOB_ID_TEXT - 1; i++) {
		unsigned byte = 5 * i / 8;
		unsigned pair = (unsigned)bits[byte] << 8;

		if (byte + 1 < sizeof bits)
			pair |= bits[byte + 1];
		ret_id[i] = digits[pair >> (11 - 5 * i % 8) & 31];
	}
	ret_id[PEN_JOB_ID_TEXT - 1] = '\0';
	return 0;
}

int pen_accept_fill(const struct pen_submission *submission, uint32_t tile_px,
	struct pen_job *ret_job, struct pen_error *err)
{
	const struct pen_scene *scene = submission->scene;
	struct pen_job job = {
		.state = PEN_JOB_QUEUED,
		.owner = submission->owner,
		.scene_sha256 = submission->sha256,
		.has_world = submission->has_world,
		.world = submission->world,
		.is_preview = submission->is_preview,
		.verify = submission->verify,
		.has_key = submission->has_key,
		.key = submission->key,
		.key_body = submission->key_body,
		.width = scene->image.width,
		.height = scene->image.height,
		.frame_first = scene->frames.first,
		.frame_count = scene->frames.last - scene->frames.first + 1,
		.sampling = scene->sampling,
		.aovs = scene->image.aovs,
		.exposure = scene->image.exposure,
		.created_ms = pen_clock_wall_ms(),
		.eta_seconds = -1,
		.revision = 1,
	};
	struct pen_rounds rounds;
	int r = make_id(job.id, err);

	memcpy(job.trace, submission->trace, sizeof job.trace);

	if (submission->deadline_s > 0)
		job.deadline_ms = job.created_ms + (int64_t)ceil(1e3 * submission->deadline_s);
	if (r == 0 && submission->name && !(job.name = strdup(submission->name)))
		r = pen_error_memory(err);
	if (r < 0)
		return r;
	pen_tiling_init(&job.tiling, scene->image.crop, tile_px);
	rounds = pen_sampling_rounds(&job.sampling);
	job.units_total = (uint64_t)job.frame_count * job.tiling.count * pen_round_count(&rounds);
	*ret_job = job;
	return 0;
}
