/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/unit/sched_steps.h"

#include "core/base/limits.h"

#include <stdbool.h>
#include <string.h>

static void add_worker(struct pen_sched *sched, uint64_t id, uint32_t processes, const char *name)
{
	struct pen_sched_worker worker = {id, processes, name, false, false};

	assert_int_equal(pen_sched_add_worker(sched, &worker, NULL), 0);
}

static void add_job(struct pen_sched *sched, uint64_t number, uint32_t side, uint32_t samples)
{
	add_frames(sched,
		(struct pen_sched_job){
			.number = number, .rounds = pen_rounds_of(PEN_ROUNDS_UNIFORM, samples, 0)},
		side);
}

static struct pen_sched_actions fail_unit(struct pen_sched *sched, uint64_t worker, uint64_t lease,
	enum pen_sched_fault fault, int64_t now_ms)
{
	return step(sched,
		(struct pen_sched_event){.type = PEN_SCHED_FAILURE,
			.worker = worker,
			.lease = lease,
			.u.failure = {fault, "render process ended by SIGSEGV"}},
		now_ms);
}

static struct pen_sched_actions report(
	struct pen_sched *sched, uint64_t worker, uint64_t lease, uint64_t samples, int64_t now_ms)
{
	return step(sched,
		(struct pen_sched_event){.type = PEN_SCHED_PROGRESS,
			.worker = worker,
			.lease = lease,
			.u.samples = samples},
		now_ms);
}

static struct pen_sched_actions leave(struct pen_sched *sched, uint64_t worker, int64_t now_ms)
{
	return step(sched,
		(struct pen_sched_event){.type = PEN_SCHED_WORKER_LEAVE, .worker = worker}, now_ms);
}

/* Broken by: leasing more than two units a process, or from the corner instead of the centre. */
static void test_first_leases(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;

	(void)state;
	add_job(sched, 1, 80, 4);
	add_worker(sched, 7, 3, "a");
	actions = tick(sched, 0);
	assert_int_equal(count(actions, PEN_SCHED_LEASE), 6);
	assert_string_equal(find(actions, PEN_SCHED_STARTED).text, "a");
	assert_int_equal(find(actions, PEN_SCHED_LEASE).tile, 12); /* the middle of 5 x 5 */
	assert_int_equal(find(actions, PEN_SCHED_LEASE).round, 0);
	assert_int_equal(count(tick(sched, 1), PEN_SCHED_LEASE), 0);
	pen_sched_destroy(sched);
}

/* Broken by: counting faults wrongly, retrying where it failed, or a reason without the tile. */
static void test_three_faults(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action lease;
	uint64_t first;

	(void)state;
	add_job(sched, 1, 16, 1);
	add_worker(sched, 1, 1, "a");
	add_worker(sched, 2, 1, "a");
	actions = tick(sched, 0);
	lease = find(actions, PEN_SCHED_LEASE);
	first = lease.worker;
	actions = fail_unit(sched, lease.worker, lease.lease, PEN_SCHED_FAULT_OWN, 1);
	lease = find(actions, PEN_SCHED_LEASE);
	assert_int_not_equal(lease.worker, first);
	assert_int_equal(lease.epoch, 1);
	/* Both have failed it: now either may try. */
	actions = fail_unit(sched, lease.worker, lease.lease, PEN_SCHED_FAULT_OWN, 2);
	lease = find(actions, PEN_SCHED_LEASE);
	actions = fail_unit(sched, lease.worker, lease.lease, PEN_SCHED_FAULT_OWN, 3);
	assert_int_equal(count(actions, PEN_SCHED_FAILED), 1);
	assert_non_null(strstr(find(actions, PEN_SCHED_FAILED).text, "tile 0"));
	assert_non_null(strstr(find(actions, PEN_SCHED_FAILED).text, "SIGSEGV"));
	assert_int_equal(pen_sched_waiting(sched), 0);
	pen_sched_destroy(sched);
}

/* Broken by: blaming a unit for being killed, or never blaming it. */
static void test_kills(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;

	(void)state;
	add_job(sched, 1, 16, 1);
	add_worker(sched, 1, 1, "a");
	actions = tick(sched, 0);
	for (unsigned i = 0; i < PEN_KILLS_MAX + PEN_BLAME_MAX; i++) {
		uint64_t lease = find(actions, PEN_SCHED_LEASE).lease;

		actions = fail_unit(sched, 1, lease, PEN_SCHED_FAULT_KILLED, 1);
	}
	assert_int_equal(count(actions, PEN_SCHED_FAILED), 1);
	pen_sched_destroy(sched);
}

