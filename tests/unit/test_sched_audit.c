/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/unit/sched_steps.h"

#include "core/base/limits.h"

#include <stdbool.h>
#include <string.h>

/* Units that are rendered a second time: of whom, how often, and who is believed. */

enum { RIGHT = 7, WRONG = 8 };

static void add_worker(struct pen_sched *sched, uint64_t id, bool trusted)
{
	struct pen_sched_worker worker = {id, 1, "a", trusted, false};

	assert_int_equal(pen_sched_add_worker(sched, &worker, NULL), 0);
}

static void add_job(struct pen_sched *sched, uint64_t number, uint32_t side, enum pen_verify verify)
{
	add_frames(sched,
		(struct pen_sched_job){.number = number,
			.rounds = pen_rounds_of(PEN_ROUNDS_UNIFORM, 1, 0),
			.verify = verify},
		side);
}

static struct pen_sched_actions refuse(struct pen_sched *sched, struct pen_sched_action lease)
{
	return pen_sched_step(sched,
		&(struct pen_sched_event){.type = PEN_SCHED_FAILURE,
			.worker = lease.worker,
			.lease = lease.lease,
			.u.failure = {PEN_SCHED_FAULT_OWN, "wrong size"}},
		0);
}

static struct pen_sched_actions result(
	struct pen_sched *sched, struct pen_sched_action lease, uint64_t digest)
{
	return pen_sched_step(sched,
		&(struct pen_sched_event){.type = PEN_SCHED_RESULT,
			.worker = lease.worker,
			.lease = lease.lease,
			.digest = digest,
			.u.seconds = 0.01},
		0);
}

/* Broken by: counting what one worker alone has made, or asking that one again. */
static void test_agreement(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;
	uint64_t first;

	(void)state;
	add_job(sched, 1, 16, PEN_VERIFY_FULL);
	add_worker(sched, 1, false);
	add_worker(sched, 2, false);
	lease = find(tick(sched, 0), PEN_SCHED_LEASE);
	first = lease.worker;
	actions = result(sched, lease, RIGHT);
	assert_int_equal(count(actions, PEN_SCHED_COMMIT), 0);
	lease = find(actions, PEN_SCHED_LEASE);
	assert_int_not_equal(lease.worker, first);
	actions = result(sched, lease, RIGHT);
	assert_int_equal(find(actions, PEN_SCHED_COMMIT).tile, 0);
	assert_int_equal(count(actions, PEN_SCHED_CONVICTED), 0);
	pen_sched_destroy(sched);
}

/* Broken by: rendering a second time what nobody has asked for. */
static void test_no_verification(void **state)
{
	struct pen_sched *sched = make_sched(1);

	(void)state;
	add_job(sched, 1, 16, PEN_VERIFY_NONE);
	add_worker(sched, 1, false);
	assert_int_equal(count(result(sched, find(tick(sched, 0), PEN_SCHED_LEASE), RIGHT),
				 PEN_SCHED_COMMIT),
		1);
	pen_sched_destroy(sched);
}

/* Broken by: convicting the honest of two, or committing before a third has spoken. */
static void test_a_third_decides(void **state)
{
	for (unsigned liar_first = 0; liar_first < 2; liar_first++) {
		struct pen_sched *sched = make_sched(1);
		struct pen_sched_actions actions;
		struct pen_sched_action lease;
		uint64_t first, second;

		(void)state;
		add_job(sched, 1, 16, PEN_VERIFY_FULL);
		for (uint64_t id = 1; id <= 3; id++)
			add_worker(sched, id, false);
		lease = find(tick(sched, 0), PEN_SCHED_LEASE);
		first = lease.worker;
		lease = find(result(sched, lease, liar_first ? WRONG : RIGHT), PEN_SCHED_LEASE);
		second = lease.worker;
		actions = result(sched, lease, liar_first ? RIGHT : WRONG);
		assert_int_equal(count(actions, PEN_SCHED_COMMIT), 0);
		assert_int_equal(count(actions, PEN_SCHED_CONVICTED), 0);
		lease = find(actions, PEN_SCHED_LEASE);
		assert_true(lease.worker != first && lease.worker != second);
		actions = result(sched, lease, RIGHT);
		assert_int_equal(count(actions, PEN_SCHED_COMMIT), 1);
		assert_int_equal(
			find(actions, PEN_SCHED_CONVICTED).worker, liar_first ? first : second);
		pen_sched_destroy(sched);
	}
}

