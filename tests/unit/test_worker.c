/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/coordinator.h"

#include "core/base/clock.h"

#include <dirent.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* Seeds of fake_render.c. */
enum {
	SEED_CRASH = 666001,
	SEED_HANG,
	SEED_CRASH_BUILD,
	SEED_SLOW,
	SEED_FAIL_BUILD,
	SEED_DAMAGE,
	SEED_SLOW_BUILD
};

enum { DEADLINE_MS = 60000 };

/* AddressSanitizer takes the signals of a crash and leaves with a status. */
#ifdef PEN_SANITIZE
#define SEGFAULT "ended with status 1"
#else
#define SEGFAULT "ended by SIGSEGV"
#endif

/* Fails when a unit is lost, rendered from the wrong scene, or a scene fetched twice. */
static void test_renders(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "1");
	for (uint64_t lease = 1; lease <= 40; lease++)
		coordinator_lease(&c, lease, lease % 2 ? 1 : 2, DEADLINE_MS);
	for (uint32_t count = 0; count < 40; count++) {
		const struct pen_msg *msg = coordinator_expect(&c, PEN_FRAME_RESULT);
		float pixel[PEN_CHANNELS_MIN];

		assert_true(msg->payload_size >= sizeof pixel);
		memcpy(pixel, msg->payload, sizeof pixel); /* it lies unaligned */
		assert_true(pixel[2] == (msg->u.result.lease % 2 ? 1.0f : 2.0f));
		assert_true(pixel[0] == (float)(msg->u.result.lease % 8 * 16));
	}
	assert_int_equal(c.scenes_served, 2);
	coordinator_finish(&c);
}

/* Fails when a scene that takes long to build holds up the units of others. */
static void test_loading_scene_blocks_nobody(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_lease(&c, 1, SEED_SLOW_BUILD, DEADLINE_MS);
	coordinator_lease(&c, 2, 1, DEADLINE_MS);
	coordinator_expect_result(&c, 2, 1);
	coordinator_expect_result(&c, 1, SEED_SLOW_BUILD);
	coordinator_finish(&c);
}

/* Fails when a crash harms another unit, is blamed on nobody, or stops the slot. */
static void test_crash(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_lease(&c, 1, 1, DEADLINE_MS);
	coordinator_expect_result(&c, 1, 1);
	coordinator_lease(&c, 2, SEED_CRASH, DEADLINE_MS);
	coordinator_expect_failure(&c, 2, PEN_FAULT_CRASH, SEGFAULT);
	coordinator_lease(&c, 3, SEED_CRASH, DEADLINE_MS);
	coordinator_expect_failure(&c, 3, PEN_FAULT_CRASH, SEGFAULT);
	coordinator_lease(&c, 4, 1, DEADLINE_MS);
	coordinator_expect_result(&c, 4, 1);
	coordinator_finish(&c);
}

/* Fails when a signal from outside is taken for the unit's fault. */
static void test_render_process_killed(void **state)
{
	static const int signals[] = {SIGKILL, SIGHUP, SIGSTOP};
	struct coordinator c;
	pid_t pid;

	(void)state;
	coordinator_init(&c, "1");
	for (uint64_t i = 0; i < 3; i++) {
		coordinator_lease(&c, 10 + i, SEED_SLOW, DEADLINE_MS);
		coordinator_await_running(&c, 10 + i);
		assert_int_equal(coordinator_processes(&c, "pen-render", &pid, 1), 1);
		assert_int_equal(kill(pid, signals[i]), 0);
		coordinator_expect_failure(&c, 10 + i, PEN_FAULT_KILLED, "render process");
	}
	coordinator_lease(&c, 20, SEED_SLOW, DEADLINE_MS);
	coordinator_expect_result(&c, 20, SEED_SLOW);
	assert_int_equal(c.scenes_served, 1);
	coordinator_finish(&c);
}

static void kill_scene_processes(struct coordinator *c)
{
	pid_t pids[4];
	size_t count = coordinator_processes(c, "pen-scene", pids, 4);

	assert_int_equal(count, 2);
	for (size_t i = 0; i < count; i++)
		assert_int_equal(kill(pids[i], SIGKILL), 0);
}

