/* SPDX-License-Identifier: Apache-2.0 */

/*
 * Any bytes as the results of a worker that has leases: of the right unit or not, the right size or
 * not, with a digest that fits or not. What is merged is finite, of the unit's size, and counts no
 * more samples than were asked for.
 */
#include "core/base/clock.h"
#include "core/base/digest.h"
#include "server/dispatch.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { SIDE = 16, LEASES = 4 };

struct state {
	struct pen_dispatch *dispatch;
	struct pen_job job;
	struct pen_msg_lease leases[LEASES];
	unsigned lease_count;
	bool has_mask;
	const struct pen_msg_lease *taken; /* whose result is being told */
};

static void check(bool holds)
{
	if (!holds)
		abort();
}

static const struct pen_job *find(void *user, uint64_t number)
{
	struct state *state = user;

	return number == 1 ? &state->job : NULL;
}

static void started(void *user, uint64_t number, const char *equivalence_class)
{
	(void)user, (void)number, (void)equivalence_class;
}

static void merge(
	void *user, uint64_t number, uint32_t frame, uint32_t tile, uint32_t round, float *pixels)
{
	struct state *state = user;
	const struct pen_film film = pen_job_film(&state->job);
	const struct pen_msg_lease *lease = state->taken;

	check(lease && number == 1 && lease->frame == frame && lease->tile == tile &&
		lease->round == round);
	for (uint64_t i = 0; i < pen_rect_area(lease->rect); i++) {
		const float *pixel = pixels + i * film.channels;
		const float most = (float)(lease->sample_end - lease->sample_first);

		for (uint32_t c = 0; c < film.channels; c++)
			check(isfinite(pixel[c]));
		check(pixel[PEN_CHANNEL_COUNT] >= 0 && pixel[PEN_CHANNEL_COUNT] <= most);
		check(!state->has_mask || i % 2 == 0 || pixel[PEN_CHANNEL_COUNT] == 0);
	}
	free(pixels);
}

/* Of every second pixel. */
static bool mask(void *user, uint64_t number, uint32_t frame, uint32_t tile, uint32_t round,
	uint8_t *ret_mask)
{
	struct state *state = user;

	(void)number, (void)frame, (void)tile, (void)round;
	memset(ret_mask, 0x55, SIDE * SIDE / 8);
	return state->has_mask;
}

static void decide(void *user, uint64_t number, uint32_t frame)
{
	(void)user, (void)number, (void)frame;
}

static void ended(void *user, uint64_t number, enum pen_dispatch_end end, const char *reason)
{
	(void)user, (void)number, (void)end, (void)reason;
}

static void reported(void *user, const struct pen_msg_scene_report *report)
{
	(void)user, (void)report;
}

static bool text(void *user, const struct pen_sha256 *sha256, int *ret_fd, uint64_t *ret_size)
{
	(void)user, (void)sha256, (void)ret_fd, (void)ret_size;
	return false;
}

static void leased(
	void *user, uint64_t worker, const struct pen_msg_lease *lease, const uint8_t *pixels)
{
	struct state *state = user;

	check(worker == 1 && (pixels != NULL) == state->has_mask);
	state->leases[state->lease_count++ % LEASES] = *lease;
}

static void revoked(void *user, uint64_t worker, uint64_t lease)
{
	(void)user, (void)worker, (void)lease;
}

static void quarantined(void *user, uint64_t worker, enum pen_dispatch_custody custody)
{
	(void)user, (void)worker, (void)custody;
}

static void open_state(struct state *state, uint8_t how)
{
	const struct pen_dispatch_jobs jobs = {
		find, started, merge, mask, decide, ended, reported, text, state};
	const struct pen_dispatch_farm farm = {leased, revoked, quarantined, state};
	struct pen_sched_job given = {.number = 1, .frame_first = 1, .frame_end = 2};
	const struct pen_sched_worker worker = {.id = 1, .processes = 2, .equivalence_class = "a"};

	state->has_mask = how % 2 != 0;
	state->job.sampling = (struct pen_sampling_desc){.samples = 16};
	state->job.aovs = how / 2 % 4;
	state->job.verify = (enum pen_verify)(how / 8 % 3);
	state->job.number = 1;
	pen_tiling_init(
		&state->job.tiling, (struct pen_rect){0, 0, 2 * SIDE, SIDE - how / 64}, SIDE);
	given.tiling = &state->job.tiling;
	given.rounds = pen_sampling_rounds(&state->job.sampling);
	given.verify = state->job.verify;
	check(pen_dispatch_create(1, &state->dispatch, NULL) == 0);
	pen_dispatch_connect_jobs(state->dispatch, &jobs);
	pen_dispatch_connect_farm(state->dispatch, &farm);
	check(pen_dispatch_add_worker(state->dispatch, &worker, NULL) == 0);
	check(pen_dispatch_add_job(state->dispatch, &given, NULL) == 0);
}

/* A result from a few bytes: how says what is wrong with it, the rest is repeated as pixels. */
static void tell(struct state *state, const uint8_t *data, size_t size)
{
	const uint8_t how = data[0];
	const struct pen_msg_lease *lease = &state->leases[how % LEASES];
	const size_t whole = pen_rect_area(lease->rect) * lease->channels * sizeof(float);
	const size_t told = how & 4 ? whole : (size_t)data[1] * 8;
	struct pen_msg_result result = {.lease = lease->lease,
		.job = lease->job,
		.epoch = lease->epoch + (how >> 5 == 1),
		.tile = lease->tile + (how >> 5 == 2),
		.frame = lease->frame + (how >> 5 == 3),
		.round = lease->round + (how >> 5 == 4),
		.render_us = data[1]};
	char *payload = calloc(1, told + 1);
	uint64_t samples;

	if (!payload)
		return;
	if (size > 2)
		for (size_t i = 0; i < told; i++)
			payload[i] = (char)data[2 + i % (size - 2)];
	result.xxh3 = how & 8 ? pen_xxh3(payload, told) : data[1];
	state->taken = lease;
	if (pen_dispatch_result(state->dispatch, 1, &result, payload, told, &samples) ==
		PEN_OUTCOME_GOOD)
		check(told == whole && how >> 5 != 1 && how >> 5 != 2 && how >> 5 != 3);
	state->taken = NULL;
	free(payload);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct state state = {0};
	size_t piece;

	if (size == 0)
		return 0;
	open_state(&state, data[0]);
	for (data++, size--; size > 3; data += piece, size -= piece) {
		piece = 3u + data[2] % 64u;
		piece = piece < size ? piece : size;
		tell(&state, data, piece);
	}
	pen_dispatch_destroy(state.dispatch);
	return 0;
}