/* Broken by: asking for a third where one of the two is trusted, or believing the other one. */
static void test_trust_decides(void **state)
{
	for (uint64_t trusted = 1; trusted <= 2; trusted++) {
		struct pen_sched *sched = make_sched(1);
		struct pen_sched_actions actions;
		struct pen_sched_action lease;

		(void)state;
		add_job(sched, 1, 16, PEN_VERIFY_FULL);
		add_worker(sched, 1, trusted == 1);
		add_worker(sched, 2, trusted == 2);
		lease = find(tick(sched, 0), PEN_SCHED_LEASE);
		lease = find(result(sched, lease, lease.worker == trusted ? RIGHT : WRONG),
			PEN_SCHED_LEASE);
		actions = result(sched, lease, lease.worker == trusted ? RIGHT : WRONG);
		assert_int_equal(find(actions, PEN_SCHED_CONVICTED).worker, 3 - trusted);
		/* Either it was the trusted one that spoke last, or it is asked to say it again. */
		if (lease.worker != trusted)
			actions = result(sched, find(actions, PEN_SCHED_LEASE), RIGHT);
		assert_int_equal(count(actions, PEN_SCHED_COMMIT), 1);
		pen_sched_destroy(sched);
	}
}

/* Broken by: a guess when nobody can decide, a wait without end, or a reason without the tile. */
static void test_nobody_decides(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;

	(void)state;
	add_job(sched, 1, 16, PEN_VERIFY_FULL);
	add_worker(sched, 1, false);
	add_worker(sched, 2, false);
	lease = find(result(sched, find(tick(sched, 0), PEN_SCHED_LEASE), RIGHT), PEN_SCHED_LEASE);
	actions = result(sched, lease, WRONG);
	assert_int_equal(actions.count, 0);
	(void)tick(sched, 1000);
	assert_int_equal(tick(sched, 999 + PEN_CLASS_ABSENT_MS).count, 0);
	actions = tick(sched, 1000 + PEN_CLASS_ABSENT_MS);
	assert_non_null(strstr(find(actions, PEN_SCHED_FAILED).text, "tile 0"));
	assert_non_null(strstr(find(actions, PEN_SCHED_FAILED).text, "workers 1 and 2"));
	pen_sched_destroy(sched);
}

/* Broken by: a render that waits for a second worker for ever, or a lone one that is believed
 * although it says two things. */
static void test_a_lone_worker(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;

	(void)state;
	add_job(sched, 1, 16, PEN_VERIFY_FULL);
	add_worker(sched, 1, false);
	lease = find(result(sched, find(tick(sched, 0), PEN_SCHED_LEASE), WRONG), PEN_SCHED_LEASE);
	actions = result(sched, lease, RIGHT);
	assert_int_equal(count(actions, PEN_SCHED_COMMIT), 0);
	assert_int_equal(count(actions, PEN_SCHED_CONVICTED), 0);
	lease = find(result(sched, find(actions, PEN_SCHED_LEASE), RIGHT), PEN_SCHED_LEASE);
	assert_int_equal(count(result(sched, lease, RIGHT), PEN_SCHED_COMMIT), 1);
	pen_sched_destroy(sched);
}

/* Broken by: a worker whose results cannot be taken, and that is asked again and again for the
 * second one of a tile, until the render of the honest one fails. */