/* Broken by: going on with a scene that cannot be made ready, or leaving its leases out. */
static void test_scene_fault(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	uint64_t lease;

	(void)state;
	add_job(sched, 1, 64, 1);
	add_worker(sched, 1, 2, "a");
	actions = tick(sched, 0);
	lease = find(actions, PEN_SCHED_LEASE).lease;
	actions = fail_unit(sched, 1, lease, PEN_SCHED_FAULT_SCENE, 1);
	assert_int_equal(count(actions, PEN_SCHED_FAILED), 1);
	assert_int_equal(count(actions, PEN_SCHED_REVOKE), 3);
	assert_int_equal(count(tick(sched, 2), PEN_SCHED_LEASE), 0);
	pen_sched_destroy(sched);
}

/*
 * Broken by: letting a hung unit live, blaming one that waits in its worker, or taking silence for
 * lack of progress.
 */
static void test_no_progress(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	uint64_t lease;

	(void)state;
	add_job(sched, 1, 16, 1);
	add_worker(sched, 1, 1, "a");
	lease = find(tick(sched, 0), PEN_SCHED_LEASE).lease;
	assert_int_equal(count(tick(sched, PEN_LEASE_HARD_MS / 2), PEN_SCHED_REVOKE), 0);
	(void)report(sched, 1, lease, 10, 400000);
	assert_int_equal(count(tick(sched, 400000 + 2 * PEN_LEASE_MS), PEN_SCHED_REVOKE), 0);
	assert_int_equal(count(report(sched, 1, lease, 20, 430000), PEN_SCHED_REVOKE), 0);
	assert_int_equal(
		count(report(sched, 1, lease, 20, 430000 + PEN_LEASE_MS), PEN_SCHED_REVOKE), 0);
	actions = report(sched, 1, lease, 20, 430001 + PEN_LEASE_MS);
	assert_int_equal(find(actions, PEN_SCHED_REVOKE).lease, lease);
	assert_int_equal(find(actions, PEN_SCHED_LEASE).epoch, 1);
	assert_null(pen_sched_find_lease(sched, 1, lease));
	pen_sched_destroy(sched);
}

/* Broken by: accepting a result whose lease was revoked (the epoch fences it). */
static void test_stale_result(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_action old, lease;

	(void)state;
	add_job(sched, 1, 16, 1);
	add_worker(sched, 1, 1, "a");
	old = find(tick(sched, 0), PEN_SCHED_LEASE);
	lease = find(fail_unit(sched, 1, old.lease, PEN_SCHED_FAULT_RETURNED, 1), PEN_SCHED_LEASE);
	assert_null(pen_sched_find_lease(sched, 1, old.lease));
	assert_null(pen_sched_find_lease(sched, 2, lease.lease));
	assert_int_equal(pen_sched_find_lease(sched, 1, lease.lease)->epoch, 1);
	assert_int_equal(count(finish_unit(sched, lease, 2), PEN_SCHED_RENDERED), 1);
	pen_sched_destroy(sched);
}

/* Broken by: giving a job's units to another class, or waiting for a lost class for ever. */
static void test_class(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;

	(void)state;
	add_job(sched, 1, 16, 1);
	add_worker(sched, 1, 1, "a");
	(void)tick(sched, 0);
	add_worker(sched, 2, 1, "b");
	actions = leave(sched, 1, 1);
	assert_int_equal(count(actions, PEN_SCHED_LEASE), 0);
	(void)tick(sched, 1000);
	assert_int_equal(tick(sched, 999 + PEN_CLASS_ABSENT_MS).count, 0);
	actions = tick(sched, 1000 + PEN_CLASS_ABSENT_MS);
	assert_int_equal(find(actions, PEN_SCHED_ABANDONED).job, 1);
	pen_sched_destroy(sched);
}

/* Broken by: a job that has lost its class and takes the first worker that is free. */
static void test_restart_in_the_best_class(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;

	(void)state;
	add_worker(sched, 1, 2, "a");
	add_worker(sched, 2, 3, "b");
	add_worker(sched, 3, 2, "a");
	add_frames(sched,
		(struct pen_sched_job){.number = 1,
			.rounds = pen_rounds_of(PEN_ROUNDS_UNIFORM, 1, 0),
			.restarted = true},
		64);
	actions = tick(sched, 0);
	assert_string_equal(find(actions, PEN_SCHED_STARTED).text, "a");
	assert_int_equal(count(actions, PEN_SCHED_LEASE), 8);
	pen_sched_destroy(sched);
}

