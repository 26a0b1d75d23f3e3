/* SPDX-License-Identifier: Apache-2.0 */
#include "server/fsck.h"

#include "server/archive.h"
#include "server/frame_file.h"
#include "server/scene_file.h"
#include "server/seal.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

struct fsck {
	const char *dir;
	char scenes[PATH_MAX];
	struct pen_archive *archive;
	struct pen_fsck_report *report;
	uint64_t *broken; /* numbers of renders with a frame that is damaged or gone */
	size_t count, capacity;
};

__attribute__((format(printf, 2, 3))) static void tell(
	const struct fsck *fsck, const char *format, ...)
{
	char sentence[PATH_MAX + 256];
	va_list args;

	va_start(args, format);
	(void)vsnprintf(sentence, sizeof sentence, format, args);
	va_end(args);
	fsck->report->faults++;
	fsck->report->told(sentence);
}

static void tell_database(void *user, const char *fault)
{
	tell(user, "database: %s", fault);
}

static int note_broken(struct fsck *fsck, uint64_t number, struct pen_error *err)
{
	if (fsck->count > 0 && fsck->broken[fsck->count - 1] == number)
		return 0;
	if (fsck->count == fsck->capacity) {
		size_t capacity = 2 * fsck->capacity + 16;
		uint64_t *moved = reallocarray(fsck->broken, capacity, sizeof *moved);

		if (!moved)
			return pen_error_memory(err);
		fsck->broken = moved;
		fsck->capacity = capacity;
	}
	fsck->broken[fsck->count++] = number;
	return 0;
}

/* A file that a power cut took is made again at the next start if the database has its text. */
static void check_scene(struct fsck *fsck, const struct pen_job *job)
{
	uint64_t size = 0;
	int fd = -1;

	if (pen_scene_file_is_whole(fsck->scenes, &job->scene_sha256) ||
		pen_archive_has_scene(fsck->archive, &job->scene_sha256))
		return;
	if (pen_scene_file_open(fsck->scenes, &job->scene_sha256, &fd, &size, NULL) < 0) {
		tell(fsck, "render %s: its scene is gone", job->id);
		return;
	}
	tell(fsck, "render %s: its scene is damaged", job->id);
	(void)close(fd);
}

/* 1: there is a fault, which has been told. */
static int check_frame(
	struct fsck *fsck, const struct pen_job *job, uint32_t frame, struct pen_error *err)
{
	const struct pen_framebuf framebuf = pen_frame_file_shape(job);
	enum pen_seal_finding finding = PEN_SEAL_ABSENT;
	char path[PATH_MAX];
	struct stat status;
	uint32_t tile = 0;
	int fd, r;

	pen_frame_file_path(fsck->dir, job, frame, path);
	fd = open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0 && errno == ENOENT) {
		tell(fsck, "render %s: frame %u is gone", job->id, frame);
		return 1;
	}
	if (fd < 0)
		return pen_error_system(err, errno, "cannot open %s", path);
	r = pen_seal_check(fd, &framebuf, &finding, &tile, err);
	if (r == 0 && finding == PEN_SEAL_BROKEN) {
		tell(fsck, "render %s: tile %u of frame %u is damaged", job->id, tile, frame);
		r = 1;
	} else if (r == 0 && (fstat(fd, &status) < 0 ||
				     (uint64_t)status.st_size < pen_framebuf_bytes(&framebuf))) {
		tell(fsck, "render %s: frame %u is cut short", job->id, frame);
		r = 1;
	}
	(void)close(fd);
	fsck->report->frames++;
	return r;
}

/* Frames of unfinished renders that are not on the disk are checked by the coordinator itself. */
static int check_job(void *user, const struct pen_job *job, struct pen_error *err)
{
	struct fsck *fsck = user;
	int r = 0;

	fsck->report->renders++;
	if (!job) {
		tell(fsck, "database: a render's row is damaged");
		return 0;
	}
	check_scene(fsck, job);
	for (uint32_t i = 0; r >= 0 && i < job->frames_done; i++) {
		r = check_frame(fsck, job, job->frame_first + i, err);
		if (r > 0)
			r = note_broken(fsck, job->number, err);
	}
	return r;
}

static int look(struct fsck *fsck, bool repair, struct pen_error *err)
{
	int r = pen_archive_check(fsck->archive, tell_database, fsck, err);

	if (r == 0)
		r = pen_archive_jobs(fsck->archive, check_job, fsck, err);
	for (size_t i = 0; r == 0 && repair && i < fsck->count; i++) {
		r = pen_archive_render_again(fsck->archive, fsck->broken[i], err);
		fsck->report->repaired += r == 0;
	}
	return r;
}

int pen_fsck(const char *dir, bool repair, struct pen_fsck_report *report, struct pen_error *err)
{
	struct fsck fsck = {.dir = dir, .report = report};
	int r = pen_archive_open(dir, repair, &fsck.archive, err);

	(void)snprintf(fsck.scenes, sizeof fsck.scenes, "%s/scenes", dir);
	if (r == 0)
		r = look(&fsck, repair, err);
	pen_archive_close(fsck.archive);
	free(fsck.broken);
	return r;
}