/* Fails when killing scene processes, the spare too, costs more than the running unit. */
static void test_scene_process_killed(void **state)
{
	struct coordinator c;
	pid_t render;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_lease(&c, 1, SEED_SLOW, DEADLINE_MS);
	coordinator_lease(&c, 2, SEED_SLOW, DEADLINE_MS);
	coordinator_await_running(&c, 1);
	assert_int_equal(coordinator_processes(&c, "pen-render", &render, 1), 1);
	assert_int_equal(kill(coordinator_parent(render), SIGKILL), 0);
	coordinator_expect_failure(&c, 1, PEN_FAULT_KILLED, "SIGKILL");
	coordinator_expect_result(&c, 2, SEED_SLOW);
	coordinator_await_processes(&c, "pen-scene", 2);
	kill_scene_processes(&c);
	coordinator_await_processes(&c, "pen-render", 0);
	coordinator_await_processes(&c, "pen-render", 1);
	coordinator_lease(&c, 3, SEED_SLOW, DEADLINE_MS);
	coordinator_expect_result(&c, 3, SEED_SLOW);
	assert_int_equal(c.scenes_served, 1);
	coordinator_finish(&c);
}

/* Fails when a unit may render past its deadline, or its slot is lost by that. */
static void test_deadline(void **state)
{
	struct coordinator c;
	int64_t start_ms;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_lease(&c, 1, 1, DEADLINE_MS);
	coordinator_expect_result(&c, 1, 1);
	start_ms = pen_clock_ms();
	coordinator_lease(&c, 2, SEED_HANG, 300);
	coordinator_expect_failure(&c, 2, PEN_FAULT_DEADLINE, "deadline");
	assert_in_range(pen_clock_ms() - start_ms, 300, 3000);
	coordinator_lease(&c, 3, 1, DEADLINE_MS);
	coordinator_expect_result(&c, 3, 1);
	coordinator_finish(&c);
}

static void expect_report(struct coordinator *c)
{
	const struct pen_msg_scene_report *report =
		&coordinator_expect(c, PEN_FRAME_SCENE_REPORT)->u.scene_report;

	assert_int_equal(report->job, 7);
	assert_int_equal(report->error_count, 2);
	assert_int_equal(report->warning_count, 0);
	assert_string_equal(report->pointers[0], "/image/x");
	assert_string_equal(report->pointers[1], "/sampling/x");
	assert_true(report->details[0][0] != '\0' && report->details[1][0] != '\0');
}

/* Fails when an error of a scene is lost, or not told before the failure, once a connection. */
static void test_report(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_lease(&c, 1, COORDINATOR_SEED_BROKEN, DEADLINE_MS);
	coordinator_lease(&c, 2, COORDINATOR_SEED_BROKEN, DEADLINE_MS);
	expect_report(&c);
	coordinator_expect_failure(&c, 1, PEN_FAULT_SCENE, "/image/x: ");
	coordinator_expect_failure(&c, 2, PEN_FAULT_SCENE, "/image/x: ");
	coordinator_hang_up(&c);
	coordinator_accept(&c);
	coordinator_lease(&c, 3, COORDINATOR_SEED_BROKEN, DEADLINE_MS);
	expect_report(&c);
	coordinator_expect_failure(&c, 3, PEN_FAULT_SCENE, "/image/x: ");
	assert_int_equal(c.scenes_served, 1);
	coordinator_finish(&c);
}

/* Fails when one of these scenes does anything but end its own units with the right fault. */
static void test_bad_scenes(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_lease(&c, 1, SEED_FAIL_BUILD, DEADLINE_MS);
	coordinator_lease(&c, 2, SEED_FAIL_BUILD, DEADLINE_MS);
	coordinator_expect_failure(&c, 1, PEN_FAULT_SCENE, "cannot be built");
	coordinator_expect_failure(&c, 2, PEN_FAULT_SCENE, "cannot be built");
	coordinator_lease(&c, 3, SEED_CRASH_BUILD, DEADLINE_MS);
	coordinator_lease(&c, 4, SEED_CRASH_BUILD, DEADLINE_MS);
	coordinator_expect_failure(&c, 3, PEN_FAULT_CRASH, "scene process ended by SIGABRT");
	coordinator_expect_failure(&c, 4, PEN_FAULT_CRASH, "scene process ended by SIGABRT");
	c.missing = true;
	coordinator_lease(&c, 5, 1, DEADLINE_MS);
	coordinator_expect_failure(&c, 5, PEN_FAULT_NO_SCENE, "does not have");
	c.missing = false;
	(void)usleep(200000);
	coordinator_lease(&c, 6, 1, DEADLINE_MS);
	coordinator_expect_result(&c, 6, 1);
	coordinator_finish(&c);
}

/*
 * Fails when damaged pixels are passed on, or when the unit that their process has begun since is
 * lost with it or pays for it.
 */
static void test_damage(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "1");
	for (uint64_t lease = 1; lease <= 4; lease++)
		coordinator_lease(&c, lease, SEED_DAMAGE, DEADLINE_MS);
	for (uint64_t lease = 1; lease <= 4; lease++)
		coordinator_expect_failure(&c, lease, PEN_FAULT_CRASH, "damaged");
	coordinator_finish(&c);
}

