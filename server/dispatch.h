/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_DISPATCH_H
#define PEN_SERVER_DISPATCH_H

#include "core/base/error.h"
#include "proto/msg.h"
#include "server/job.h"
#include "server/sched.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * The scheduler in its place: tells it what jobs and workers do, checks what workers deliver, and
 * carries its decisions out through the calls below. None of these may call back into the
 * dispatch before it returns.
 */
struct pen_dispatch;

enum pen_dispatch_end {
	PEN_DISPATCH_RENDERED,
	PEN_DISPATCH_FAILED,
	PEN_DISPATCH_ABANDONED, /* by all workers of its class: to be rendered from nothing */
	PEN_DISPATCH_TAINTED	/* by a worker whose pixels were wrong: likewise */
};

struct pen_dispatch_jobs {
	const struct pen_job *(*find)(void *user, uint64_t number);
	/* The first lease since the job was added. */
	void (*started)(void *user, uint64_t number, const char *equivalence_class);
	/* Valid pixels (heap, now the callee's); pen_dispatch_merged later. */
	void (*merge)(void *user, uint64_t number, uint32_t frame, uint32_t tile, uint32_t round,
		float *pixels);
	/* See pen_quota_mask; false: all pixels of the tile. */
	bool (*mask)(void *user, uint64_t number, uint32_t frame, uint32_t tile, uint32_t round,
		uint8_t *ret_mask);
	/* What the frame's tiles shall have further is to be decided; pen_dispatch_decided later.
	 */
	void (*decide)(void *user, uint64_t number, uint32_t frame);
	/* The dispatch has forgotten the job; reason of a failed one. */
	void (*ended)(void *user, uint64_t number, enum pen_dispatch_end end, const char *reason);
	/* A worker has built a job's scene, or cannot: any job, known or not. */
	void (*reported)(void *user, const struct pen_msg_scene_report *report);
	/* The text of a scene that is in no file: a descriptor for the caller. */
	bool (*text)(void *user, const struct pen_sha256 *sha256, int *ret_fd, uint64_t *ret_size);
	void *user;
};

/* Whether a worker takes leases. */
enum pen_dispatch_custody {
	PEN_CUSTODY_NONE,
	PEN_CUSTODY_STRIKES, /* not for now: others could render what it failed at */
	PEN_CUSTODY_LIAR     /* not until it is reset: its pixels were wrong */
};

struct pen_dispatch_farm {
	/* mask: of the tile's pixels; NULL: all of them. */
	void (*lease)(void *user, uint64_t worker, const struct pen_msg_lease *lease,
		const uint8_t *mask);
	void (*revoke)(void *user, uint64_t worker, uint64_t lease);
	void (*quarantined)(void *user, uint64_t worker, enum pen_dispatch_custody custody);
	void *user;
};

/* secret: see pen_sched_create. */
int pen_dispatch_create(uint64_t secret, struct pen_dispatch **ret_dispatch, struct pen_error *err);
void pen_dispatch_destroy(struct pen_dispatch *dispatch);

/* Both are set once, before any event. */
void pen_dispatch_connect_jobs(struct pen_dispatch *dispatch, const struct pen_dispatch_jobs *jobs);
void pen_dispatch_connect_farm(struct pen_dispatch *dispatch, const struct pen_dispatch_farm *farm);

/* At least once a second. */
void pen_dispatch_tick(struct pen_dispatch *dispatch);

/* From now on nothing is leased and every event is ignored. */
void pen_dispatch_stop(struct pen_dispatch *dispatch);

/* What jobs do; all but add ignore a job that has just ended. */
int pen_dispatch_add_job(
	struct pen_dispatch *dispatch, const struct pen_sched_job *job, struct pen_error *err);
void pen_dispatch_remove_job(struct pen_dispatch *dispatch, uint64_t number);
void pen_dispatch_pause_job(struct pen_dispatch *dispatch, uint64_t number);
void pen_dispatch_resume_job(struct pen_dispatch *dispatch, uint64_t number);
void pen_dispatch_set_priority(struct pen_dispatch *dispatch, uint64_t number, uint32_t priority);
void pen_dispatch_merged(
	struct pen_dispatch *dispatch, uint64_t number, uint32_t frame, uint32_t tile);

/* One of demands a tile, for this call. */
void pen_dispatch_decided(struct pen_dispatch *dispatch, uint64_t number, uint32_t frame,
	const struct pen_demand *demands);

/* What workers do. */
int pen_dispatch_add_worker(struct pen_dispatch *dispatch, const struct pen_sched_worker *worker,
	struct pen_error *err);
void pen_dispatch_remove_worker(struct pen_dispatch *dispatch, uint64_t worker);
void pen_dispatch_drain_worker(struct pen_dispatch *dispatch, uint64_t worker);
void pen_dispatch_reset_worker(struct pen_dispatch *dispatch, uint64_t worker);
void pen_dispatch_progress(
	struct pen_dispatch *dispatch, uint64_t worker, const struct pen_msg_heartbeat *heartbeat);

/*
 * How a lease ended: GONE when it was not live (the message is dropped), GOOD with the samples of
 * the unit, RETURNED without blame, BAD when the worker or the unit is to blame.
 */
enum pen_dispatch_outcome {
	PEN_OUTCOME_GONE,
	PEN_OUTCOME_GOOD,
	PEN_OUTCOME_RETURNED,
	PEN_OUTCOME_BAD
};

enum pen_dispatch_outcome pen_dispatch_result(struct pen_dispatch *dispatch, uint64_t worker,
	const struct pen_msg_result *result, const void *payload, size_t size,
	uint64_t *ret_samples);
enum pen_dispatch_outcome pen_dispatch_failure(
	struct pen_dispatch *dispatch, uint64_t worker, const struct pen_msg_failure *failure);

void pen_dispatch_report(struct pen_dispatch *dispatch, const struct pen_msg_scene_report *report);

/* See text of struct pen_dispatch_jobs. */
bool pen_dispatch_text(const struct pen_dispatch *dispatch, const struct pen_sha256 *sha256,
	int *ret_fd, uint64_t *ret_size);

/* See pen_sched_held. */
size_t pen_dispatch_held(const struct pen_dispatch *dispatch, uint64_t number,
	struct pen_sched_held *ret_held, size_t max);

uint64_t pen_dispatch_waiting(const struct pen_dispatch *dispatch);
bool pen_dispatch_lacks_class(const struct pen_dispatch *dispatch);
uint32_t pen_dispatch_processes(const struct pen_dispatch *dispatch);

#endif
