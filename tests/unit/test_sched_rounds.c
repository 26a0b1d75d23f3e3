/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/unit/sched_steps.h"

/* In which order frames, tiles and rounds are rendered, and what is decided between rounds. */

static void add_worker(struct pen_sched *sched, uint32_t processes)
{
	const struct pen_sched_worker worker = {1, processes, "a", false, false};

	assert_int_equal(pen_sched_add_worker(sched, &worker, NULL), 0);
}

/* Broken by: frames out of order, a process that idles between two, or an end before the last. */
static void test_frames(void **state)
{
	enum { FRAMES = 40, TILES = 4, LEASES = 16 };
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_action queue[FRAMES * TILES];
	struct pen_sched_actions actions;
	const struct pen_sched_job job = {.number = 1,
		.frame_first = 5,
		.frame_end = 5 + FRAMES,
		.rounds = pen_rounds_of(PEN_ROUNDS_UNIFORM, 1, 0)};
	size_t granted = 0;

	(void)state;
	add_frames(sched, job, 32);
	add_worker(sched, LEASES / 2);
	actions = tick(sched, 0);
	for (size_t done = 0; done < FRAMES * TILES; done++) {
		for (size_t i = 0; i < actions.count; i++)
			if (actions.items[i].type == PEN_SCHED_LEASE)
				queue[granted++] = actions.items[i];
		assert_int_equal(
			granted, done + LEASES < FRAMES * TILES ? done + LEASES : FRAMES * TILES);
		assert_int_equal(queue[done].frame, 5 + done / TILES);
		assert_int_equal(count(actions, PEN_SCHED_RENDERED), 0);
		actions = step(sched,
			(struct pen_sched_event){.type = PEN_SCHED_RESULT,
				.worker = 1,
				.lease = queue[done].lease,
				.u.seconds = 0.01},
			0);
		for (size_t i = 0; i < actions.count; i++)
			if (actions.items[i].type == PEN_SCHED_LEASE)
				queue[granted++] = actions.items[i];
		actions = step(sched,
			(struct pen_sched_event){.type = PEN_SCHED_MERGED,
				.job = 1,
				.u.merged = {queue[done].frame, queue[done].tile}},
			0);
	}
	assert_int_equal(count(actions, PEN_SCHED_RENDERED), 1);
	pen_sched_destroy(sched);
}

/* Broken by: leasing a tile's next round before the last one is merged. */
static void test_rounds_in_order(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;

	(void)state;
	add_frames(sched,
		(struct pen_sched_job){
			.number = 1, .rounds = pen_rounds_of(PEN_ROUNDS_UNIFORM, 20, 0)},
		16);
	add_worker(sched, 4);
	actions = tick(sched, 0);
	for (uint32_t round = 0; round < 3; round++) {
		assert_int_equal(count(actions, PEN_SCHED_LEASE), 1);
		lease = find(actions, PEN_SCHED_LEASE);
		assert_int_equal(lease.round, round);
		assert_int_equal(count(tick(sched, 1), PEN_SCHED_LEASE), 0);
		actions = finish_unit(sched, lease, 2);
	}
	assert_int_equal(find(actions, PEN_SCHED_RENDERED).job, 1);
	pen_sched_destroy(sched);
}

static struct pen_sched_actions decide(
	struct pen_sched *sched, uint64_t job, const struct pen_demand *demands)
{
	return step(sched,
		(struct pen_sched_event){
			.type = PEN_SCHED_DECIDED, .job = job, .u.decided = {1, demands}},
		0);
}

/* Broken by: a decision asked for before all is merged, twice, or never; tiles that skip a round
 * but are leased; an end while pixels go on. */
