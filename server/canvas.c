/* SPDX-License-Identifier: Apache-2.0 */
#include "server/canvas.h"

#include "server/decide.h"
#include "server/seal.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum task_type { TASK_CREATE, TASK_OPEN, TASK_MERGE, TASK_DECIDE, TASK_SYNC, TASK_REACH };

struct task {
	struct task *next;
	enum task_type type;
	uint32_t tile, round;
	float *pixels;
	struct pen_canvas_tile state; /* after a merge */
};

struct task_list {
	struct task *first, **end;
};

struct pen_canvas {
	uv_loop_t *loop;
	uint64_t job;
	uint32_t frame;
	struct pen_framebuf framebuf;
	struct pen_canvas_events events;
	char *path;
	struct task_list waiting;
	bool destroyed;
	bool delivering;

	/* The pool's while work runs. */
	uv_work_t work;
	bool working;
	int fd;
	struct pen_canvas_tile *tiles; /* what there is of each */
	struct pen_quota quota;	       /* rounds NULL: all pixels get all rounds */
	struct task_list running;
	struct task *stopped_at; /* the task that failed; NULL: none */
	struct pen_error err;
};

static void list_init(struct task_list *list)
{
	list->first = NULL;
	list->end = &list->first;
}

static void list_append(struct task_list *list, struct task *task)
{
	*list->end = task;
	list->end = &task->next;
}

static struct task *list_take(struct task_list *list)
{
	struct task *task = list->first;

	if (task && !(list->first = task->next))
		list->end = &list->first;
	return task;
}

static void task_destroy(struct task *task)
{
	free(task->pixels);
	free(task);
}

static void list_clear(struct task_list *list)
{
	struct task *task;

	while ((task = list_take(list)) != NULL)
		task_destroy(task);
}

static void canvas_free(struct pen_canvas *canvas)
{
	list_clear(&canvas->waiting);
	list_clear(&canvas->running);
	if (canvas->fd >= 0)
		(void)close(canvas->fd);
	pen_quota_finish(&canvas->quota);
	free(canvas->tiles);
	free(canvas->path);
	free(canvas);
}

struct pen_demand pen_canvas_demand(const struct pen_canvas *canvas, uint32_t tile)
{
	const struct pen_framebuf *framebuf = &canvas->framebuf;

	if (canvas->quota.rounds)
		return pen_quota_demand(&canvas->quota, tile);
	return pen_demand_first(
		&framebuf->rounds, pen_rect_area(pen_tiling_rect(&framebuf->tiling, tile)));
}

/* On the pool */

/* Without access times: every merge reads after a write, and would change the inode once more. */
static int open_file(struct pen_canvas *canvas)
{
	canvas->fd = open(canvas->path, O_RDWR | O_CLOEXEC | O_NOATIME);
	if (canvas->fd < 0 && errno == EPERM) /* somebody else's file */
		canvas->fd = open(canvas->path, O_RDWR | O_CLOEXEC);
	return canvas->fd < 0 ? -errno : 0;
}

static int create_file(struct pen_canvas *canvas, struct pen_error *err)
{
	const uint64_t size = pen_framebuf_bytes(&canvas->framebuf) +
			      pen_quota_bytes(&canvas->framebuf) +
			      pen_seal_bytes(&canvas->framebuf);
	int r = pen_framebuf_create(canvas->path, size, err);

	if (r < 0)
		return r;
	r = open_file(canvas);
	return r < 0 ? pen_error_system(err, -r, "cannot open the framebuffer") : 0;
}

/* A tile that cannot be read, or reads as something else, starts again. */
static int check_file(struct pen_canvas *canvas, struct pen_error *err)
{
	int r = open_file(canvas);

	if (r < 0 && r != -ENOENT)
		return pen_error_system(err, -r, "cannot open the framebuffer");
	if (r == 0 && canvas->quota.rounds)
		pen_quota_load(&canvas->quota, canvas->fd);
	for (uint32_t i = 0; i < canvas->framebuf.tiling.count; i++) {
		struct pen_canvas_tile *tile = &canvas->tiles[i];
		struct pen_framebuf_tile found = {0};

		if (tile->rounds == 0)
			continue;
		if (r < 0 || tile->rounds > pen_canvas_demand(canvas, i).rounds ||
			pen_framebuf_look(canvas->fd, &canvas->framebuf, i, &found, NULL) < 0 ||
			found.xxh3 != tile->xxh3)
			*tile = (struct pen_canvas_tile){0};
		else
			tile->samples = found.samples;
	}
	return r < 0 ? create_file(canvas, err) : 0;
}