/*
 * Fails when a frame of an animation costs a process, or its scene is loaded or fetched anew:
 * fake_render.c has four frames ready at a time.
 */
static void test_animation(void **state)
{
	enum { FRAMES = 12, READY = 4 };
	struct coordinator c;
	pid_t pids[FRAMES] = {0}, scene = 0;

	(void)state;
	coordinator_init(&c, "1");
	for (uint32_t i = 0; i < FRAMES; i++) {
		c.frame = i + 1;
		coordinator_lease(&c, i + 1, COORDINATOR_SEED_FRAMES, DEADLINE_MS);
		coordinator_expect_result(&c, i + 1, COORDINATOR_SEED_FRAMES);
		coordinator_await_processes(&c, "pen-render", 1);
		assert_int_equal(coordinator_processes(&c, "pen-render", &pids[i], 1), 1);
		if (i == 0)
			scene = coordinator_parent(pids[i]);
		assert_int_equal(coordinator_parent(pids[i]), scene);
	}
	for (uint32_t i = 1; i < FRAMES; i++) {
		if (i % READY == 0)
			assert_int_not_equal(pids[i], pids[i - 1]);
		else
			assert_int_equal(pids[i], pids[i - 1]);
	}
	assert_int_equal(c.scenes_served, 1);
	coordinator_finish(&c);
}

static void send_revoke(struct coordinator *c, uint64_t lease)
{
	coordinator_send(c, &(struct pen_msg){.type = PEN_FRAME_REVOKE, .u.revoke = {lease}});
}

/* Fails when a revoked unit answers, a waiting one is rendered, or a hanging one keeps its slot. */
static void test_revoke(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_lease(&c, 1, SEED_HANG, DEADLINE_MS);
	coordinator_await_running(&c, 1);
	coordinator_lease(&c, 2, 1, DEADLINE_MS);
	coordinator_lease(&c, 3, 2, DEADLINE_MS);
	coordinator_await_processes(&c, "pen-render", 3);
	send_revoke(&c, 2);
	send_revoke(&c, 1);
	coordinator_expect_result(&c, 3, 2);
	assert_false(coordinator_receive(&c, 300));
	coordinator_finish(&c);
}

/* Fails when a worker that lost its connection stays away, or brings old work back. */
static void test_reconnect(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "1");
	for (uint64_t round = 0; round < 3; round++) {
		coordinator_lease(&c, 10 * round + 1, SEED_SLOW, DEADLINE_MS);
		coordinator_lease(&c, 10 * round + 2, SEED_SLOW, DEADLINE_MS);
		if (round == 0)
			coordinator_expect_result(&c, 1, SEED_SLOW);
		coordinator_hang_up(&c);
		coordinator_accept(&c);
	}
	coordinator_lease(&c, 50, SEED_SLOW, DEADLINE_MS);
	coordinator_expect_result(&c, 50, SEED_SLOW);
	assert_int_equal(c.scenes_served, 1);
	coordinator_finish(&c);
}

/*
 * Fails when a unit of the old connection, still ending, is taken for one of the new connection
 * that a restarted coordinator gave the same number.
 */
static void test_lease_number_again(void **state)
{
	struct coordinator c;

	(void)state;
	coordinator_init(&c, "2");
	coordinator_lease(&c, 1, SEED_HANG, DEADLINE_MS);
	coordinator_await_running(&c, 1);
	coordinator_hang_up(&c);
	coordinator_accept(&c);
	coordinator_lease(&c, 1, SEED_CRASH, DEADLINE_MS);
	coordinator_expect_failure(&c, 1, PEN_FAULT_CRASH, SEGFAULT);
	coordinator_lease(&c, 2, SEED_SLOW, DEADLINE_MS);
	coordinator_lease(&c, 3, SEED_SLOW, DEADLINE_MS);
	coordinator_expect_result(&c, 2, SEED_SLOW);
	coordinator_expect_result(&c, 3, SEED_SLOW);
	coordinator_finish(&c);
}

/* Fails when SIGTERM drops the running unit, keeps the waiting one, or leaves a process behind. */
static void test_drain(void **state)
{
	struct coordinator c;
	int status;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_lease(&c, 1, SEED_SLOW, DEADLINE_MS);
	coordinator_lease(&c, 2, SEED_SLOW, DEADLINE_MS);
	coordinator_await_running(&c, 1);
	assert_int_equal(kill(c.worker, SIGTERM), 0);
	(void)coordinator_expect(&c, PEN_FRAME_DRAIN);
	coordinator_expect_failure(&c, 2, PEN_FAULT_RETURNED, "leaving");
	coordinator_expect_result(&c, 1, SEED_SLOW);
	assert_int_equal(waitpid(c.worker, &status, 0), c.worker);
	assert_int_equal(status, 0);
	coordinator_close(&c);
}

