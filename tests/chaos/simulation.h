/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_CHAOS_SIMULATION_H
#define PEN_TESTS_CHAOS_SIMULATION_H

#include <stdint.h>

/*
 * A farm in virtual time: the real server/dispatch.c and server/sched.c between simulated workers,
 * wires, framebuffers and rows, which fail as the seed says. After a while the faults cease; then
 * every render must come to its end. What the dispatch and the scheduler do is checked against a
 * naive ledger at every step.
 */

enum sim_fault {
	SIM_CRASH,     /* a render process ends by its own fault */
	SIM_KILL,      /* a render process is killed from outside */
	SIM_HANG,      /* a unit goes on for ever */
	SIM_SLOW,      /* a unit takes up to 50 times as long */
	SIM_LIE,       /* a result that cannot be right, or claims another unit */
	SIM_LOSE,      /* a message never arrives */
	SIM_REPEAT,    /* a message arrives twice */
	SIM_REORDER,   /* a message is overtaken by later ones */
	SIM_PARTITION, /* a worker and the coordinator do not hear each other for a while */
	SIM_WORKER,    /* a worker dies */
	SIM_DRAIN,     /* a worker leaves in good order */
	SIM_RESTART,   /* the coordinator dies: rows not yet stored are lost */
	SIM_POWER,     /* the same, and framebuffers lose what was not synced */
	SIM_USER,      /* a render is paused, resumed or cancelled */
	SIM_FAULTS
};

extern const char *const sim_fault_names[SIM_FAULTS];

struct sim_result {
	uint64_t log; /* digest of all decisions: the same seed gives the same */
	uint64_t fired[SIM_FAULTS];
	uint64_t steps, commits, stale; /* stale: results that came too late */
	uint64_t doubled, quarantines;	/* stragglers that were leased again; workers */
	uint64_t convictions, escapes;	/* liars; renders that are done with their pixels */
	uint32_t done, failed, cancelled;
	char violation[256]; /* "": none */
};

void sim_run(uint64_t seed, struct sim_result *ret_result);

#endif