static void test_who_fails_at_a_tile_is_not_asked_again(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;
	uint64_t honest;

	(void)state;
	add_job(sched, 1, 16, PEN_VERIFY_FULL);
	add_worker(sched, 1, false);
	add_worker(sched, 2, false);
	lease = find(tick(sched, 0), PEN_SCHED_LEASE);
	honest = lease.worker;
	lease = find(result(sched, lease, RIGHT), PEN_SCHED_LEASE);
	assert_int_not_equal(lease.worker, honest);
	lease = find(refuse(sched, lease), PEN_SCHED_LEASE);
	assert_int_equal(lease.worker, honest);
	actions = result(sched, lease, RIGHT);
	assert_int_equal(count(actions, PEN_SCHED_COMMIT), 1);
	assert_int_equal(count(actions, PEN_SCHED_FAILED), 0);
	pen_sched_destroy(sched);
}

/* Broken by: leaving what a liar has made of other renders, or redoing those that it was not at. */
static void test_what_a_liar_did_is_redone(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;

	(void)state;
	add_worker(sched, 1, false);
	add_job(sched, 1, 64, PEN_VERIFY_NONE);
	lease = find(tick(sched, 0), PEN_SCHED_LEASE);
	assert_int_equal(count(result(sched, lease, WRONG), PEN_SCHED_COMMIT), 1);
	(void)pen_sched_step(
		sched, &(struct pen_sched_event){.type = PEN_SCHED_JOB_PAUSE, .job = 1}, 0);
	add_worker(sched, 2, true);
	add_job(sched, 2, 16, PEN_VERIFY_FULL);
	add_job(sched, 3, 16, PEN_VERIFY_FULL);
	actions = tick(sched, 0);
	for (unsigned step = 0; count(actions, PEN_SCHED_CONVICTED) == 0 && step < 8; step++) {
		lease = find(actions, PEN_SCHED_LEASE);
		actions = result(sched, lease, lease.worker == 1 ? WRONG : RIGHT);
	}
	assert_int_equal(find(actions, PEN_SCHED_CONVICTED).worker, 1);
	assert_int_equal(count(actions, PEN_SCHED_TAINTED), 1);
	assert_int_equal(find(actions, PEN_SCHED_TAINTED).job, 1);
	assert_int_equal(pen_sched_processes(sched), 1);
	/* Not even after the time that strikes cost. */
	assert_int_equal(count(tick(sched, 10 * PEN_QUARANTINE_MS), PEN_SCHED_RELEASED), 0);
	pen_sched_destroy(sched);
}

static struct pen_sched_actions leave(struct pen_sched *sched, uint64_t worker)
{
	return pen_sched_step(sched,
		&(struct pen_sched_event){.type = PEN_SCHED_WORKER_LEAVE, .worker = worker}, 0);
}

/* Broken by: a second opinion of its own that makes a worker's pixels seen by another. */
static void test_what_a_lone_liar_did_is_redone(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;

	(void)state;
	add_job(sched, 1, 32, PEN_VERIFY_FULL);
	add_worker(sched, 1, false);
	actions = tick(sched, 0);
	lease = find(result(sched, find(actions, PEN_SCHED_LEASE), WRONG), PEN_SCHED_LEASE);
	for (actions = result(sched, lease, WRONG); count(actions, PEN_SCHED_COMMIT) == 0;)
		actions = result(sched, find(actions, PEN_SCHED_LEASE), WRONG);
	add_worker(sched, 2, true);
	for (unsigned step = 0; count(actions, PEN_SCHED_CONVICTED) == 0 && step < 8; step++) {
		lease = find(actions, PEN_SCHED_LEASE);
		actions = result(sched, lease, lease.worker == 1 ? WRONG : RIGHT);
	}
	assert_int_equal(find(actions, PEN_SCHED_CONVICTED).worker, 1);
	assert_int_equal(find(actions, PEN_SCHED_TAINTED).job, 1);
	pen_sched_destroy(sched);
}

