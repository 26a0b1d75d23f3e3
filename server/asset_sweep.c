/* SPDX-License-Identifier: Apache-2.0 */
#include "server/asset_sweep.h"

#include "core/base/digest.h"
#include "core/base/log.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { FIRST_MS = 2000, EVERY_MS = 3600 * 1000 };

static const char prefix[] = "\"sha256:";

struct pen_asset_sweep {
	uv_timer_t timer;
	uv_work_t work;
	const char *assets_dir, *scenes_dir, *kept_dir;
	uint32_t keep_s;
	bool working, destroyed;
};

/* Assets that are old enough to go. */
struct candidates {
	struct pen_sha256 *items;
	bool *named; /* by a scene */
	size_t count;
	bool failed; /* no memory: nothing goes */
};

static int compare(const void *a, const void *b)
{
	return memcmp(a, b, sizeof(struct pen_sha256));
}

static bool is_old(int dir, const char *name, uint32_t keep_s)
{
	struct stat status;

	return fstatat(dir, name, &status, AT_SYMLINK_NOFOLLOW) == 0 &&
	       time(NULL) - status.st_mtim.tv_sec >= (time_t)keep_s;
}

static void add(struct candidates *candidates, const struct pen_sha256 *sha256)
{
	struct pen_sha256 *items =
		realloc(candidates->items, (candidates->count + 1) * sizeof *candidates->items);

	if (!items) {
		candidates->failed = true;
		return;
	}
	candidates->items = items;
	items[candidates->count++] = *sha256;
}

static void collect(DIR *assets, uint32_t keep_s, struct candidates *candidates)
{
	const struct dirent *entry;
	struct pen_sha256 sha256;

	while ((entry = readdir(assets)) && !candidates->failed)
		if (strlen(entry->d_name) == PEN_SHA256_TEXT - 1 &&
			pen_sha256_parse(entry->d_name, &sha256) &&
			is_old(dirfd(assets), entry->d_name, keep_s))
			add(candidates, &sha256);
	if (candidates->count > 0)
		qsort(candidates->items, candidates->count, sizeof *candidates->items, compare);
	candidates->named = calloc(candidates->count + 1, sizeof *candidates->named);
	candidates->failed |= !candidates->named;
}

/* Whatever looks like a name counts as one: a text that only quotes it keeps the asset, no more. */
static void mark_names(const char *text, size_t size, struct candidates *candidates)
{
	const char *end = text + size, *at = text;
	struct pen_sha256 sha256;

	while ((at = memmem(at, (size_t)(end - at), prefix, strlen(prefix)))) {
		const struct pen_sha256 *found = NULL;

		at += strlen(prefix);
		if (end - at >= PEN_SHA256_TEXT - 1 && pen_sha256_parse(at, &sha256))
			found = bsearch(&sha256, candidates->items, candidates->count,
				sizeof *candidates->items, compare);
		if (found)
			candidates->named[found - candidates->items] = true;
	}
}

static void mark_scene(int dir, const char *name, struct candidates *candidates)
{
	int fd = openat(dir, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
	struct stat status;
	void *text;

	if (fd < 0)
		return;
	if (fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0) {
		text = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
		if (text == MAP_FAILED) {
			candidates->failed = true;
		} else {
			mark_names(text, (size_t)status.st_size, candidates);
			(void)munmap(text, (size_t)status.st_size);
		}
	}
	(void)close(fd);
}

static void mark_scenes(const char *scenes_dir, struct candidates *candidates)
{
	DIR *scenes = opendir(scenes_dir);
	const struct dirent *entry;

	if (!scenes) {
		candidates->failed = true;
		return;
	}
	while ((entry = readdir(scenes)))
		if (entry->d_name[0] != '.')
			mark_scene(dirfd(scenes), entry->d_name, candidates);
	(void)closedir(scenes);
}

/* One that has been wanted since it was looked at first is young again. */
static unsigned remove_unnamed(int dir, const struct candidates *candidates, uint32_t keep_s)
{
	char name[PEN_SHA256_TEXT];
	unsigned removed = 0;

	for (size_t i = 0; i < candidates->count; i++) {
		pen_sha256_format(&candidates->items[i], name);
		if (!candidates->named[i] && is_old(dir, name, keep_s))
			removed += unlinkat(dir, name, 0) == 0;
	}
	return removed;
}

static void remove_kept(const char *kept_dir, uint32_t keep_s)
{
	DIR *kept = opendir(kept_dir);
	const struct dirent *entry;
	struct pen_sha256 sha256;

	while (kept && (entry = readdir(kept)))
		if (strlen(entry->d_name) == PEN_SHA256_TEXT - 1 &&
			pen_sha256_parse(entry->d_name, &sha256) &&
			is_old(dirfd(kept), entry->d_name, keep_s))
			(void)unlinkat(dirfd(kept), entry->d_name, 0);
	if (kept)
		(void)closedir(kept);
}

static void run(uv_work_t *work)
{
	const struct pen_asset_sweep *sweep = work->data;
	struct candidates candidates = {0};
	DIR *assets = opendir(sweep->assets_dir);
	unsigned removed = 0;

	if (!assets)
		return;
	remove_kept(sweep->kept_dir, sweep->keep_s);
	collect(assets, sweep->keep_s, &candidates);
	if (!candidates.failed && candidates.count > 0)
		mark_scenes(sweep->scenes_dir, &candidates);
	if (!candidates.failed && candidates.count > 0)
		mark_scenes(sweep->kept_dir, &candidates);
	if (!candidates.failed)
		removed = remove_unnamed(dirfd(assets), &candidates, sweep->keep_s);
	if (removed > 0)
		pen_log(PEN_LOG_INFO, "removed %u assets that no render needs", removed);
	(void)closedir(assets);
	free(candidates.named);
	free(candidates.items);
}

static void free_when_over(struct pen_asset_sweep *sweep)
{
	if (sweep->destroyed && !sweep->working)
		free(sweep);
}

static void ran(uv_work_t *work, int status)
{
	struct pen_asset_sweep *sweep = work->data;

	(void)status;
	sweep->working = false;
	free_when_over(sweep);
}

static void handle_due(uv_timer_t *timer)
{
	struct pen_asset_sweep *sweep = timer->data;

	if (sweep->working)
		return;
	sweep->working = uv_queue_work(timer->loop, &sweep->work, run, ran) == 0;
}

int pen_asset_sweep_create(uv_loop_t *loop, const char *assets_dir, const char *scenes_dir,
	const char *kept_dir, uint32_t keep_s, struct pen_asset_sweep **ret_sweep,
	struct pen_error *err)
{
	struct pen_asset_sweep *sweep = calloc(1, sizeof *sweep);

	if (!sweep)
		return pen_error_memory(err);
	sweep->assets_dir = assets_dir;
	sweep->scenes_dir = scenes_dir;
	sweep->kept_dir = kept_dir;
	sweep->keep_s = keep_s;
	sweep->work.data = sweep;
	(void)uv_timer_init(loop, &sweep->timer);
	sweep->timer.data = sweep;
	(void)uv_timer_start(&sweep->timer, handle_due, FIRST_MS, EVERY_MS);
	*ret_sweep = sweep;
	return 0;
}

static void handle_closed(uv_handle_t *handle)
{
	struct pen_asset_sweep *sweep = handle->data;

	sweep->destroyed = true;
	free_when_over(sweep);
}

void pen_asset_sweep_destroy(struct pen_asset_sweep *sweep)
{
	if (sweep)
		uv_close((uv_handle_t *)&sweep->timer, handle_closed);
}
