/* SPDX-License-Identifier: Apache-2.0 */
#include "server/preview.h"

#include "server/run_index.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static int write_all(int fd, const char *text, size_t size)
{
	while (size > 0) {
		ssize_t n = write(fd, text, size);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0)
			return -errno;
		text += n;
		size -= (size_t)n;
	}
	return 0;
}

int pen_preview_keep_text(struct pen_run *run, char *text, size_t size, struct pen_error *err)
{
	int fd = memfd_create("pen-preview", MFD_CLOEXEC);
	int r = fd < 0 ? -errno : write_all(fd, text, size);

	free(text);
	if (r < 0) {
		if (fd >= 0)
			(void)close(fd);
		return pen_error_system(err, -r, "no memory for the preview's scene");
	}
	run->text = fd;
	return 0;
}

static const struct pen_run *find_text(const struct pen_jobs *jobs, const struct pen_sha256 *sha256)
{
	struct pen_run *run;

	TAILQ_FOREACH (run, &jobs->unfinished, unfinished)
		if (run->text >= 0 && pen_sha256_equal(&run->job.scene_sha256, sha256))
			return run;
	return NULL;
}

bool pen_preview_open_text(const struct pen_jobs *jobs, const struct pen_sha256 *sha256,
	int *ret_fd, uint64_t *ret_size)
{
	const struct pen_run *run = find_text(jobs, sha256);
	struct stat status;
	int fd;

	if (!run || fstat(run->text, &status) < 0)
		return false;
	fd = fcntl(run->text, F_DUPFD_CLOEXEC, 3);
	if (fd < 0)
		return false;
	*ret_fd = fd;
	*ret_size = (uint64_t)status.st_size;
	return true;
}

static void forget(struct pen_jobs *jobs, struct pen_run *run)
{
	pen_preview_leaves(jobs, run);
	pen_run_unindex(jobs, run);
	pen_run_unlink(jobs, &run->job);
	pen_job_table_forget(&jobs->table, &run->job);
	pen_run_destroy(run);
}

void pen_preview_ended(struct pen_jobs *jobs, struct pen_run *run)
{
	if (run->text >= 0)
		(void)close(run->text);
	run->text = -1;
	TAILQ_INSERT_TAIL(&jobs->previews, run, unfinished);
	if (++jobs->preview_count > PEN_PREVIEWS_KEPT_MAX)
		forget(jobs, TAILQ_FIRST(&jobs->previews));
}

void pen_preview_leaves(struct pen_jobs *jobs, struct pen_run *run)
{
	TAILQ_REMOVE(&jobs->previews, run, unfinished);
	jobs->preview_count--;
}