/* Fails when a refused worker goes on, or does not say so by its exit code. */
static void test_refused(void **state)
{
	struct coordinator c;
	int status;

	(void)state;
	coordinator_init(&c, "1");
	coordinator_send(&c, &(struct pen_msg){.type = PEN_FRAME_REFUSE, .u.text = {"go away"}});
	assert_int_equal(waitpid(c.worker, &status, 0), c.worker);
	assert_true(WIFEXITED(status));
	assert_int_equal(WEXITSTATUS(status), 3);
	coordinator_close(&c);
}

/* Fails when any process outlives the pool by a second. */
static void test_dies_as_one(void **state)
{
	struct coordinator c;
	pid_t pids[8];
	size_t count = 0;
	int64_t end_ms;

	(void)state;
	coordinator_init(&c, "2");
	coordinator_lease(&c, 1, SEED_HANG, DEADLINE_MS);
	coordinator_await_processes(&c, "pen-render", 2);
	coordinator_await_processes(&c, "pen-scene", 2);
	count += coordinator_processes(&c, "pen-zygote", pids, 8);
	count += coordinator_processes(&c, "pen-scene", pids + count, 8 - count);
	count += coordinator_processes(&c, "pen-render", pids + count, 8 - count);
	assert_int_equal(count, 5);
	assert_int_equal(kill(c.worker, SIGKILL), 0);
	assert_int_equal(waitpid(c.worker, NULL, 0), c.worker);
	end_ms = pen_clock_ms() + 1000;
	for (size_t i = 0; i < count; i++)
		while (coordinator_lives(pids[i]) && pen_clock_ms() < end_ms)
			(void)usleep(1000);
	for (size_t i = 0; i < count; i++)
		assert_false(coordinator_lives(pids[i]));
	coordinator_close(&c);
}

static size_t open_files(pid_t pid)
{
	char path[64];
	DIR *directory;
	size_t count = 0;

	(void)snprintf(path, sizeof path, "/proc/%d/fd", (int)pid);
	directory = opendir(path);
	assert_non_null(directory);
	while (readdir(directory))
		count++;
	(void)closedir(directory);
	return count;
}

/* Fails when a scene leaves a descriptor or a process behind, or the cache grows past its bound. */
static void test_fifty_scenes(void **state)
{
	struct coordinator c;
	size_t files = 0;

	(void)state;
	coordinator_init(&c, "1");
	for (uint32_t seed = 1; seed <= 50; seed++) {
		coordinator_lease(&c, seed, seed, DEADLINE_MS);
		coordinator_expect_result(&c, seed, seed);
		if (seed == PEN_SCENES_CACHED_MAX) {
			coordinator_await_processes(&c, "pen-scene", PEN_SCENES_CACHED_MAX + 1);
			(void)usleep(100000);
			files = open_files(c.worker);
		}
	}
	coordinator_await_processes(&c, "pen-scene", PEN_SCENES_CACHED_MAX + 1);
	coordinator_await_processes(&c, "pen-render", PEN_SCENES_CACHED_MAX);
	(void)usleep(100000);
	assert_int_equal(open_files(c.worker), files);
	assert_int_equal(coordinator_processes(&c, NULL, NULL, 0), 0);
	assert_int_equal(c.scenes_served, 50);
	/* The oldest has gone and is fetched again, the newest is still there. */
	coordinator_lease(&c, 51, 50, DEADLINE_MS);
	coordinator_expect_result(&c, 51, 50);
	assert_int_equal(c.scenes_served, 50);
	coordinator_lease(&c, 52, 1, DEADLINE_MS);
	coordinator_expect_result(&c, 52, 1);
	assert_int_equal(c.scenes_served, 51);
	coordinator_finish(&c);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_renders),
		cmocka_unit_test(test_loading_scene_blocks_nobody),
		cmocka_unit_test(test_crash),
		cmocka_unit_test(test_render_process_killed),
		cmocka_unit_test(test_scene_process_killed),
		cmocka_unit_test(test_deadline),
		cmocka_unit_test(test_bad_scenes),
		cmocka_unit_test(test_damage),
		cmocka_unit_test(test_animation),
		cmocka_unit_test(test_report),
		cmocka_unit_test(test_revoke),
		cmocka_unit_test(test_reconnect),
		cmocka_unit_test(test_lease_number_again),
		cmocka_unit_test(test_drain),
		cmocka_unit_test(test_refused),
		cmocka_unit_test(test_dies_as_one),
		cmocka_unit_test(test_fifty_scenes),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