/* Broken by: leasing to a paused job or a draining worker, or forgetting them when they are back.
 */
static void test_pause_and_drain(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;

	(void)state;
	add_job(sched, 1, 16, 1);
	add_worker(sched, 1, 1, "a");
	(void)tick(sched, 0);
	actions = step(sched, (struct pen_sched_event){.type = PEN_SCHED_JOB_PAUSE, .job = 1}, 1);
	assert_int_equal(actions.count, 1);
	assert_int_equal(actions.items[0].type, PEN_SCHED_REVOKE);
	actions = step(sched, (struct pen_sched_event){.type = PEN_SCHED_JOB_RESUME, .job = 1}, 2);
	assert_int_equal(count(actions, PEN_SCHED_LEASE), 1);
	(void)step(sched, (struct pen_sched_event){.type = PEN_SCHED_WORKER_DRAIN, .worker = 1}, 3);
	actions = fail_unit(
		sched, 1, find(actions, PEN_SCHED_LEASE).lease, PEN_SCHED_FAULT_RETURNED, 4);
	assert_int_equal(actions.count, 0);
	pen_sched_destroy(sched);
}

/* A worker of two processes renders all of a job of 16 tiles but the first unit: that one's lease.
 */
static struct pen_sched_action straggle(struct pen_sched *sched, int64_t *ret_ms)
{
	struct pen_sched_action queue[64], late = {.lease = 0};
	struct pen_sched_actions actions;
	size_t granted = 0, done = 0;

	add_job(sched, 1, 64, 1);
	add_worker(sched, 1, 2, "a");
	actions = tick(sched, 0);
	for (;;) {
		for (size_t i = 0; i < actions.count; i++)
			if (actions.items[i].type == PEN_SCHED_LEASE)
				queue[granted++] = actions.items[i];
		if (late.lease == 0)
			late = queue[done++];
		if (done == granted)
			break;
		*ret_ms += 10;
		actions = step(sched,
			(struct pen_sched_event){.type = PEN_SCHED_RESULT,
				.worker = 1,
				.lease = queue[done].lease,
				.u.seconds = 0.01},
			*ret_ms);
		for (size_t i = 0; i < actions.count; i++)
			if (actions.items[i].type == PEN_SCHED_LEASE)
				queue[granted++] = actions.items[i];
		actions = step(sched,
			(struct pen_sched_event){.type = PEN_SCHED_MERGED,
				.job = 1,
				.u.merged = {1, queue[done++].tile}},
			*ret_ms);
	}
	return late;
}

/*
 * Broken by: waiting for a unit that one worker alone is late with while another idles, helping too
 * early, or giving it to the one that is late; by an end that is told twice, or a lease that stays.
 */
static void test_straggler(void **state)
{
	(void)state;
	for (unsigned winner = 0; winner < 2; winner++) {
		struct pen_sched *sched = make_sched(1);
		struct pen_sched_actions actions;
		struct pen_sched_action late, twin, first, last;
		int64_t now_ms = 0;

		late = straggle(sched, &now_ms);
		add_worker(sched, 2, 1, "a");
		add_worker(sched, 3, 1, "b");
		assert_int_equal(tick(sched, PEN_STRAGGLER_MS).count, 0);
		now_ms = 3 * PEN_STRAGGLER_MS / 2 + 1;
		actions = tick(sched, now_ms);
		assert_int_equal(actions.count, 1);
		twin = find(actions, PEN_SCHED_LEASE);
		assert_int_equal(twin.worker, 2);
		assert_int_equal(twin.tile, late.tile);
		assert_int_equal(twin.epoch, late.epoch);
		assert_int_equal(tick(sched, 10 * now_ms).count, 0);

		first = winner == 0 ? late : twin;
		last = winner == 0 ? twin : late;
		actions = step(sched,
			(struct pen_sched_event){.type = PEN_SCHED_RESULT,
				.worker = first.worker,
				.lease = first.lease,
				.u.seconds = 0.01},
			now_ms);
		assert_int_equal(actions.count, 2);
		assert_int_equal(find(actions, PEN_SCHED_COMMIT).tile, late.tile);
		assert_int_equal(find(actions, PEN_SCHED_REVOKE).lease, last.lease);
		assert_null(pen_sched_find_lease(sched, last.worker, last.lease));
		actions = step(sched,
			(struct pen_sched_event){
				.type = PEN_SCHED_MERGED, .job = 1, .u.merged = {1, late.tile}},
			now_ms);
		assert_int_equal(count(actions, PEN_SCHED_RENDERED), 1);
		pen_sched_destroy(sched);
	}
}