static void test_decisions(void **state)
{
	enum { TILES = 4 };
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease[TILES];
	struct pen_demand demands[TILES];
	const struct pen_sched_job job = {
		.number = 1, .rounds = pen_rounds_of(PEN_ROUNDS_ADAPTIVE, 64, 16)};

	(void)state;
	add_frames(sched, job, 32);
	add_worker(sched, 4);
	actions = tick(sched, 0);
	assert_int_equal(count(actions, PEN_SCHED_LEASE), TILES);
	for (size_t i = 0, n = 0; i < actions.count; i++)
		if (actions.items[i].type == PEN_SCHED_LEASE)
			lease[n++] = actions.items[i];
	for (uint32_t i = 0; i < TILES; i++) {
		assert_int_equal(count(tick(sched, 1), PEN_SCHED_DECIDE), 0);
		actions = finish_unit(sched, lease[i], 2);
		assert_int_equal(count(actions, PEN_SCHED_LEASE), 0);
	}
	assert_int_equal(find(actions, PEN_SCHED_DECIDE).frame, 1);
	assert_int_equal(count(tick(sched, 3), PEN_SCHED_DECIDE), 0);

	/* One tile goes on, and once more; the others have ended. */
	for (uint32_t i = 0; i < TILES; i++)
		demands[i] = (struct pen_demand){1, true, 256, 256 * 16};
	for (uint16_t round = 1; round < 3; round++) {
		demands[2] = (struct pen_demand){(uint16_t)(round + 1), false, 7, 7 * 64};
		actions = decide(sched, 1, demands);
		assert_int_equal(count(actions, PEN_SCHED_LEASE), 1);
		assert_int_equal(find(actions, PEN_SCHED_LEASE).tile, 2);
		assert_int_equal(find(actions, PEN_SCHED_LEASE).round, round);
		actions = finish_unit(sched, find(actions, PEN_SCHED_LEASE), 4);
		assert_int_equal(count(actions, PEN_SCHED_DECIDE), 1);
		assert_int_equal(count(actions, PEN_SCHED_RENDERED), 0);
	}
	demands[2] = (struct pen_demand){3, true, 7, 7 * 48};
	assert_int_equal(count(decide(sched, 1, demands), PEN_SCHED_RENDERED), 1);
	pen_sched_destroy(sched);
}

/*
 * Broken by: asking again after a restart what was decided before it (nobody answers for a frame
 * that is over, and the job would never end), or leasing rounds that the decision spares.
 */
static void test_earlier_decisions(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	const uint16_t merged[] = {1, 1, 0};
	const struct pen_demand demands[] = {
		{1, true, 256, 256 * 16}, {1, false, 256, 256 * 64}, {3, true, 7, 256 * 64}};
	const struct pen_sched_job job = {.number = 1,
		.frame_first = 1,
		.frame_end = 4,
		.rounds = pen_rounds_of(PEN_ROUNDS_ADAPTIVE, 64, 16),
		.merged = merged,
		.demands = demands};

	(void)state;
	add_frames(sched, job, 16);
	add_worker(sched, 4);
	actions = tick(sched, 0);
	assert_int_equal(count(actions, PEN_SCHED_DECIDE), 1);
	assert_int_equal(find(actions, PEN_SCHED_DECIDE).frame, 2);
	assert_int_equal(count(actions, PEN_SCHED_LEASE), 1);
	for (uint32_t round = 0; round < 3; round++) {
		assert_int_equal(find(actions, PEN_SCHED_LEASE).frame, 3);
		assert_int_equal(find(actions, PEN_SCHED_LEASE).round, round);
		actions = finish_unit(sched, find(actions, PEN_SCHED_LEASE), 1);
		assert_int_equal(count(actions, PEN_SCHED_DECIDE), 0);
	}
	actions = step(sched,
		(struct pen_sched_event){
			.type = PEN_SCHED_DECIDED, .job = 1, .u.decided = {2, demands}},
		2);
	assert_int_equal(count(actions, PEN_SCHED_RENDERED), 1);
	pen_sched_destroy(sched);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_frames),
		cmocka_unit_test(test_rounds_in_order),
		cmocka_unit_test(test_decisions),
		cmocka_unit_test(test_earlier_decisions),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