static int merge(struct pen_canvas *canvas, struct task *task, struct pen_error *err)
{
	struct pen_framebuf_tile merged;
	int r = pen_framebuf_merge(
		canvas->fd, &canvas->framebuf, task->tile, task->round, task->pixels, &merged, err);

	if (r < 0)
		return r;
	task->state =
		(struct pen_canvas_tile){(uint16_t)(task->round + 1), merged.xxh3, merged.samples};
	canvas->tiles[task->tile] = task->state;
	return 0;
}

/* Unless tiles lack something, or nothing is left to decide. */
static int decide(struct pen_canvas *canvas, struct pen_error *err)
{
	bool is_final = true;
	int r;

	for (uint32_t i = 0; i < canvas->framebuf.tiling.count; i++) {
		const struct pen_demand demand = pen_canvas_demand(canvas, i);

		if (canvas->tiles[i].rounds < demand.rounds)
			return 0;
		is_final = is_final && demand.is_final;
	}
	if (is_final)
		return 0;
	r = pen_decide(&canvas->quota, canvas->fd, err);
	return r < 0 ? r : pen_quota_save(&canvas->quota, canvas->fd, err);
}

/* A new file is there after a power cut only when its name is on the disk, too. */
static int sync_directory(const char *path)
{
	char dir[PATH_MAX];
	int fd, r;

	(void)snprintf(dir, sizeof dir, "%s", path);
	*strrchr(dir, '/') = '\0';
	fd = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	r = fd < 0 ? -1 : fsync(fd);
	if (fd >= 0)
		(void)close(fd);
	return r;
}

/* Only of a frame that lacks nothing: what is in it now must be in it for ever. */
static int sync_file(struct pen_canvas *canvas, struct pen_error *err)
{
	int r = pen_seal_write(canvas->fd, &canvas->framebuf, canvas->tiles, err);

	if (r == 0 && (fsync(canvas->fd) < 0 || sync_directory(canvas->path) < 0))
		r = pen_error_system(err, errno, "cannot write the framebuffer");
	return r;
}

static int run_task(struct pen_canvas *canvas, struct task *task, struct pen_error *err)
{
	switch (task->type) {
	case TASK_CREATE: return create_file(canvas, err);
	case TASK_OPEN: return check_file(canvas, err);
	case TASK_MERGE: return merge(canvas, task, err);
	case TASK_DECIDE: return decide(canvas, err);
	case TASK_REACH: return 0;
	case TASK_SYNC: return sync_file(canvas, err);
	}
	return 0;
}

static void run_tasks(uv_work_t *work)
{
	struct pen_canvas *canvas = work->data;

	for (struct task *task = canvas->running.first; task; task = task->next) {
		if (run_task(canvas, task, &canvas->err) < 0) {
			canvas->stopped_at = task;
			return;
		}
	}
}

/* On the loop */

static void deliver(struct pen_canvas *canvas, const struct task *task)
{
	const struct pen_canvas_events *events = &canvas->events;

	switch (task->type) {
	case TASK_CREATE: break;
	case TASK_OPEN:
		events->opened(events->user, canvas->job, canvas->frame, canvas->tiles);
		break;
	case TASK_MERGE:
		events->merged(events->user, canvas->job, canvas->frame, task->tile, &task->state);
		break;
	case TASK_DECIDE: events->decided(events->user, canvas->job, canvas->frame); break;
	case TASK_SYNC:
	case TASK_REACH: events->synced(events->user, canvas->job, canvas->frame); break;
	}
}

static void start(struct pen_canvas *canvas);

static void handle_done(uv_work_t *work, int status)
{
	struct pen_canvas *canvas = work->data;
	struct task *task;

	(void)status; /* never cancelled */
	canvas->working = false;
	canvas->delivering = true;
	while (!canvas->destroyed && (task = list_take(&canvas->running)) != NULL) {
		bool failed = task == canvas->stopped_at;

		if (!failed)
			deliver(canvas, task);
		task_destroy(task);
		if (failed) {
			canvas->events.failed(canvas->events.user, canvas->job, &canvas->err);
			break;
		}
	}
	canvas->delivering = false;
	if (canvas->destroyed)
		canvas_free(canvas);
	else if (!canvas->stopped_at)
		start(canvas);
}