/* Broken by: a unit that waits again although its twin is at work, or waits for a twin that is
 * lost. */
static void test_straggler_is_lost(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	struct pen_sched_action late, twin;
	int64_t now_ms = 0;

	(void)state;
	late = straggle(sched, &now_ms);
	add_worker(sched, 2, 1, "a");
	now_ms = 2 * PEN_STRAGGLER_MS;
	twin = find(tick(sched, now_ms), PEN_SCHED_LEASE);
	assert_int_equal(leave(sched, late.worker, now_ms).count, 0);
	assert_int_equal(pen_sched_waiting(sched), 0);
	add_worker(sched, 4, 1, "a");
	actions = leave(sched, twin.worker, now_ms);
	assert_int_equal(find(actions, PEN_SCHED_LEASE).worker, 4);
	assert_int_equal(find(actions, PEN_SCHED_LEASE).epoch, late.epoch + 1);
	pen_sched_destroy(sched);
}

/* Worker 1 fails at a unit of a job of one tile that worker 2 then renders. */
static struct pen_sched_actions fail_and_succeed(struct pen_sched *sched, uint64_t job, int64_t ms)
{
	struct pen_sched_actions actions;
	struct pen_sched_action lease;

	add_job(sched, job, 16, 1);
	lease = find(tick(sched, ms), PEN_SCHED_LEASE);
	while (lease.worker != 1)
		lease = find(
			fail_unit(sched, lease.worker, lease.lease, PEN_SCHED_FAULT_RETURNED, ms),
			PEN_SCHED_LEASE);
	actions = fail_unit(sched, 1, lease.lease, PEN_SCHED_FAULT_OWN, ms);
	lease = find(actions, PEN_SCHED_LEASE);
	assert_int_equal(lease.worker, 2);
	actions = step(sched,
		(struct pen_sched_event){.type = PEN_SCHED_RESULT,
			.worker = 2,
			.lease = lease.lease,
			.u.seconds = 0.01},
		ms);
	return actions;
}

static void merge_only_tile(struct pen_sched *sched, uint64_t job, int64_t ms)
{
	(void)step(sched,
		(struct pen_sched_event){.type = PEN_SCHED_MERGED, .job = job, .u.merged = {1, 0}},
		ms);
}

/*
 * Broken by: leasing on to a worker that fails at what others can render, blaming one for a unit
 * that nobody can render, or locking it out for ever.
 */
static void test_quarantine(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;

	(void)state;
	add_worker(sched, 1, 1, "a");
	add_worker(sched, 2, 1, "a");
	for (uint64_t job = 1; job <= PEN_STRIKES_MAX; job++) {
		actions = fail_and_succeed(sched, job, 1);
		assert_int_equal(count(actions, PEN_SCHED_QUARANTINED), job == PEN_STRIKES_MAX);
		merge_only_tile(sched, job, 1);
	}
	assert_int_equal(pen_sched_processes(sched), 1);
	add_job(sched, 7, 128, 1);
	actions = tick(sched, 2);
	assert_int_equal(count(actions, PEN_SCHED_LEASE), 2);
	assert_int_equal(find(actions, PEN_SCHED_LEASE).worker, 2);
	actions = step(
		sched, (struct pen_sched_event){.type = PEN_SCHED_WORKER_RESET, .worker = 1}, 3);
	assert_int_equal(find(actions, PEN_SCHED_RELEASED).worker, 1);
	assert_int_equal(count(actions, PEN_SCHED_LEASE), 2);
	pen_sched_destroy(sched);
}

