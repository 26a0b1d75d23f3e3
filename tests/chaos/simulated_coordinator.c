/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/chaos/simulated_coordinator.h"

#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/base/limits.h"
#include "server/framebuf.h"
#include "tests/chaos/simulated_quota.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* In the detail of EVENT_SYNCED, beside the cell: what the dispatch is told after it. */
#define SYNC_MERGED  0x80000000u
#define SYNC_DECIDED 0x40000000u
#define SYNC_OPENED  0x20000000u

/* The ledger: what must be true of every lease, result and end */

static struct peer *find_peer(struct sim *sim, uint64_t id)
{
	for (uint32_t i = 0; i < sim->worker_count; i++)
		if (sim->peers[i].id == id)
			return &sim->peers[i];
	return NULL;
}

static struct pen_msg_lease *find_held(struct peer *peer, uint64_t lease)
{
	for (uint32_t i = 0; i < peer->count; i++)
		if (peer->leases[i].lease == lease)
			return &peer->leases[i];
	return NULL;
}

static void end_held(struct sim *sim, struct peer *peer, struct pen_msg_lease *held)
{
	struct sim_job *job = sim_find_job(sim, held->job);

	struct sim_tile *tile = &job->cells[sim_cell(job, held->frame, held->tile)];

	tile->out--;
	job->losses++;
	*held = peer->leases[--peer->count];
}

/* How many rounds of a cell the dispatch may lease. */
static uint32_t told_rounds(const struct sim_job *job, uint32_t cell)
{
	return sim_quota_demand(job, cell, job->frames[cell / job->shown.tiling.count].told).rounds;
}

/* Whether a frame is the first of its tiles to go out while another tile before it could. */
static bool skips_frame(const struct sim_job *job, uint32_t frame)
{
	for (uint32_t i = 0; i < job->shown.tiling.count; i++) {
		const struct sim_tile *tile = &job->cells[sim_cell(job, frame, i)];

		if (tile->out || tile->merging || tile->rounds > 0)
			return false;
	}
	for (uint32_t i = 0; i < sim_cell(job, frame, 0); i++)
		if (!job->cells[i].out && !job->cells[i].merging &&
			job->cells[i].rounds < told_rounds(job, i) && job->losses == 0)
			return true;
	return false;
}

/* Whether it is the second lease of a unit, after one of another worker. */
static bool is_twin(
	const struct sim *sim, const struct peer *holder, const struct pen_msg_lease *lease)
{
	uint32_t found = 0;

	for (uint32_t i = 0; i < sim->worker_count; i++)
		for (uint32_t k = 0; k < sim->peers[i].count; k++) {
			const struct pen_msg_lease *other = &sim->peers[i].leases[k];

			if (other->job != lease->job || other->frame != lease->frame ||
				other->tile != lease->tile)
				continue;
			if (&sim->peers[i] == holder || other->epoch != lease->epoch)
				return false;
			found++;
		}
	return found == 1;
}

static void check_lease(struct sim *sim, const struct peer *peer, const struct pen_msg_lease *lease)
{
	const struct sim_worker *worker = &sim->workers[peer - sim->peers];
	const struct sim_job *job = sim_find_job(sim, lease->job);
	const struct sim_tile *tile = &job->cells[sim_cell(job, lease->frame, lease->tile)];
	struct pen_rect rect = pen_tiling_rect(&job->shown.tiling, lease->tile);

	if (!job->listed || job->paused)
		sim_violate(
			sim, "a lease of render %u, which is not to go on", (unsigned)lease->job);
	if (peer->draining || peer->quarantined)
		sim_violate(sim, "a lease to a worker that leaves, or is in quarantine");
	if (peer->count == 2 * worker->processes)
		sim_violate(sim, "a lease to a worker that has enough");
	if (strcmp(job->class_text, worker->class_text) != 0)
		sim_violate(sim, "a lease to a worker of another class");
	if (lease->frame < 1 || lease->frame > job->shown.frame_count)
		sim_violate(sim, "a lease of frame %u, which there is not", lease->frame);
	if (skips_frame(job, lease->frame))
		sim_violate(sim, "frame %u begins while one before it waits", lease->frame);
	if (tile->merging || (tile->out > 0 && !is_twin(sim, peer, lease)))
		sim_violate(sim, "tile %u is leased twice at once", lease->tile);
	if (lease->round != tile->rounds ||
		lease->round >= told_rounds(job, sim_cell(job, lease->frame, lease->tile)))
		sim_violate(sim, "tile %u is leased out of order", lease->tile);
	if (lease->lease <= sim->lease_last)
		sim_violate(sim, "a lease's number is used again");
	if (memcmp(&rect, &lease->rect, sizeof rect) != 0)
		sim_violate(sim, "a lease with another tile's pixels");
}