/* Broken by: the word of a worker that left, which the same one confirms when it comes again. */
static void test_nobody_confirms_itself_by_coming_again(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;

	(void)state;
	add_job(sched, 1, 16, PEN_VERIFY_FULL);
	add_worker(sched, 1, false);
	(void)result(sched, find(tick(sched, 0), PEN_SCHED_LEASE), WRONG);
	(void)leave(sched, 1);
	add_worker(sched, 2, false);
	add_worker(sched, 3, false);
	lease = find(tick(sched, 0), PEN_SCHED_LEASE);
	actions = result(sched, lease, WRONG);
	assert_int_equal(count(actions, PEN_SCHED_COMMIT), 0);
	assert_int_not_equal(find(actions, PEN_SCHED_LEASE).worker, lease.worker);
	pen_sched_destroy(sched);
}

/* Broken by: forgetting what a worker has said when it leaves, or not to look again for it. */
static void test_who_left_is_found_out(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions = {0};
	struct pen_sched_action lease;

	(void)state;
	add_worker(sched, 1, false);
	add_job(sched, 1, 64, PEN_VERIFY_NONE);
	(void)result(sched, find(tick(sched, 0), PEN_SCHED_LEASE), WRONG);
	(void)pen_sched_step(
		sched, &(struct pen_sched_event){.type = PEN_SCHED_JOB_PAUSE, .job = 1}, 0);
	add_job(sched, 2, 16, PEN_VERIFY_SPOT);
	(void)result(sched, find(tick(sched, 0), PEN_SCHED_LEASE), WRONG);
	(void)leave(sched, 1);
	add_worker(sched, 2, false);
	add_worker(sched, 3, false);
	lease = find(tick(sched, 0), PEN_SCHED_LEASE);
	lease = find(result(sched, lease, RIGHT), PEN_SCHED_LEASE);
	actions = result(sched, lease, RIGHT);
	assert_int_equal(count(actions, PEN_SCHED_COMMIT), 1);
	assert_int_equal(find(actions, PEN_SCHED_TAINTED).job, 1);
	assert_int_equal(count(actions, PEN_SCHED_CONVICTED), 0);
	pen_sched_destroy(sched);
}

/* Broken by: pixels of an earlier life that are taken for checked, or a job that has none redone.
 */
static void test_what_was_resumed_is_redone(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions = {0};
	struct pen_sched_action lease;
	struct pen_sched_job job = {.number = 7,
		.frame_first = 2,
		.frame_end = 3,
		.rounds = pen_rounds_of(PEN_ROUNDS_UNIFORM, 1, 0),
		.paused = true,
		.resumed = true};

	(void)state;
	add_frames(sched, job, 16);
	job.number = 8;
	job.resumed = false;
	add_frames(sched, job, 16);
	add_worker(sched, 1, false);
	add_worker(sched, 2, true);
	add_job(sched, 1, 16, PEN_VERIFY_FULL);
	actions = tick(sched, 0);
	while (count(actions, PEN_SCHED_CONVICTED) == 0) {
		lease = find(actions, PEN_SCHED_LEASE);
		actions = result(sched, lease, lease.worker == 1 ? WRONG : RIGHT);
	}
	assert_int_equal(count(actions, PEN_SCHED_TAINTED), 1);
	assert_int_equal(find(actions, PEN_SCHED_TAINTED).job, 7);
	pen_sched_destroy(sched);
}

enum { UNITS = 4096 };

/* Leases as they were granted; those before done have brought their result. */
struct queue {
	struct pen_sched_action leases[2 * UNITS];
	size_t granted, done;
};

static void take(struct queue *queue, struct pen_sched_actions actions)
{
	for (size_t i = 0; i < actions.count; i++)
		if (actions.items[i].type == PEN_SCHED_LEASE)
			queue->leases[queue->granted++] = actions.items[i];
}

