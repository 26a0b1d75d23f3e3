/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_JOB_H
#define PEN_SERVER_JOB_H

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/limits.h"
#include "core/base/tile.h"
#include "core/scene/parse.h"
#include "core/scene/planes.h"
#include "server/owner.h"
#include "server/verify.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <uv.h>

/*
 * Renders as the coordinator knows them. All of this runs on the loop thread; a struct pen_job
 * stays valid until it is deleted, and a pointer to one must not be kept across a return to the
 * loop: keep the id and find it again.
 */

struct pen_jobs;

enum pen_job_state {
	PEN_JOB_QUEUED,
	PEN_JOB_RUNNING,
	PEN_JOB_PAUSED,
	PEN_JOB_DONE,
	PEN_JOB_FAILED,
	PEN_JOB_CANCELLED
};

/* "queued", … as in the render resource. */
const char *pen_job_state_name(enum pen_job_state state);
bool pen_job_state_parse(const char *name, enum pen_job_state *ret_state);

/* Done, failed or cancelled. */
static inline bool pen_job_is_over(enum pen_job_state state)
{
	return state >= PEN_JOB_DONE;
}

enum { PEN_JOB_ID_TEXT = 27 }; /* 128 random bits as 26 lower-case base32 digits, and a NUL */

/* What the API reads; only job.c writes. Wall times are ms since 1970, 0 = not yet. */
struct pen_job {
	char id[PEN_JOB_ID_TEXT];
	uint64_t number; /* rises with each job; newest = highest */
	enum pen_job_state state;
	struct pen_owner owner;
	char *name;			  /* from the options, or NULL */
	char trace[PEN_TRACEPARENT_TEXT]; /* see server/trace_context.h; "" = none */
	bool is_preview;		  /* nothing of it outlives the coordinator */
	int64_t deadline_ms;		  /* not done by then, it fails; wall time, 0 = none */
	enum pen_verify verify;		  /* how much of it is rendered twice */
	bool has_key;			  /* it was asked for with an Idempotency-Key: */
	struct pen_sha256 key, key_body;  /* the digest of that and its owner, and of what came with
					     it */
	struct pen_sha256 scene_sha256;	  /* of the canonical text */
	bool has_world; /* it was accepted by this coordinator, and another view of its scene may
			   be: */
	struct pen_sha256 world;       /* the same of all views of the scene, see server/world.h */
	char *equivalence_class;       /* NULL until its first unit is leased */
	char content[PEN_SHA256_TEXT]; /* content address; "" until the class is known */
	uint32_t priority;
	uint32_t width, height;	  /* of the whole image */
	struct pen_tiling tiling; /* of each frame */
	uint32_t frame_first, frame_count;
	uint32_t frames_done; /* from the first on, whole and on the disk: these never change again
			       */
	struct pen_sampling_desc sampling;
	uint32_t aovs; /* enum pen_aov */
	double exposure;
	uint64_t units_done, units_total;
	uint64_t tiles_done;	 /* with all their rounds */
	uint64_t samples_done;	 /* merged, over all pixels of all frames */
	uint64_t samples_spared; /* that pixels will not need */
	uint64_t samples_passed; /* of samples_done: of frames that are on the disk for good */
	int64_t created_ms, started_ms, finished_ms;
	double eta_seconds; /* < 0: unknown */
	uint32_t restarts;
	struct pen_error error;	 /* of a failed one */
	char *errors;		 /* of its scene: see server/report.h; NULL = none */
	char *warnings;		 /* likewise */
	uint64_t revision;	 /* rises with each change of anything above */
	uint64_t image_revision; /* rises with each merged tile; 0 = nothing rendered */
};

/* Over all pixels of all frames, at most: fewer when the sampling finds that fewer will do. */
static inline uint64_t pen_job_samples(const struct pen_job *job)
{
	if (job->state == PEN_JOB_DONE && job->samples_done > 0)
		return job->samples_done;
	return pen_rect_area(job->tiling.crop) * job->sampling.samples * job->frame_count -
	       job->samples_spared;
}

/* What is kept of each of its pixels. */
static inline struct pen_film pen_job_film(const struct pen_job *job)
{
	return pen_film_of(pen_planes_of(job->aovs, job->sampling.mode));
}

/* How far one frame is. */
struct pen_job_frame {
	uint32_t number;
	bool done;	   /* it will not change any more */
	double progress;   /* 0..1 */
	uint64_t revision; /* rises with what is merged; 0 = nothing */
};

/* number: frame_first <= number < frame_first + frame_count. */
struct pen_job_frame pen_jobs_frame(const struct pen_job *job, uint32_t number);

/* The last frame that anything is rendered of, else the first. */
uint32_t pen_jobs_frame_latest(const struct pen_job *job);

/* Those that are begun and not done, in order. */
enum { PEN_JOB_FRAMES_MAX = 16 };
uint32_t pen_jobs_frames_running(
	const struct pen_job *job, struct pen_job_frame ret_frames[static PEN_JOB_FRAMES_MAX]);

/*
 * The tiles of an unfinished frame of which anything was merged since the job had that revision; at
 * most max of them. When they are more, or nobody knows, all of the crop is the one rectangle.
 */
size_t pen_jobs_tiles_since(const struct pen_job *job, uint32_t frame, uint64_t revision,
	struct pen_rect *ret_rects, size_t max);