static void check_mask(struct sim *sim, const struct pen_msg_lease *lease, const uint8_t *mask)
{
	const struct sim_job *job = sim_find_job(sim, lease->job);
	uint8_t wanted[PEN_MASK_BYTES_MAX];
	const bool is_masked = sim_quota_mask(job, lease->tile, lease->round, wanted);

	if ((mask != NULL) != is_masked ||
		(mask && memcmp(mask, wanted, pen_mask_bytes(lease->rect)) != 0))
		sim_violate(
			sim, "tile %u is leased with other pixels than were decided", lease->tile);
}

static void dispatch_lease(
	void *user, uint64_t id, const struct pen_msg_lease *lease, const uint8_t *mask)
{
	struct sim *sim = user;
	struct peer *peer = find_peer(sim, id);
	struct sim_job *job;
	uint32_t index;

	sim_note(sim, 1 ^ id << 4 ^ lease->lease << 12 ^ lease->job << 36 ^
			      (uint64_t)lease->tile << 44 ^ (uint64_t)lease->frame << 52);
	if (!peer) {
		sim_violate(sim, "a lease to a worker that has gone");
		return;
	}
	check_lease(sim, peer, lease);
	check_mask(sim, lease, mask);
	if (sim->result->violation[0] != '\0')
		return;
	sim->lease_last = lease->lease;
	job = sim_find_job(sim, lease->job);
	sim->result->doubled += job->cells[sim_cell(job, lease->frame, lease->tile)].out;
	job->cells[sim_cell(job, lease->frame, lease->tile)].out++;
	peer->leases[peer->count++] = *lease;
	index = (uint32_t)(peer - sim->peers);
	sim_post(sim, (struct event){.type = EVENT_LEASE,
			      .worker = index,
			      .connection = peer->connection,
			      .lease = *lease});
}

static void dispatch_revoke(void *user, uint64_t id, uint64_t lease)
{
	struct sim *sim = user;
	struct peer *peer = find_peer(sim, id);
	struct pen_msg_lease *held = peer ? find_held(peer, lease) : NULL;

	sim_note(sim, 2 ^ id << 4 ^ lease << 12);
	if (!held) {
		if (id != sim->leaving)
			sim_violate(sim, "a lease is revoked that is not live");
		return;
	}
	sim_post(sim, (struct event){.type = EVENT_REVOKE,
			      .worker = (uint32_t)(peer - sim->peers),
			      .connection = peer->connection,
			      .lease = *held});
	end_held(sim, peer, held);
}

static void dispatch_quarantined(void *user, uint64_t id, enum pen_dispatch_custody custody)
{
	struct sim *sim = user;
	struct peer *peer = find_peer(sim, id);

	sim_note(sim, 6 ^ id << 4 ^ (uint64_t)custody << 12);
	if (!peer || (peer->quarantined && custody == PEN_CUSTODY_STRIKES) ||
		(!peer->quarantined && custody == PEN_CUSTODY_NONE)) {
		sim_violate(sim, "a worker goes into quarantine, or out of it, that cannot");
		return;
	}
	if (custody == PEN_CUSTODY_LIAR && !sim->workers[peer - sim->peers].liar)
		sim_violate(sim, "an honest worker is convicted");
	peer->quarantined = custody != PEN_CUSTODY_NONE;
	sim->result->quarantines += peer->quarantined;
	if (custody != PEN_CUSTODY_LIAR)
		return;
	sim->convicted[sim->convictions++ % CONVICTED_MAX] = id;
	sim->result->convictions++;
}