/*
 * Two workers that are always right render a job of UNITS: how many of these did not count at once.
 * *ret_pattern: which ones, of 64 results after the first hundred.
 */
static unsigned count_audits(uint64_t secret, uint64_t *ret_pattern)
{
	struct pen_sched *sched = make_sched(secret);
	struct queue *queue = calloc(1, sizeof *queue);
	unsigned audits = 0;

	assert_non_null(queue);
	*ret_pattern = 0;
	add_worker(sched, 1, false);
	add_worker(sched, 2, false);
	add_job(sched, 1, 1024, PEN_VERIFY_SPOT);
	take(queue, tick(sched, 0));
	while (queue->done < queue->granted) {
		struct pen_sched_action lease = queue->leases[queue->done++];
		struct pen_sched_actions actions = result(sched, lease, RIGHT);
		const bool counts = count(actions, PEN_SCHED_COMMIT) == 1;

		take(queue, actions);
		audits += !counts;
		if (!counts && queue->done >= 100 && queue->done < 164)
			*ret_pattern |= 1ull << (queue->done - 100);
		if (counts)
			take(queue, pen_sched_step(sched,
					    &(struct pen_sched_event){.type = PEN_SCHED_MERGED,
						    .job = 1,
						    .u.merged = {1, lease.tile}},
					    0));
	}
	assert_int_equal(queue->done, UNITS + audits);
	free(queue);
	pen_sched_destroy(sched);
	return audits;
}

/*
 * Broken by: auditing all or none of a worker that is known to be right, letting a new one go by
 * unseen, or choosing units that anybody could guess.
 */
static void test_spot_checks(void **state)
{
	uint64_t a, b;
	unsigned audits = count_audits(1, &a);

	(void)state;
	/* Ten of each, 1/10 + 1/11 + ..., and then one in twenty: 230 or so. */
	assert_in_range(audits, 2 * PEN_AUDITS_FIRST + 100, 2 * PEN_AUDITS_FIRST + 400);
	(void)count_audits(2, &b);
	assert_int_not_equal(a, b);
}

/* Broken by: a lease for one that was convicted before, by time alone that ends it, or a reset that
 * does not. */
static void test_who_comes_back_convicted_waits_for_a_reset(void **state)
{
	struct pen_sched_worker worker = {1, 1, "a", false, true};
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;

	(void)state;
	add_job(sched, 1, 16, PEN_VERIFY_NONE);
	assert_int_equal(pen_sched_add_worker(sched, &worker, NULL), 0);
	assert_int_equal(tick(sched, 0).count, 0);
	assert_int_equal(tick(sched, 1000 * (int64_t)PEN_QUARANTINE_MS).count, 0);
	actions = pen_sched_step(
		sched, &(struct pen_sched_event){.type = PEN_SCHED_WORKER_RESET, .worker = 1}, 0);
	assert_int_equal(find(actions, PEN_SCHED_RELEASED).worker, 1);
	assert_int_equal(find(actions, PEN_SCHED_LEASE).worker, 1);
	pen_sched_destroy(sched);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_agreement),
		cmocka_unit_test(test_no_verification),
		cmocka_unit_test(test_a_third_decides),
		cmocka_unit_test(test_trust_decides),
		cmocka_unit_test(test_nobody_decides),
		cmocka_unit_test(test_a_lone_worker),
		cmocka_unit_test(test_who_fails_at_a_tile_is_not_asked_again),
		cmocka_unit_test(test_what_a_liar_did_is_redone),
		cmocka_unit_test(test_what_a_lone_liar_did_is_redone),
		cmocka_unit_test(test_nobody_confirms_itself_by_coming_again),
		cmocka_unit_test(test_who_left_is_found_out),
		cmocka_unit_test(test_what_was_resumed_is_redone),
		cmocka_unit_test(test_spot_checks),
		cmocka_unit_test(test_who_comes_back_convicted_waits_for_a_reset),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
