/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SCHED_STATE_H
#define PEN_SERVER_SCHED_STATE_H

#include "core/base/limits.h"
#include "server/reel.h"
#include "server/sched.h"

/*
 * The inside of server/sched.h: sched.c takes events, sched_turn.c says who renders what next,
 * sched_lease.c ends leases, sched_pace.c knows how long units take.
 */

/* Of how many units the last times are known. */
enum { PEN_SCHED_PACES = 15 };

struct pen_sched_turn {
	uint64_t number;
	struct pen_reel reel;
	uint32_t priority;
	bool paused, restarted;
	enum pen_verify verify;
	uint64_t unaudited;  /* a bit for each worker whose pixels no other has checked */
	int64_t disputed_ms; /* since when two disagree and nobody can decide; < 0: they do not */
	bool started;	     /* it has had a lease since it was added */
	bool active;
	char equivalence_class[PEN_CLASS_BYTES_MAX + 1]; /* "": not chosen yet */
	int64_t absent_ms;	      /* since when its class is absent; < 0: it is not */
	double virtual_seconds;	      /* render seconds over weight, leased units included */
	double seconds_per_sample;    /* measured; 0: not yet */
	float paces[PEN_SCHED_PACES]; /* seconds a sample, of the last units */
	uint32_t pace_count;	      /* all that were measured */
	struct pen_error reason;
	struct pen_sched_turn *next; /* of the dropped ones */
};

struct pen_sched_hand {
	uint64_t id;
	uint32_t processes;
	char equivalence_class[PEN_CLASS_BYTES_MAX + 1];
	bool draining;
	bool trusted;
	bool quarantined;
	int64_t release_ms; /* from quarantine */
	bool idle;	    /* there is nothing for it in this step */
	uint32_t strikes, units;
	uint32_t audits; /* in a row that found it right */
	uint32_t lease_count, lease_max;
	struct pen_sched_lease leases[]; /* lease_max */
};

struct pen_sched {
	struct pen_sched_turn **jobs;
	size_t job_count, job_capacity;
	struct pen_sched_hand **workers;
	size_t worker_count, worker_capacity;
	struct pen_sched_action *actions;
	size_t action_count, action_capacity;
	size_t lease_places;		/* of all workers */
	struct pen_sched_turn *dropped; /* freed by the next step: actions point into them */
	uint64_t lease_last;
	uint64_t secret;
	uint32_t merging;
	double virtual_seconds; /* of the job leased from last: where a new one starts */
	int64_t now_ms;
};

/* sched.c */

struct pen_sched_turn *pen_sched_find_job(const struct pen_sched *sched, uint64_t number);
struct pen_sched_hand *pen_sched_find_worker(const struct pen_sched *sched, uint64_t id);

/* A lease lives no longer than its job. */
struct pen_sched_turn *pen_sched_job_of(
	const struct pen_sched *sched, const struct pen_sched_lease *lease);
struct pen_sched_action *pen_sched_act(
	struct pen_sched *sched, enum pen_sched_action_type type, const struct pen_sched_turn *job);

/* sched_pace.c */

static inline double pen_sched_weight(const struct pen_sched_turn *job)
{
	return 1.0 + job->priority;
}

/* What a unit is likely to take: a guess while none of its job has been measured. */
double pen_sched_predict(const struct pen_sched_turn *job, const struct pen_sched_lease *lease);

/* A unit has taken so long. */
void pen_sched_measure(struct pen_sched_turn *job, double seconds, double samples);

/* How often as long as the median unit of its job this one has taken by now; 0: unknown. */
double pen_sched_lateness(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_sched_lease *lease);

/* The oldest leases of a worker are at work, as many as it has processes: notes since when. */
void pen_sched_note_begin(const struct pen_sched *sched, struct pen_sched_hand *worker);

/* sched_turn.c */

/* Whether it takes leases at all. */
static inline bool pen_sched_takes(const struct pen_sched_hand *worker)
{
	return !worker->draining && !worker->quarantined;
}

bool pen_sched_serves(const struct pen_sched_hand *worker, const struct pen_sched_turn *job);

/* Hands out all that may go out now. */
void pen_sched_grant_leases(struct pen_sched *sched);

/* Processes that would idle help with stragglers. To be called now and then, after the above. */
void pen_sched_double_stragglers(struct pen_sched *sched);

/* sched_lease.c */

/* It has brought its pixels; another one of the same unit, if there is one, is revoked. */
void pen_sched_win(
	struct pen_sched *sched, struct pen_sched_hand *worker, struct pen_sched_lease *lease);

/* Ends a lease without pixels, whatever the fault. */
void pen_sched_lose(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, enum pen_sched_fault fault, const char *reason);

/* The same, and tells the worker. */
void pen_sched_expire(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, enum pen_sched_fault fault, const char *reason);

/* for_good: until it is reset. */
void pen_sched_quarantine(struct pen_sched *sched, struct pen_sched_hand *worker, bool for_good);

/* Its fault; the last of PEN_STRIKES_MAX puts it into quarantine. */
void pen_sched_strike(struct pen_sched *sched, struct pen_sched_hand *worker);

/* It takes leases again; with so many strikes against it. */
void pen_sched_release(struct pen_sched *sched, struct pen_sched_hand *worker, uint32_t strikes);

void pen_sched_revoke_all(struct pen_sched *sched, struct pen_sched_turn *job);

/* For the reason that it has. */
void pen_sched_fail_job(struct pen_sched *sched, struct pen_sched_turn *job);

/* The lease has brought pixels that do not count yet: the unit waits again. */
void pen_sched_defer(
	struct pen_sched *sched, struct pen_sched_hand *worker, struct pen_sched_lease *lease);

/* The job leaves; its memory stays for the actions of this step. */
void pen_sched_drop_job(struct pen_sched *sched, struct pen_sched_turn *job);

/* sched_audit.c */

/*
 * A valid result: merges its pixels, remembers what they were until another worker has rendered the
 * same, or finds out who lies.
 */
void pen_sched_take_result(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, uint64_t digest);

/*
 * A worker that leaves may come again under another id: what it has said is held against it when
 * others find otherwise, but nobody's word is confirmed by it.
 */
void pen_sched_take_leave(struct pen_sched *sched, uint64_t worker);

/* Fails jobs that have waited too long for somebody to decide. */
void pen_sched_check_disputes(struct pen_sched *sched);

/* Whether worker may render a unit, as far as its being rendered twice is concerned. */
bool pen_sched_may_opine(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_backlog *backlog, uint32_t tile, const struct pen_sched_hand *worker);

#endif