struct pen_submission {
	struct pen_scene *scene; /* parsed; ownership passes on success and on failure */
	char *canonical;	 /* canonical text, heap; ownership passes likewise */
	size_t canonical_size;
	struct pen_owner owner;
	const char *name;		  /* NULL without one */
	char trace[PEN_TRACEPARENT_TEXT]; /* "" without one */
	uint32_t priority;
	struct pen_sha256 sha256; /* of the canonical text */
	bool has_world;		  /* see struct pen_job */
	struct pen_sha256 world;
	bool has_key; /* then: see struct pen_job */
	struct pen_sha256 key, key_body;
	bool is_preview;
	enum pen_verify verify;
	double deadline_s;		/* from now on; 0 = none */
	char replaces[PEN_JOB_ID_TEXT]; /* a render that is cancelled for it; "" = none */
	uint32_t retry_s;		/* set by a failure with PEN_ELIMIT: try again then */
};

/* job is NULL on failure; called from the loop, never from within the call that took it. */
typedef void pen_job_fn(void *user, struct pen_job *job, const struct pen_error *err);

/*
 * Accepts a render: fn runs when it is durable (P1), or at the next turn of the loop for a preview.
 * PEN_ELIMIT at once when too many wait (server/allowance.h), PEN_ENOSPACE when the disk is nearly
 * full, PEN_ECLOSED when draining.
 */
int pen_jobs_submit(struct pen_jobs *jobs, struct pen_submission *submission, pen_job_fn *fn,
	void *user, struct pen_error *err);

/*
 * Changes state to PAUSED, RUNNING (from PAUSED) or CANCELLED; fn runs when durable.
 * PEN_ECONFLICT when the job is over. The units of a cancelled one are revoked at once.
 */
int pen_jobs_set_state(struct pen_jobs *jobs, struct pen_job *job, enum pen_job_state state,
	pen_job_fn *fn, void *user, struct pen_error *err);

int pen_jobs_set_priority(struct pen_jobs *jobs, struct pen_job *job, uint32_t priority,
	pen_job_fn *fn, void *user, struct pen_error *err);

/* Cancels it if it runs and removes it with its files; fn (with job NULL and err->code 0) after. */
int pen_jobs_delete(struct pen_jobs *jobs, struct pen_job *job, pen_job_fn *fn, void *user,
	struct pen_error *err);

/* fn, or nothing when it is NULL, runs whenever a render is over; it must not ask for a change. */
void pen_jobs_listen(struct pen_jobs *jobs, void (*fn)(void *user), void *user);

/* Cancels a render that another one takes the place of; one that has gone or is over stays so. */
void pen_jobs_replace(struct pen_jobs *jobs, const char *id);

/*
 * The render that was asked for with this key: PEN_ENOTFOUND, or PEN_EAGAIN while it is being
 * accepted.
 */
int pen_jobs_find_key(struct pen_jobs *jobs, const struct pen_sha256 *key, struct pen_job **ret_job,
	struct pen_error *err);

/*
 * The newest render of this owner that is done and has this content address (server/content.h), or
 * NULL.
 */
struct pen_job *pen_jobs_find_content(
	struct pen_jobs *jobs, const struct pen_owner *owner, const struct pen_sha256 *content);

/* NULL when there is none. Who may know of it is the caller's to check. */
struct pen_job *pen_jobs_find(struct pen_jobs *jobs, const char *id);

/* Whose the render was that had this id and was removed; NULL: there was none. */
const struct pen_owner *pen_jobs_find_removed(struct pen_jobs *jobs, const char *id);

/* Newest first: the newest with number < before (UINT64_MAX: of all); NULL at the end. */
struct pen_job *pen_jobs_older(struct pen_jobs *jobs, uint64_t before);

/* Whether one waits for room on the disk, or for memory. */
bool pen_jobs_lack_room(const struct pen_jobs *jobs);

/*
 * A read-only descriptor of a frame's framebuffer (layout in server/framebuf.h), the caller closes
 * it. PEN_ENOTFOUND while nothing is rendered.
 */
int pen_jobs_open_image(struct pen_jobs *jobs, const struct pen_job *job, uint32_t frame,
	int *ret_fd, struct pen_error *err);

/* What follows is the server's own. */

struct pen_store;
struct pen_dispatch;

struct pen_jobs_options {
	const char *data_dir; /* holds frames/; borrowed, as are the next two */
	struct pen_store *store;
	struct pen_dispatch *dispatch;
	uint32_t processes;	 /* of the local farm, which may not have connected yet */
	uint32_t tile_px;	 /* of every new job; 0: pen_plan_tile_px */
	uint32_t keep_renders_s; /* those that are over; 0: for ever */
	uint64_t keep_bytes;	 /* of the frames of all renders; 0: without bound */
	uint32_t waiting_max;	 /* renders that are not over */
	/* The store is broken: nothing can be promised any more. */
	void (*broken)(void *user, const struct pen_error *err);
	void *user;
};

/* Loads what the store holds and goes on with the unfinished ones. */
int pen_jobs_create(uv_loop_t *loop, const struct pen_jobs_options *options,
	struct pen_jobs **ret_jobs, struct pen_error *err);

/* From now on nothing is accepted or changed (PEN_ECLOSED); what is merged goes to the store. */
void pen_jobs_close(struct pen_jobs *jobs);

/* After the store has been destroyed, so that nothing is under way; frees when the loop has run. */
void pen_jobs_destroy(struct pen_jobs *jobs);

#endif
