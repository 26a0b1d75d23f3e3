/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SCHED_H
#define PEN_SERVER_SCHED_H

#include "core/base/error.h"
#include "core/base/tile.h"
#include "server/quota.h"
#include "server/verify.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * Who renders what. A pure state machine: events and the time go in, actions come out; it opens,
 * reads and allocates nothing on the way (memory is taken only when a job or a worker is added).
 * Times are ms of any steady clock.
 *
 * A unit is one round of one tile of one frame. Rounds of a tile are rendered strictly in order,
 * one at a time: waiting, leased to a worker, merging (the result is valid and on its way into the
 * framebuffer), merged. Within a frame the lowest round goes first, within a round the tiles
 * nearest the centre. A tile gets the rounds that are sure; when every tile of a frame has what it
 * shall have so far, the scheduler asks what more that is. Frames go in order: the next one begins
 * when nothing of those before it waits, so that nobody idles, and a few at most are in flight.
 *
 * Jobs share the farm by virtual time: render seconds over weight (1 + priority). At most
 * PEN_SCHED_JOBS_ACTIVE of one equivalence class take turns unit by unit, since each costs every
 * worker a scene in memory; a waiting job takes the place of one that is ahead of it.
 *
 * Blame: a unit that fails by its own fault PEN_BLAME_MAX times fails its job, each attempt on
 * another worker while there is one; being killed from outside, or losing the worker, costs
 * nothing PEN_KILLS_MAX times. When another worker renders what some have failed at, it was their
 * fault: that is a strike each, and PEN_STRIKES_MAX of them put a worker into quarantine.
 *
 * Verification: what server/verify.h says is rendered a second time, by another worker while there
 * is one, and counts when both results are the same. If they are not, a third worker decides, or
 * trust; the liar is convicted, and jobs that hold anything of its that no other checked start
 * again, as do those that were resumed, which may. Two that agree were there at the same time: one
 * of them that left and came again would be another only by its id. When three disagree, or no
 * third comes within PEN_CLASS_ABSENT_MS, the job fails.
 *
 * Stragglers: when nothing waits for a process and three quarters of a frame's tiles are done, it
 * gets a unit that another worker has been at for PEN_STRAGGLER_LATENESS times the median of its
 * job. The first result counts, the other lease is revoked.
 */
struct pen_sched;

enum {
	PEN_SCHED_JOBS_ACTIVE = 4,
	PEN_STRIKE_UNITS = 1000, /* good ones, for which a strike is forgiven */
	PEN_STRAGGLER_MS = 200	 /* no unit is expected to take less */
};
#define PEN_STRAGGLER_LATENESS 1.5

enum pen_sched_fault {
	PEN_SCHED_FAULT_OWN,	  /* crash, deadline, invalid result: blame */
	PEN_SCHED_FAULT_KILLED,	  /* ended from outside */
	PEN_SCHED_FAULT_RETURNED, /* handed back unrendered */
	PEN_SCHED_FAULT_SCENE	  /* the job cannot be rendered by anyone */
};

enum pen_sched_event_type {
	PEN_SCHED_JOB_REMOVE,
	PEN_SCHED_JOB_PAUSE,
	PEN_SCHED_JOB_RESUME,
	PEN_SCHED_JOB_PRIORITY,
	PEN_SCHED_WORKER_LEAVE, /* lost or closed */
	PEN_SCHED_WORKER_DRAIN, /* takes no more leases */
	PEN_SCHED_WORKER_RESET, /* its strikes are forgiven; drained or not, it takes leases again
				 */
	PEN_SCHED_PROGRESS,
	PEN_SCHED_RESULT, /* a valid one */
	PEN_SCHED_MERGED,
	PEN_SCHED_DECIDED, /* the answer to PEN_SCHED_DECIDE */
	PEN_SCHED_FAILURE,
	PEN_SCHED_TICK /* at least once a second */
};

struct pen_sched_event {
	enum pen_sched_event_type type;
	uint64_t job;	 /* JOB_*, MERGED, DECIDED */
	uint64_t worker; /* WORKER_*, PROGRESS, RESULT, FAILURE */
	uint64_t lease;	 /* PROGRESS, RESULT, FAILURE: one that is not live is ignored */
	uint64_t digest; /* RESULT, of a job that is verified: of its pixels */
	union {
		uint32_t priority;
		uint64_t samples; /* PROGRESS: finished so far */
		double seconds;	  /* RESULT: of rendering */
		struct {
			uint32_t frame, tile;
		} merged;
		struct {
			uint32_t frame;
			const struct pen_demand *demands; /* one a tile; valid during the step */
		} decided;
		struct {
			enum pen_sched_fault fault;
			const char *reason; /* valid during the step */
		} failure;
	} u;
};