static bool is_convicted(const struct sim *sim, uint64_t id)
{
	for (uint32_t i = 0; i < CONVICTED_MAX; i++)
		if (id != 0 && sim->convicted[i] == id)
			return true;
	return false;
}

static float stamp(uint64_t job, uint32_t cell, uint32_t round)
{
	return (float)((job * CELLS_MAX + cell) * 16 + round);
}

static const struct pen_job *dispatch_find(void *user, uint64_t number)
{
	return &sim_find_job(user, number)->shown;
}

static void dispatch_started(void *user, uint64_t number, const char *equivalence_class)
{
	struct sim_job *job = sim_find_job(user, number);

	(void)snprintf(job->class_text, sizeof job->class_text, "%s", equivalence_class);
	job->shown.equivalence_class = job->class_text;
}

/* Wrong ones may pass where nobody looked. */
static bool are_pixels_right(
	const struct sim *sim, struct sim_job *job, uint32_t cell, const float *pixels)
{
	if (pixels[0] == stamp(job->shown.number, cell, sim->taken.round))
		return true;
	if (sim->lie != LIE_PIXELS || job->shown.verify == PEN_VERIFY_FULL)
		return false;
	job->taint = sim->teller;
	return true;
}

/* Rounds and epochs of a tile's commits rise within one life of the coordinator and the job. */
static void check_commit(struct sim *sim, struct sim_tile *tile, const struct pen_msg_lease *lease)
{
	uint64_t key = ((uint64_t)lease->round << 32 | lease->epoch) + 1;

	if (key <= tile->committed)
		sim_violate(sim, "tile %u commits round %u twice", lease->tile, lease->round);
	tile->committed = key;
}

static void dispatch_merge(
	void *user, uint64_t number, uint32_t frame, uint32_t tile, uint32_t round, float *pixels)
{
	struct sim *sim = user;
	struct sim_job *job = sim_find_job(sim, number);
	uint32_t index = sim_cell(job, frame, tile);

	sim_note(sim, 3 ^ number << 4 ^ (uint64_t)index << 12 ^ (uint64_t)round << 20);
	if (!sim->expect_merge)
		sim_violate(sim, "a result without a live lease is merged");
	else if (round != job->cells[index].rounds || !are_pixels_right(sim, job, index, pixels))
		sim_violate(sim, "other pixels are merged than those that were leased");
	else
		check_commit(sim, &job->cells[index], &sim->taken);
	sim->expect_merge = false;
	job->cells[index].merging = true;
	free(pixels);
	sim->result->commits++;
	job->canvas_ms += sim_draw(sim, 40);
	if (job->canvas_ms < pen_clock_ms())
		job->canvas_ms = pen_clock_ms();
	sim_push_job(sim, job, EVENT_MERGED, index, job->canvas_ms - pen_clock_ms());
}

static bool is_complete(const struct sim_job *job)
{
	return sim_quota_final_frames(job) == job->shown.frame_count;
}

static bool dispatch_mask(void *user, uint64_t number, uint32_t frame, uint32_t tile,
	uint32_t round, uint8_t *ret_mask)
{
	(void)frame;
	return sim_quota_mask(sim_find_job(user, number), tile, round, ret_mask);
}

static void dispatch_decide(void *user, uint64_t number, uint32_t frame)
{
	struct sim *sim = user;
	struct sim_job *job = sim_find_job(sim, number);

	sim_note(sim, 5 ^ number << 4 ^ (uint64_t)frame << 12);
	if (job->frames[frame - 1].deciding)
		sim_violate(sim, "frame %u of render %u asks twice", frame, (unsigned)number);
	if (job->frames[frame - 1].synced)
		sim_violate(
			sim, "frame %u of render %u asks, but it is over", frame, (unsigned)number);
	for (uint32_t i = 0; i < job->shown.tiling.count; i++) {
		const uint32_t cell = sim_cell(job, frame, i);

		if (job->cells[cell].out || job->cells[cell].merging ||
			job->cells[cell].rounds < told_rounds(job, cell))
			sim_violate(sim, "frame %u of render %u asks before its rounds are merged",
				frame, (unsigned)number);
	}
	job->frames[frame - 1].deciding = true;
	sim_push_job(sim, job, EVENT_DECIDED, frame, sim_draw(sim, 60));
}

