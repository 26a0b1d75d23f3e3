/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_CHAOS_WORLD_H
#define PEN_TESTS_CHAOS_WORLD_H

#include "server/dispatch.h"
#include "tests/chaos/event_queue.h"
#include "tests/chaos/simulation.h"

#include <stdbool.h>
#include <stdint.h>

/* The inside of a simulation: what there is, what happens by chance, and how messages travel. */

enum {
	JOBS_MAX = 10,
	WORKERS_MAX = 5,
	PROCESSES_MAX = 4,
	TILES_MAX = 16, /* of a frame */
	FRAMES_MAX = 5,
	CELLS_MAX = TILES_MAX * FRAMES_MAX,
	CONVICTED_MAX = 64,
	UNITS_MAX = 64, /* of a worker, those included that the coordinator has forgotten */
	HEAL_MS = 600000,
	END_MS = HEAL_MS + 8 * PEN_LEASE_HARD_MS,
	TICK_MS = 500,
	TORN = UINT16_MAX /* rounds in a framebuffer whose bytes fit no row */
};

/* In place of a peer: one of an earlier life of the coordinator. */
#define TAINT_EARLIER UINT64_MAX

enum lie {
	LIE_NONE,
	LIE_SIZE,
	LIE_HASH,
	LIE_NAN,
	LIE_COUNT,
	LIE_TILE,
	LIE_EPOCH,
	LIE_LEASE,
	LIES,
	LIE_PIXELS = LIES /* that cannot be seen; only liars tell it */
};

struct unit {
	struct pen_msg_lease lease;
	bool running, hung;
	uint64_t samples; /* finished */
};

struct sim_worker {
	uint32_t processes;
	const char *class_text;
	uint64_t connection; /* 0: none */
	struct unit units[UNITS_MAX];
	uint32_t count;
	bool leaving;
	bool trusted, liar;
	int64_t cut_until_ms;
	int64_t sent_ms[2]; /* the last message to and from it arrives: wires keep the order */
};

/* A worker as the coordinator sees it, with the ledger of its leases. */
struct peer {
	uint64_t id; /* 0: not connected */
	uint64_t connection;
	int64_t heard_ms;
	bool draining, quarantined;
	struct pen_msg_lease leases[2 * PROCESSES_MAX];
	uint32_t count;
};

struct sim_tile {
	uint16_t rounds;    /* merged, as this coordinator knows */
	uint16_t row, file; /* rounds in the store and in the framebuffer */
	uint32_t out;	    /* leases */
	bool merging;
	uint64_t committed; /* round and epoch of the last commit, plus 1 */
};

struct sim_frame {
	bool synced;
	bool deciding; /* a decision is on its way */
	/* After how many rounds it was decided what goes on, as is on the disk; 0: not yet. */
	uint32_t decided;
	uint32_t told; /* of which decision the dispatch knows */
};

struct sim_job {
	struct pen_job shown;
	char class_text[4];
	uint64_t incarnation; /* events of an older one are dropped */
	bool accepted, listed, paused;
	struct pen_rounds rounds;
	uint32_t round_count; /* of a pixel, at most */
	uint32_t poison;      /* the cell that always crashes; CELLS_MAX: none */
	uint32_t losses;      /* leases that brought nothing, of the current incarnation */
	int64_t canvas_ms;
	uint64_t taint;	      /* the peer of which it has wrong pixels; 0: none */
	uint32_t convictions; /* until it was listed */
	uint32_t opening; /* complete frames that a new coordinator brings onto the disk first */
	struct sim_frame frames[FRAMES_MAX];
	struct sim_tile cells[CELLS_MAX]; /* tiles of all frames */
};

/* Frames of a simulated job count from 1. */
static inline uint32_t sim_cell(const struct sim_job *job, uint32_t frame, uint32_t tile)
{
	return (frame - 1) * job->shown.tiling.count + tile;
}

static inline uint32_t sim_cell_count(const struct sim_job *job)
{
	return job->shown.frame_count * job->shown.tiling.count;
}

struct sim {
	struct sim_result *result;
	struct pen_dispatch *dispatch;
	struct event_queue queue;
	uint64_t random;
	uint32_t rate[SIM_FAULTS]; /* per mille */
	uint64_t connection_last, peer_last, lease_last, leaving;
	bool expect_merge;
	uint64_t teller; /* the peer of the result that is being taken */
	struct pen_msg_lease taken;
	enum lie lie;
	uint64_t convicted[CONVICTED_MAX]; /* peers; the last ones */
	uint32_t convictions;
	struct sim_worker workers[WORKERS_MAX];
	struct peer peers[WORKERS_MAX];
	uint32_t worker_count, job_count;
	struct sim_job jobs[JOBS_MAX];
};

/* What pen_clock_ms tells from now on. */
void sim_set_time(int64_t now_ms);

uint32_t sim_draw(struct sim *sim, uint32_t below);

/* Whether a fault strikes now; never after HEAL_MS. */
bool sim_strikes(struct sim *sim, enum sim_fault fault);

/* Adds a decision to the log. */
void sim_note(struct sim *sim, uint64_t what);

/* The run is over: a promise is broken. The first one counts. */
__attribute__((format(printf, 2, 3))) void sim_violate(struct sim *sim, const char *format, ...);

struct sim_job *sim_find_job(struct sim *sim, uint64_t number);

void sim_push(struct sim *sim, struct event event, int64_t delay_ms);
void sim_push_job(struct sim *sim, const struct sim_job *job, enum event_type type, uint32_t detail,
	int64_t delay_ms);

/* A message between a worker and the coordinator, which the wire may spoil. */
void sim_post(struct sim *sim, struct event event);
void sim_post_from(struct sim *sim, uint32_t index, struct event event);

#endif
