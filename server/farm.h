/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_FARM_H
#define PEN_SERVER_FARM_H

#include "core/base/error.h"
#include "server/dispatch.h"
#include "server/muster.h"

#include <netinet/in.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <uv.h>

/* The workers as the coordinator knows them: those that have said hello and are still there. */
struct pen_farm;

struct pen_farm_options {
	struct sockaddr_storage address; /* to listen on; port 0: any */
	struct pen_dispatch *dispatch;
	struct pen_muster *muster; /* borrowed */
	const char *scenes_dir;	   /* see server/scene_file.h; borrowed */
	const char *assets_dir;	   /* see server/asset_file.h; borrowed */
};

int pen_farm_create(uv_loop_t *loop, const struct pen_farm_options *options,
	struct pen_farm **ret_farm, struct pen_error *err);

/* Asks every worker to go, and closes; memory goes when the loop has run. */
void pen_farm_destroy(struct pen_farm *farm);

uint16_t pen_farm_port(const struct pen_farm *farm);

/* See pen_muster_issue. */
int pen_farm_issue_key(struct pen_farm *farm, char *ret_key, struct pen_error *err);

struct pen_worker {
	uint64_t id; /* never used twice */
	char *name;
	char *address; /* "127.0.0.1:4711" */
	uint32_t processes;
	char *equivalence_class;
	char *version;
	bool draining;	  /* it gets nothing more */
	bool leaving;	  /* by its own wish: it will not come back to it */
	bool quarantined; /* others could render what it failed at: it gets nothing for now */
	uint32_t leases;  /* held now */
	uint64_t units_done;
	uint64_t samples_done;
	double samples_per_second;	    /* over the last seconds */
	int64_t connected_ms, heartbeat_ms; /* wall time */
	uint32_t strikes;
};

/* In order of id: the first with id > after (0: of all); NULL at the end. */
const struct pen_worker *pen_farm_next(const struct pen_farm *farm, uint64_t after);

/*
 * From now on it gets no more work; it may finish what it has. Then, with its strikes forgiven,
 * work again: PEN_ECONFLICT when it is leaving. Both PEN_ENOTFOUND when there is no such worker.
 */
int pen_farm_drain(struct pen_farm *farm, uint64_t id, struct pen_error *err);
int pen_farm_reset(struct pen_farm *farm, uint64_t id, struct pen_error *err);

/* Since the coordinator began, over all workers, also those that have gone. */
struct pen_farm_totals {
	uint64_t units, samples; /* whose pixels were taken */
	uint64_t failures;	 /* leases that ended by the worker's or the unit's fault */
	uint64_t welcomed;	 /* workers */
	uint64_t render_us;	 /* of render processes, on units whose pixels were taken */
};
struct pen_farm_totals pen_farm_totals(const struct pen_farm *farm);

/* What workers are at work on for a job, by its number; see pen_sched_held. */
size_t pen_farm_held(
	const struct pen_farm *farm, uint64_t number, struct pen_sched_held *ret_held, size_t max);

/* Units that could be leased now, and why they wait: "" when none do, else a sentence. */
uint64_t pen_farm_queue_depth(const struct pen_farm *farm);
const char *pen_farm_why_waiting(const struct pen_farm *farm);

#endif