static void start(struct pen_canvas *canvas)
{
	if (canvas->working || canvas->delivering || !canvas->waiting.first || canvas->stopped_at)
		return;
	canvas->running.first = canvas->waiting.first;
	canvas->running.end = canvas->waiting.end;
	list_init(&canvas->waiting);
	canvas->working = true;
	canvas->work.data = canvas;
	(void)uv_queue_work(canvas->loop, &canvas->work, run_tasks, handle_done);
}

static int add_task(struct pen_canvas *canvas, enum task_type type, uint32_t tile, uint32_t round,
	float *pixels, struct pen_error *err)
{
	struct task *task = calloc(1, sizeof *task);

	if (!task) {
		free(pixels);
		return pen_error_memory(err);
	}
	*task = (struct task){.type = type, .tile = tile, .round = round, .pixels = pixels};
	list_append(&canvas->waiting, task);
	start(canvas);
	return 0;
}

static int canvas_new(uv_loop_t *loop, uint64_t job, uint32_t frame, const char *path,
	const struct pen_framebuf *framebuf, const struct pen_canvas_events *events,
	struct pen_canvas **ret_canvas, struct pen_error *err)
{
	struct pen_canvas *canvas = calloc(1, sizeof *canvas);

	if (!canvas)
		return pen_error_memory(err);
	canvas->loop = loop;
	canvas->job = job;
	canvas->frame = frame;
	canvas->framebuf = *framebuf;
	canvas->events = *events;
	canvas->fd = -1;
	list_init(&canvas->waiting);
	list_init(&canvas->running);
	canvas->path = strdup(path);
	canvas->tiles = calloc(framebuf->tiling.count, sizeof *canvas->tiles);
	if (!canvas->path || !canvas->tiles ||
		(framebuf->rounds.kind != PEN_ROUNDS_UNIFORM &&
			pen_quota_init(&canvas->quota, &canvas->framebuf, NULL) < 0)) {
		canvas_free(canvas);
		return pen_error_memory(err);
	}
	*ret_canvas = canvas;
	return 0;
}

int pen_canvas_create(uv_loop_t *loop, uint64_t job, uint32_t frame, const char *path,
	const struct pen_framebuf *framebuf, const struct pen_canvas_events *events,
	struct pen_canvas **ret_canvas, struct pen_error *err)
{
	struct pen_canvas *canvas;
	int r = canvas_new(loop, job, frame, path, framebuf, events, &canvas, err);

	if (r < 0)
		return r;
	r = add_task(canvas, TASK_CREATE, 0, 0, NULL, err);
	if (r < 0) {
		canvas_free(canvas);
		return r;
	}
	*ret_canvas = canvas;
	return 0;
}

int pen_canvas_open(uv_loop_t *loop, uint64_t job, uint32_t frame, const char *path,
	const struct pen_framebuf *framebuf, const struct pen_canvas_tile *tiles,
	const struct pen_canvas_events *events, struct pen_canvas **ret_canvas,
	struct pen_error *err)
{
	struct pen_canvas *canvas;
	int r = canvas_new(loop, job, frame, path, framebuf, events, &canvas, err);

	if (r < 0)
		return r;
	memcpy(canvas->tiles, tiles, framebuf->tiling.count * sizeof *tiles);
	r = add_task(canvas, TASK_OPEN, 0, 0, NULL, err);
	if (r < 0) {
		canvas_free(canvas);
		return r;
	}
	*ret_canvas = canvas;
	return 0;
}

int pen_canvas_merge(struct pen_canvas *canvas, uint32_t tile, uint32_t round, float *pixels,
	struct pen_error *err)
{
	return add_task(canvas, TASK_MERGE, tile, round, pixels, err);
}

int pen_canvas_decide(struct pen_canvas *canvas, struct pen_error *err)
{
	return add_task(canvas, TASK_DECIDE, 0, 0, NULL, err);
}

bool pen_canvas_mask(
	const struct pen_canvas *canvas, uint32_t tile, uint32_t round, uint8_t *ret_mask)
{
	return canvas->quota.rounds && pen_quota_mask(&canvas->quota, tile, round, ret_mask);
}

int pen_canvas_sync(struct pen_canvas *canvas, bool is_durable, struct pen_error *err)
{
	return add_task(canvas, is_durable ? TASK_SYNC : TASK_REACH, 0, 0, NULL, err);
}

void pen_canvas_destroy(struct pen_canvas *canvas)
{
	if (!canvas)
		return;
	canvas->destroyed = true;
	if (!canvas->working && !canvas->delivering)
		canvas_free(canvas);
}