/* What the canvas does: nothing while tiles lack what was decided before, as after a restart. */
static void decide_frame(struct sim_job *job, uint32_t frame)
{
	struct sim_frame *f = &job->frames[frame - 1];
	bool is_final;

	if (sim_quota_is_met(job, frame, &is_final) && !is_final)
		f->decided = sim_quota_next(job, f->decided);
}

/* From nothing, with whatever workers there are. */
static void forget_pixels(struct sim_job *job)
{
	for (uint32_t i = 0; i < CELLS_MAX; i++)
		job->cells[i] = (struct sim_tile){0};
	memset(job->frames, 0, sizeof job->frames);
	job->class_text[0] = '\0';
	job->shown.equivalence_class = NULL;
	job->taint = 0;
}

static bool has_liar(const struct sim *sim)
{
	for (uint32_t i = 0; i < sim->worker_count; i++)
		if (sim->workers[i].liar)
			return true;
	return false;
}

static void dispatch_ended(
	void *user, uint64_t number, enum pen_dispatch_end end, const char *reason)
{
	struct sim *sim = user;
	struct sim_job *job = sim_find_job(sim, number);

	sim_note(sim, 4 ^ number << 4 ^ (uint64_t)end << 12);
	if (!job->listed)
		sim_violate(sim, "render %u ends twice", (unsigned)number);
	job->listed = false;
	job->incarnation++;
	switch (end) {
	case PEN_DISPATCH_RENDERED:
		if (!is_complete(job))
			sim_violate(sim, "render %u lacks a tile", (unsigned)number);
		if (is_convicted(sim, job->taint) ||
			(job->taint == TAINT_EARLIER && sim->convictions > job->convictions))
			sim_violate(sim, "render %u ends with a liar's pixels", (unsigned)number);
		sim->result->escapes += job->taint != 0;
		break;
	case PEN_DISPATCH_FAILED:
		if (strstr(reason, "disagree")
				? !has_liar(sim)
				: job->losses < PEN_BLAME_MAX || !strstr(reason, "tile"))
			sim_violate(sim, "render %u fails without a fault: %s", (unsigned)number,
				reason);
		sim_push_job(sim, job, EVENT_STORED, PEN_JOB_FAILED, sim_draw(sim, 50));
		break;
	case PEN_DISPATCH_ABANDONED:
	case PEN_DISPATCH_TAINTED:
		job->shown.restarts++;
		forget_pixels(job);
		sim_push_job(sim, job, EVENT_BEGIN, 0, sim_draw(sim, 50));
		break;
	}
}

/* The coordinator around the dispatch: server/farm.c, server/run.c and what is on the disk */

void sim_coordinator_start(struct sim *sim)
{
	struct pen_dispatch_jobs jobs = {dispatch_find, dispatch_started, dispatch_merge,
		dispatch_mask, dispatch_decide, dispatch_ended, NULL, NULL, sim};
	struct pen_dispatch_farm farm = {
		dispatch_lease, dispatch_revoke, dispatch_quarantined, sim};

	if (pen_dispatch_create(sim->random, &sim->dispatch, NULL) < 0)
		abort();
	pen_dispatch_connect_jobs(sim->dispatch, &jobs);
	pen_dispatch_connect_farm(sim->dispatch, &farm);
	sim->peer_last = sim->lease_last = 0;
	memset(sim->convicted, 0, sizeof sim->convicted);
}

/* The frame goes to the disk; what the dispatch waits for with that, if anything. */
static void sync_frame(struct sim *sim, struct sim_job *job, uint32_t cell, uint32_t then)
{
	sim_push_job(sim, job, EVENT_SYNCED, cell | then, sim_draw(sim, 100));
}

