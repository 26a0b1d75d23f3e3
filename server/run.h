/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_RUN_H
#define PEN_SERVER_RUN_H

#include "core/base/error.h"
#include "server/canvas.h"
#include "server/dispatch.h"
#include "server/job.h"
#include "server/job_index.h"
#include "server/job_table.h"
#include "server/reel.h"
#include "server/tiles.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/queue.h>
#include <uv.h>

/*
 * The inside of server/job.h: a job's run from its acceptance to its end. The dispatch says what is
 * rendered, the canvas puts it into the framebuffer, the store keeps where it stands; job.c takes
 * what users ask for.
 */
struct pen_run_frame {
	struct pen_tiles tiles; /* of a frame, if it has begun */
	struct pen_canvas *canvas;
	uint32_t tile_last; /* merged last: the dispatch is told when the frame is on the disk */
	bool synced;	    /* it is */
	bool is_deciding;   /* that its tiles lack nothing is to be told then */
};

struct pen_run {
	struct pen_job job;		 /* what is shown; first, so that a pen_job is a pen_run */
	TAILQ_ENTRY(pen_run) unfinished; /* or of previews, or of accepting */

	/* Of an unfinished one. */
	int text;					  /* of a preview's scene; else -1 */
	struct pen_run_frame frames[PEN_REEL_FRAMES_MAX]; /* frame n is at n modulo their number */
	uint32_t passed; /* frames, from the first on, that are on the disk: job.frames_done will be
			    that when it is stored */
	uint32_t opening; /* framebuffers that are being looked at, or brought onto the disk as they
			     are */
	struct pen_tile_news news;
	int64_t running_ms; /* spent rendering since this coordinator began it */
	uint64_t samples_at_begin;
	bool begun;		  /* the dispatch or the canvas is at work on it */
	bool ending;		  /* its last state, or its removal, is on its way to the store */
	struct pen_error trouble; /* code < 0: it cannot go on and will be paused */
};

struct pen_jobs {
	uv_timer_t timer;
	uv_loop_t *loop;
	struct pen_jobs_options options;
	struct pen_job_table table;
	struct pen_job_index keys;     /* of those that were asked for with one */
	struct pen_job_index contents; /* of those that are done, but for previews */
	TAILQ_HEAD(pen_run_list, pen_run) unfinished;
	struct pen_run_list accepting; /* until the store has them */
	uint32_t unfinished_count;     /* those that are being accepted, too */
	struct pen_run_list previews;  /* that are over, in that order */
	uint32_t preview_count;
	void (*heard)(void *user); /* see pen_jobs_listen; or NULL */
	void *listener;
	uint64_t ticks;
	uint64_t number_last;
	bool closed;
	bool broken;
};

/* A change that waits to be durable. */
struct pen_change {
	struct pen_jobs *jobs;
	uint64_t number;
	struct pen_run *accepted; /* a new one, not in the table yet */
	enum pen_job_state state;
	int64_t finished_ms;
	uint32_t frames_done;
	struct pen_error error;
	pen_job_fn *fn; /* may be NULL */
	void *user;
};

/* NULL without memory. */
struct pen_change *pen_change_create(
	struct pen_jobs *jobs, const struct pen_job *job, pen_job_fn *fn, void *user);

/* Tells the one who asked for it, and whether the store can still be trusted; frees it. */
void pen_change_finish(struct pen_change *change, struct pen_job *job, const struct pen_error *err);

/* NULL when there is none. */
struct pen_run *pen_run_find(const struct pen_jobs *jobs, uint64_t number);

/* Of a frame's framebuffer; ret_path holds PATH_MAX characters. */
void pen_run_path(
	const struct pen_jobs *jobs, const struct pen_job *job, uint32_t frame, char *ret_path);

/* Removes the framebuffers of a job that is gone, in the background when there are many. */
void pen_run_unlink(struct pen_jobs *jobs, const struct pen_job *job);

/* The frame's place, with its tiles at 0 rounds when it was free; NULL without memory. */
struct pen_run_frame *pen_run_add_frame(struct pen_run *run, uint32_t number);

/* Takes the calls of the dispatch. */
void pen_run_connect(struct pen_jobs *jobs);

/* Goes on with an unfinished job that nobody is at work on. */
void pen_run_begin(struct pen_jobs *jobs, struct pen_run *run);

/* Lets go of the framebuffer; what is merged stays. */
void pen_run_halt(struct pen_run *run);

/* It cannot go on for now: the next tick pauses it, and shows err. */
void pen_run_give_up(struct pen_run *run, const struct pen_error *err);

/*
 * Makes a state durable and tells fn (which may be NULL). The end of a job is shown no earlier
 * than that; any other state at once. reason may be NULL.
 */
int pen_run_store_state(struct pen_jobs *jobs, struct pen_run *run, enum pen_job_state state,
	const struct pen_error *reason, pen_job_fn *fn, void *user, struct pen_error *err);

/* Every PEN_RUN_TICK_MS. */
enum { PEN_RUN_TICK_MS = 250 };
void pen_run_tick(struct pen_jobs *jobs, struct pen_run *run);

/* It is over, or going: it needs no more than what is shown of it. */
void pen_run_retire(struct pen_jobs *jobs, struct pen_run *run);

void pen_run_destroy(struct pen_run *run);

#endif