/* Broken by: a quarantine that does not end, or one that is forgotten when it has ended. */
static void test_probation(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;

	(void)state;
	add_worker(sched, 1, 1, "a");
	add_worker(sched, 2, 1, "a");
	for (uint64_t job = 1; job <= PEN_STRIKES_MAX; job++) {
		(void)fail_and_succeed(sched, job, 1);
		merge_only_tile(sched, job, 1);
	}
	assert_int_equal(count(tick(sched, PEN_QUARANTINE_MS), PEN_SCHED_RELEASED), 0);
	assert_int_equal(count(tick(sched, PEN_QUARANTINE_MS + 1), PEN_SCHED_RELEASED), 1);
	actions = fail_and_succeed(sched, 8, PEN_QUARANTINE_MS + 2);
	assert_int_equal(find(actions, PEN_SCHED_QUARANTINED).worker, 1);
	pen_sched_destroy(sched);
}

/* The leases a worker of one process holds. */
struct hand {
	struct pen_sched_action leases[2];
	size_t count;
};

static void take(struct hand *hand, struct pen_sched_actions actions)
{
	for (size_t i = 0; i < actions.count; i++)
		if (actions.items[i].type == PEN_SCHED_LEASE)
			hand->leases[hand->count++] = actions.items[i];
}

static void set_priority(struct pen_sched *sched, uint64_t job, uint32_t priority)
{
	(void)step(sched,
		(struct pen_sched_event){
			.type = PEN_SCHED_JOB_PRIORITY, .job = job, .u.priority = priority},
		0);
}

/* A process renders so many units of 10 ms, the oldest lease first; how many were job 1's. */
static unsigned share(uint32_t priority_1, uint32_t priority_2, unsigned units)
{
	struct pen_sched *sched = make_sched(1);
	struct hand hand = {.count = 0};
	unsigned of_first = 0;

	add_job(sched, 1, 1024, 1);
	add_job(sched, 2, 1024, 1);
	set_priority(sched, 1, priority_1);
	set_priority(sched, 2, priority_2);
	add_worker(sched, 1, 1, "a");
	take(&hand, tick(sched, 0));
	for (unsigned i = 0; i < units; i++) {
		struct pen_sched_action lease = hand.leases[0];

		hand.leases[0] = hand.leases[--hand.count];
		of_first += lease.job == 1;
		take(&hand, step(sched,
				    (struct pen_sched_event){.type = PEN_SCHED_RESULT,
					    .worker = 1,
					    .lease = lease.lease,
					    .u.seconds = 0.01},
				    10 * i));
		take(&hand, step(sched,
				    (struct pen_sched_event){.type = PEN_SCHED_MERGED,
					    .job = lease.job,
					    .u.merged = {lease.frame, lease.tile}},
				    10 * i));
	}
	pen_sched_destroy(sched);
	return of_first;
}

/* Broken by: sharing by anything else than render seconds over 1 + priority. */
static void test_shares(void **state)
{
	(void)state;
	assert_in_range(share(50, 50, 400), 195, 205);
	assert_in_range(share(99, 24, 500), 390, 410); /* 4 : 1 */
}

/* Broken by: leasing from every waiting job at once, so that each worker holds all their scenes. */
static void test_active_jobs(void **state)
{
	struct pen_sched *sched = make_sched(1);
	struct pen_sched_actions actions;
	bool seen[21] = {false};
	unsigned jobs = 0;

	(void)state;
	for (uint64_t number = 1; number <= 20; number++)
		add_job(sched, number, 256, 1);
	add_worker(sched, 1, 16, "a");
	actions = tick(sched, 0);
	assert_int_equal(count(actions, PEN_SCHED_LEASE), 32);
	for (size_t i = 0; i < actions.count; i++)
		seen[actions.items[i].job] = true;
	for (size_t i = 1; i <= 20; i++)
		jobs += seen[i];
	assert_in_range(jobs, 1, PEN_SCHED_JOBS_ACTIVE);
	pen_sched_destroy(sched);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_first_leases),
		cmocka_unit_test(test_three_faults),
		cmocka_unit_test(test_kills),
		cmocka_unit_test(test_scene_fault),
		cmocka_unit_test(test_no_progress),
		cmocka_unit_test(test_stale_result),
		cmocka_unit_test(test_class),
		cmocka_unit_test(test_restart_in_the_best_class),
		cmocka_unit_test(test_pause_and_drain),
		cmocka_unit_test(test_straggler),
		cmocka_unit_test(test_straggler_is_lost),
		cmocka_unit_test(test_quarantine),
		cmocka_unit_test(test_probation),
		cmocka_unit_test(test_shares),
		cmocka_unit_test(test_active_jobs),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