/* Gives the job to the dispatch, with what is rendered and decided already. */
static void dispatch_job(struct sim *sim, struct sim_job *job)
{
	uint16_t rounds[CELLS_MAX];
	struct pen_demand demands[CELLS_MAX];
	const uint32_t passed = sim_quota_final_frames(job);
	const uint32_t first = passed * job->shown.tiling.count;
	struct pen_sched_job added = {
		.number = job->shown.number,
		.tiling = &job->shown.tiling,
		.frame_first = 1 + passed,
		.frame_end = 1 + job->shown.frame_count,
		.rounds = pen_sampling_rounds(&job->shown.sampling),
		.priority = job->shown.priority,
		.restarted = job->shown.restarts > 0,
		.resumed = passed > 0,
		.verify = job->shown.verify,
		.paused = job->paused,
		.equivalence_class = job->shown.equivalence_class,
		.merged = rounds,
		.demands = demands,
	};

	for (uint32_t i = first; i < sim_cell_count(job); i++) {
		struct sim_frame *f = &job->frames[i / job->shown.tiling.count];

		f->told = f->decided;
		rounds[i - first] = job->cells[i].rounds;
		demands[i - first] = sim_quota_demand(job, i, f->told);
		added.resumed = added.resumed || job->cells[i].rounds > 0;
	}
	if (!added.resumed)
		job->taint = 0;
	job->losses = 0;
	job->listed = true;
	job->convictions = sim->convictions;
	if (pen_dispatch_add_job(sim->dispatch, &added, NULL) < 0)
		abort();
}

/* Frames that lack nothing go to the disk before the others go on. */
static void begin_job(struct sim *sim, struct sim_job *job)
{
	job->opening = 0;
	for (uint32_t i = 1; i <= job->shown.frame_count; i++)
		if (sim_quota_is_final(job, i)) {
			sync_frame(sim, job, sim_cell(job, i, 0), SYNC_OPENED);
			job->opening++;
		}
	if (job->opening == 0)
		dispatch_job(sim, job);
}

static void drop_peer(struct sim *sim, struct peer *peer)
{
	sim->leaving = peer->id;
	while (peer->count > 0)
		end_held(sim, peer, &peer->leases[0]);
	*peer = (struct peer){0};
	pen_dispatch_remove_worker(sim->dispatch, sim->leaving);
	sim->leaving = 0;
}

static void close_peer(struct sim *sim, struct peer *peer)
{
	sim_post(sim, (struct event){.type = EVENT_CLOSED,
			      .worker = (uint32_t)(peer - sim->peers),
			      .connection = peer->connection});
	drop_peer(sim, peer);
}

static void handle_hello(struct sim *sim, const struct event *event)
{
	struct peer *peer = &sim->peers[event->worker];
	const struct sim_worker *worker = &sim->workers[event->worker];
	struct pen_sched_worker added = {
		0, worker->processes, worker->class_text, worker->trusted, false};

	if (peer->id != 0)
		drop_peer(sim, peer);
	*peer = (struct peer){.id = ++sim->peer_last,
		.connection = event->connection,
		.heard_ms = pen_clock_ms()};
	added.id = peer->id;
	if (pen_dispatch_add_worker(sim->dispatch, &added, NULL) < 0)
		abort();
}

static void handle_tick(struct sim *sim)
{
	for (uint32_t i = 0; i < sim->worker_count; i++)
		if (sim->peers[i].id != 0 && pen_clock_ms() - sim->peers[i].heard_ms > PEN_DEAD_MS)
			close_peer(sim, &sim->peers[i]);
	pen_dispatch_tick(sim->dispatch);
	sim_push(sim, (struct event){.type = EVENT_TICK}, TICK_MS);
}