enum pen_sched_action_type {
	PEN_SCHED_LEASE,
	PEN_SCHED_REVOKE,
	PEN_SCHED_STARTED,     /* first lease: the job now belongs to a class */
	PEN_SCHED_COMMIT,      /* the pixels of this step's RESULT are to be merged */
	PEN_SCHED_DECIDE,      /* what the tiles of a frame shall have further */
	PEN_SCHED_RENDERED,    /* every unit merged; the job has been dropped */
	PEN_SCHED_FAILED,      /* for a reason; dropped */
	PEN_SCHED_ABANDONED,   /* no worker of its class for a minute; dropped, to be added anew */
	PEN_SCHED_TAINTED,     /* pixels of it may be wrong; dropped, to be added from nothing */
	PEN_SCHED_QUARANTINED, /* worker: it takes no more leases for now */
	PEN_SCHED_CONVICTED,   /* the same until it is reset: its pixels were wrong */
	PEN_SCHED_RELEASED     /* worker: it takes leases again */
};

struct pen_sched_action {
	enum pen_sched_action_type type;
	uint64_t job;
	uint64_t worker, lease; /* LEASE, REVOKE */
	uint32_t frame, tile, round, epoch;
	const char *text; /* class of STARTED, reason of FAILED; valid until the next step */
};

struct pen_sched_actions {
	const struct pen_sched_action *items; /* valid until the next step */
	size_t count;
};

struct pen_sched_job {
	uint64_t number; /* never used twice */
	const struct pen_tiling *tiling;
	uint32_t frame_first, frame_end; /* those that are not wholly merged; not empty */
	struct pen_rounds rounds;
	uint32_t priority;
	bool paused;
	bool resumed;	/* workers that nobody knows any more have rendered some of it */
	bool restarted; /* it waits for the class that is the best now: that of most processes */
	enum pen_verify verify;
	const char *equivalence_class;	  /* NULL: not chosen yet */
	const uint16_t *merged;		  /* rounds, as pen_reel_init takes them */
	const struct pen_demand *demands; /* likewise: what is decided already */
};

struct pen_sched_worker {
	uint64_t id; /* never used twice */
	uint32_t processes;
	const char *equivalence_class;
	bool trusted;	/* more than those that are not: of two that disagree it has it right */
	bool convicted; /* it comes back after wrong pixels, and takes no leases until it is reset
			 */
};

/* A live lease. */
struct pen_sched_lease {
	uint64_t id; /* never used twice; 0 = a free place */
	uint64_t job;
	uint32_t frame, tile, round, epoch;
	bool started;	  /* else it waits in the worker */
	uint64_t samples; /* finished, as last heard */
	int64_t granted_ms, started_ms, progress_ms;
	double charge;	  /* virtual time its job was charged in advance */
	int64_t begun_ms; /* since when its worker should be at work on it; < 0: not yet */
	bool doubled;	  /* another worker has a lease of the same unit */
};

/* secret: chooses what is rendered a second time. */
int pen_sched_create(uint64_t secret, struct pen_sched **ret_sched, struct pen_error *err);
void pen_sched_destroy(struct pen_sched *sched);

/* Everything given is copied. The job gets its first leases in the next step. */
int pen_sched_add_job(
	struct pen_sched *sched, const struct pen_sched_job *given, struct pen_error *err);
int pen_sched_add_worker(
	struct pen_sched *sched, const struct pen_sched_worker *given, struct pen_error *err);

/* Unknown jobs and workers in an event are ignored: they have just gone. */
struct pen_sched_actions pen_sched_step(
	struct pen_sched *sched, const struct pen_sched_event *event, int64_t now_ms);

/* NULL when the worker holds no such lease; valid until the next step. */
const struct pen_sched_lease *pen_sched_find_lease(
	const struct pen_sched *sched, uint64_t worker, uint64_t lease);

/* A unit that a worker is at work on. */
struct pen_sched_held {
	uint64_t worker;
	uint32_t frame, tile;
};

/* Those of a job, in order of workers, at most max; tells how many. */
size_t pen_sched_held(
	const struct pen_sched *sched, uint64_t job, struct pen_sched_held *ret_held, size_t max);

/* Units that could be leased now. */
uint64_t pen_sched_waiting(const struct pen_sched *sched);

/* Whether work waits for a worker of a class that none has now. */
bool pen_sched_lacks_class(const struct pen_sched *sched);

/* Render processes of the workers that take leases. */
uint32_t pen_sched_processes(const struct pen_sched *sched);

#endif