/* The pixels of a result, and what is said of them, both as the lie wants. */
static size_t make_result(const struct sim_job *job, const struct pen_msg_lease *lease,
	uint32_t cell, enum lie lie, float *pixels, struct pen_msg_result *ret_result)
{
	size_t size = pen_rect_area(lease->rect) * lease->channels * sizeof *pixels;
	float samples = (float)(lease->sample_end - lease->sample_first);
	uint8_t mask[PEN_MASK_BYTES_MAX];
	const bool is_masked = sim_quota_mask(job, lease->tile, lease->round, mask);

	memset(pixels, 0, size);
	for (size_t i = 0; i < pen_rect_area(lease->rect); i++)
		if (!is_masked || pen_mask_has(mask, i))
			pixels[i * lease->channels + PEN_CHANNEL_COUNT] = samples;
	pixels[0] = stamp(lease->job, cell, lease->round);
	/* Never the same twice. */
	if (lie == LIE_PIXELS) {
		pixels[0] += 0.125f;
		pixels[1] = (float)lease->lease;
	}
	if (lie == LIE_NAN)
		pixels[1] = NAN;
	/* Of the second pixel, which a mask leaves out, one is too many. */
	if (lie == LIE_COUNT && is_masked && pen_rect_area(lease->rect) > 1)
		pixels[lease->channels + PEN_CHANNEL_COUNT] = 1;
	else if (lie == LIE_COUNT)
		pixels[PEN_CHANNEL_COUNT] = samples + 1;
	*ret_result = (struct pen_msg_result){
		.lease = lease->lease + (lie == LIE_LEASE),
		.job = lease->job,
		.epoch = lease->epoch + (lie == LIE_EPOCH),
		.frame = lease->frame,
		.tile = lease->tile + (lie == LIE_TILE),
		.round = lease->round,
		.xxh3 = pen_xxh3(pixels, size) ^ (lie == LIE_HASH),
		.render_us = 1000 * (1 + (uint32_t)(lease->lease % 50)),
	};
	return lie == LIE_SIZE ? size - sizeof *pixels : size;
}

static void handle_result(struct sim *sim, struct peer *peer, const struct event *event)
{
	float pixels[16 * 16 * PEN_CHANNELS_MAX];
	struct pen_msg_result result;
	enum lie lie = (enum lie)event->detail;
	struct sim_job *job = sim_find_job(sim, event->lease.job);
	uint32_t cell = sim_cell(job, event->lease.frame, event->lease.tile);
	size_t size = make_result(job, &event->lease, cell, lie, pixels, &result);
	struct pen_msg_lease *held = find_held(peer, result.lease);
	enum pen_dispatch_outcome expected = PEN_OUTCOME_GONE, outcome;
	uint64_t samples;

	if (held && held->job == result.job && held->frame == result.frame &&
		held->tile == result.tile && held->round == result.round &&
		held->epoch == result.epoch)
		expected =
			lie == LIE_NONE || lie == LIE_PIXELS ? PEN_OUTCOME_GOOD : PEN_OUTCOME_BAD;
	sim->expect_merge = expected == PEN_OUTCOME_GOOD;
	sim->teller = peer->id;
	sim->lie = lie;
	if (expected != PEN_OUTCOME_GONE) {
		sim->taken = *held;
		end_held(sim, peer, held);
	} else {
		sim->result->stale++;
	}
	outcome = pen_dispatch_result(sim->dispatch, peer->id, &result, pixels, size, &samples);
	if (sim->expect_merge && job->shown.verify == PEN_VERIFY_NONE)
		sim_violate(sim, "a good result of tile %u is not merged", event->lease.tile);
	sim->expect_merge = false;
	if (outcome != expected)
		sim_violate(sim, "a result of tile %u is taken as %u instead of %u",
			event->lease.tile, (unsigned)outcome, (unsigned)expected);
}

static void handle_failure(struct sim *sim, struct peer *peer, const struct event *event)
{
	struct pen_msg_failure failure = {
		event->lease.lease, (enum pen_fault)event->detail, "render process ended"};
	struct pen_msg_lease *held = find_held(peer, failure.lease);
	bool live = held != NULL;

	if (live)
		end_held(sim, peer, held);
	if ((pen_dispatch_failure(sim->dispatch, peer->id, &failure) != PEN_OUTCOME_GONE) != live)
		sim_violate(sim, "a failure counts although its lease is not live, or does not");
}

/* A message that has arrived, of a connection that is still open. */
static void handle_message(struct sim *sim, struct peer *peer, const struct event *event)
{
	struct pen_msg_heartbeat heartbeat = {
		event->lease.lease != 0, &event->lease.lease, &event->samples};

	peer->heard_ms = pen_clock_ms();
	switch (event->type) {
	case EVENT_PROGRESS: pen_dispatch_progress(sim->dispatch, peer->id, &heartbeat); break;
	case EVENT_RESULT: handle_result(sim, peer, event); break;
	case EVENT_FAILURE: handle_failure(sim, peer, event); break;
	case EVENT_DRAINING:
		peer->draining = true;
		pen_dispatch_drain_worker(sim->dispatch, peer->id);
		break;
	default: drop_peer(sim, peer); break;
	}
}

/* A frame's last tile is told to the dispatch when the frame is on the disk. */
static void handle_merged(struct sim *sim, struct sim_job *job, uint32_t index)
{
	struct sim_tile *tile = &job->cells[index];
	uint32_t tiles = job->shown.tiling.count;
	uint32_t frame = 1 + index / tiles;

	tile->file = ++tile->rounds;
	sim_push_job(sim, job, EVENT_FLUSHED, index, sim_draw(sim, 1000));
	if (sim_quota_is_final(job, frame)) {
		sync_frame(sim, job, index, SYNC_MERGED);
		return;
	}
	tile->merging = false;
	pen_dispatch_merged(sim->dispatch, job->shown.number, frame, index % tiles);
}

static void tell_decided(struct sim *sim, struct sim_job *job, uint32_t frame)
{
	struct sim_frame *f = &job->frames[frame - 1];
	struct pen_demand demands[TILES_MAX];

	for (uint32_t i = 0; i < job->shown.tiling.count; i++)
		demands[i] = sim_quota_demand(job, sim_cell(job, frame, i), f->decided);
	f->deciding = false;
	f->told = f->decided;
	pen_dispatch_decided(sim->dispatch, job->shown.number, frame, demands);
}

/* A frame that lacks nothing any more is told when it is on the disk. */
static void handle_decided(struct sim *sim, struct sim_job *job, uint32_t frame)
{
	decide_frame(job, frame);
	if (sim_quota_is_final(job, frame))
		sync_frame(sim, job, sim_cell(job, frame, 0), SYNC_DECIDED);
	else
		tell_decided(sim, job, frame);
}

static void handle_synced(struct sim *sim, struct sim_job *job, uint32_t detail)
{
	uint32_t index = detail & ~(SYNC_MERGED | SYNC_DECIDED | SYNC_OPENED);
	uint32_t tiles = job->shown.tiling.count;
	bool all = true;

	job->frames[index / tiles].synced = true;
	if (detail & SYNC_MERGED) {
		job->cells[index].merging = false;
		pen_dispatch_merged(
			sim->dispatch, job->shown.number, 1 + index / tiles, index % tiles);
	}
	if (detail & SYNC_DECIDED)
		tell_decided(sim, job, 1 + index / tiles);
	if ((detail & SYNC_OPENED) && --job->opening == 0 && !is_complete(job))
		dispatch_job(sim, job);
	for (uint32_t i = 0; i < job->shown.frame_count; i++)
		all = all && job->frames[i].synced;
	if (all && job->listed)
		sim_violate(sim, "render %u does not end", (unsigned)job->shown.number);
	if (all)
		sim_push_job(sim, job, EVENT_STORED, PEN_JOB_DONE, sim_draw(sim, 50));
}

static void handle_stored(struct sim *sim, struct sim_job *job, enum pen_job_state state)
{
	job->shown.state = state;
	sim->result->done += state == PEN_JOB_DONE;
	sim->result->failed += state == PEN_JOB_FAILED;
	sim->result->cancelled += state == PEN_JOB_CANCELLED;
	for (uint32_t i = 0; state == PEN_JOB_DONE && i < sim_cell_count(job); i++)
		if (!job->frames[i / job->shown.tiling.count].synced ||
			!sim_quota_is_final(job, 1 + i / job->shown.tiling.count) ||
			job->cells[i].file != job->cells[i].rounds)
			sim_violate(sim, "render %u is done without its pixels",
				(unsigned)job->shown.number);
}

static void handle_job(struct sim *sim, struct sim_job *job, const struct event *event)
{
	switch (event->type) {
	case EVENT_SUBMIT:
		job->accepted = true;
		begin_job(sim, job);
		break;
	case EVENT_BEGIN: begin_job(sim, job); break;
	case EVENT_MERGED: handle_merged(sim, job, event->detail); break;
	case EVENT_FLUSHED: job->cells[event->detail].row = job->cells[event->detail].rounds; break;
	case EVENT_SYNCED: handle_synced(sim, job, event->detail); break;
	case EVENT_DECIDED: handle_decided(sim, job, event->detail); break;
	default: handle_stored(sim, job, (enum pen_job_state)event->detail); break;
	}
}

/* A decision on its way has reached the disk or not; a few are not whole any more. */
static void recover_frames(struct sim *sim, struct sim_job *job, bool power)
{
	for (uint32_t i = 0; i < job->shown.frame_count; i++) {
		struct sim_frame *f = &job->frames[i];

		if (f->deciding && sim_draw(sim, 2) == 0)
			decide_frame(job, 1 + i);
		if (power && sim_draw(sim, 8) == 0)
			f->decided = 0;
		f->synced = f->deciding = false;
		f->told = 0;
	}
}

/* What a new coordinator finds: rows, and framebuffers that fit them or not. */
static void recover_job(struct sim *sim, struct sim_job *job, bool power)
{
	bool was_synced[FRAMES_MAX];

	for (uint32_t i = 0; i < job->shown.frame_count; i++)
		was_synced[i] = job->frames[i].synced;
	recover_frames(sim, job, power);
	for (uint32_t i = 0; i < sim_cell_count(job); i++) {
		struct sim_tile *tile = &job->cells[i];

		if (tile->merging && sim_draw(sim, 2) == 0)
			tile->file = (uint16_t)(tile->rounds + 1);
		if (power && !was_synced[i / job->shown.tiling.count] && sim_draw(sim, 3) == 0)
			tile->file = TORN;
		tile->rounds = tile->file == tile->row ? tile->row : 0;
		if (tile->rounds >
			sim_quota_demand(job, i, job->frames[i / job->shown.tiling.count].decided)
				.rounds)
			tile->rounds = 0;
		tile->out = 0;
		tile->merging = false;
		tile->committed = 0;
	}
	job->incarnation++;
	job->listed = false;
	job->canvas_ms = 0;
	job->taint = job->taint != 0 ? TAINT_EARLIER : 0;
}

void sim_coordinator_restart(struct sim *sim, bool power)
{
	pen_dispatch_destroy(sim->dispatch);
	sim_coordinator_start(sim);
	for (uint32_t i = 0; i < sim->worker_count; i++) {
		sim->peers[i] = (struct peer){0};
		if (sim->workers[i].connection != 0)
			sim_post_from(sim, i, (struct event){.type = EVENT_CLOSED});
	}
	for (uint32_t i = 0; i < sim->job_count; i++) {
		struct sim_job *job = &sim->jobs[i];

		if (!job->accepted || job->shown.state >= PEN_JOB_DONE)
			continue;
		recover_job(sim, job, power);
		begin_job(sim, job);
	}
}

void sim_coordinator_pause(struct sim *sim, struct sim_job *job, bool paused)
{
	job->paused = paused;
	if (paused)
		pen_dispatch_pause_job(sim->dispatch, job->shown.number);
	else
		pen_dispatch_resume_job(sim->dispatch, job->shown.number);
}

void sim_coordinator_cancel(struct sim *sim, struct sim_job *job)
{
	job->listed = false;
	job->incarnation++;
	pen_dispatch_remove_job(sim->dispatch, job->shown.number);
	sim_push_job(sim, job, EVENT_STORED, PEN_JOB_CANCELLED, sim_draw(sim, 50));
}

void sim_coordinator_handle(struct sim *sim, const struct event *event)
{
	struct peer *peer = &sim->peers[event->worker];
	struct sim_job *job = event->job != 0 ? sim_find_job(sim, event->job) : NULL;

	if (event->type == EVENT_TICK)
		handle_tick(sim);
	else if (event->type == EVENT_HELLO)
		handle_hello(sim, event);
	else if (job && event->incarnation == job->incarnation)
		handle_job(sim, job, event);
	else if (!job && peer->id != 0 && peer->connection == event->connection)
		handle_message(sim, peer, event);
}
