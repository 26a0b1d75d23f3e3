/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/coordinator.h"

#include "core/base/clock.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <poll.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

enum { PATIENCE_MS = 20000, TILE_PX = 16, SEEDS_MAX = 64 };

enum { TEXT_MAX = 192 };

/*
 * COORDINATOR_SEED_BROKEN: a scene with members that are none, in two places;
 * COORDINATOR_SEED_FRAMES: an animation.
 */
static void scene_text(uint32_t seed, char *ret_text, size_t size)
{
	const char *extra = seed == COORDINATOR_SEED_BROKEN ? ",\"x\":1" : "";
	const char *frames = seed == COORDINATOR_SEED_FRAMES
				     ? "\"frames\":{\"first\":1,\"fps\":24,\"last\":12},"
				     : "";

	(void)snprintf(ret_text, size,
		"{%s\"image\":{\"height\":16,\"width\":128%s},\"sampling\":{\"seed\":%u%s},"
		"\"version\":1}",
		frames, extra, seed, extra);
}

static struct pen_sha256 scene_name(uint32_t seed)
{
	struct pen_sha256 sha256;
	char text[TEXT_MAX];

	scene_text(seed, text, sizeof text);
	assert_int_equal(pen_sha256_of(text, strlen(text), &sha256, NULL), 0);
	return sha256;
}

static void listen_anywhere(struct coordinator *c)
{
	struct sockaddr_in address = {
		.sin_family = AF_INET,
		.sin_addr.s_addr = htonl(INADDR_LOOPBACK),
	};
	socklen_t size = sizeof address;

	c->listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	assert_true(c->listener >= 0);
	assert_int_equal(bind(c->listener, (struct sockaddr *)&address, size), 0);
	assert_int_equal(listen(c->listener, 8), 0);
	assert_int_equal(getsockname(c->listener, (struct sockaddr *)&address, &size), 0);
	c->port = ntohs(address.sin_port);
}

void coordinator_init(struct coordinator *c, const char *processes)
{
	char address[32];

	*c = (struct coordinator){.fd = -1, .frame = 1};
	pen_frame_reader_init(&c->reader);
	pen_arena_init(&c->arena, 1 << 20);
	listen_anywhere(c);
	(void)snprintf(address, sizeof address, "127.0.0.1:%u", c->port);
	c->worker = fork();
	assert_true(c->worker >= 0);
	if (c->worker == 0) {
		(void)prctl(PR_SET_PDEATHSIG, SIGKILL);
		(void)execl(PEN_WORKER_FAKE, "worker-fake", "--connect", address, "--processes",
			processes, "--sandbox", "require", "--log-level", "error", (char *)NULL);
		_exit(127);
	}
	coordinator_accept(c);
}

void coordinator_finish(struct coordinator *c)
{
	int status;

	assert_int_equal(kill(c->worker, SIGTERM), 0);
	assert_int_equal(waitpid(c->worker, &status, 0), c->worker);
	assert_int_equal(status, 0);
	coordinator_close(c);
}

void coordinator_close(struct coordinator *c)
{
	coordinator_hang_up(c);
	(void)close(c->listener);
	pen_frame_reader_finish(&c->reader);
	pen_arena_finish(&c->arena);
}

void coordinator_hang_up(struct coordinator *c)
{
	if (c->fd >= 0)
		(void)close(c->fd);
	c->fd = -1;
}

void coordinator_accept(struct coordinator *c)
{
	struct pollfd poll_fd = {.fd = c->listener, .events = POLLIN};
	const struct pen_msg welcome = {
		.type = PEN_FRAME_WELCOME,
		.u.welcome = {.worker = 1, .heartbeat_ms = 50},
	};

	assert_int_equal(poll(&poll_fd, 1, PATIENCE_MS), 1);
	c->fd = accept4(c->listener, NULL, NULL, SOCK_CLOEXEC);
	assert_true(c->fd >= 0);
	pen_frame_reader_finish(&c->reader);
	pen_frame_reader_init(&c->reader);
	c->sequence = 0;
	(void)coordinator_expect(c, PEN_FRAME_HELLO);
	assert_int_equal(c->msg.u.hello.protocol, 1);
	coordinator_send(c, &welcome);
}

void coordinator_send(struct coordinator *c, const struct pen_msg *msg)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_buf out;

	pen_buf_init(&out, 16 << 20);
	assert_int_equal(pen_msg_write(msg, &out, &c->sequence, &err), 0);
	assert_int_equal(send(c->fd, out.data, out.size, MSG_NOSIGNAL), out.size);
	pen_buf_finish(&out);
}

static void serve_scene(struct coordinator *c)
{
	struct pen_sha256 wanted = c->msg.u.scene_get.sha256;
	struct pen_msg msg = {.type = PEN_FRAME_SCENE_DATA, .u.scene_data.sha256 = wanted};
	char text[TEXT_MAX];

	for (uint32_t seed = 0; seed < SEEDS_MAX + 666100; seed++) {
		struct pen_sha256 name;

		if (seed == SEEDS_MAX)
			seed = 666000;
		name = scene_name(seed);
		if (!pen_sha256_equal(&name, &wanted))
			continue;
		scene_text(seed, text, sizeof text);
		msg.u.scene_data.missing = c->missing;
		if (!c->missing) {
			msg.u.scene_data.size = strlen(text);
			msg.payload = text;
			msg.payload_size = strlen(text);
		}
		c->scenes_served++;
		coordinator_send(c, &msg);
		return;
	}
	fail_msg("an unknown scene was asked for");
}

/* One message into c->msg; false when none comes by end_ms or the worker has hung up. */
static bool next_message(struct coordinator *c, int64_t end_ms)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_frame frame;
	int r;

	while ((r = pen_frame_reader_next(&c->reader, &frame, &err)) == 0) {
		struct pollfd poll_fd = {.fd = c->fd, .events = POLLIN};
		int64_t left_ms = end_ms - pen_clock_ms();
		size_t size;
		void *space;
		ssize_t got;

		if (poll(&poll_fd, 1, left_ms > 0 ? (int)left_ms : 0) != 1)
			return false;
		space = pen_frame_reader_space(&c->reader, &size);
		got = recv(c->fd, space, size, 0);
		if (got <= 0)
			return false;
		pen_frame_reader_fed(&c->reader, (size_t)got);
	}
	if (r < 0)
		fail_msg("frame: %s", err.text);
	pen_arena_reset(&c->arena);
	if (pen_msg_read(&frame, &c->arena, &c->msg, &err) < 0)
		fail_msg("message: %s", err.text);
	return true;
}

bool coordinator_receive(struct coordinator *c, int ms)
{
	int64_t end_ms = pen_clock_ms() + ms;

	while (next_message(c, end_ms)) {
		const struct pen_msg_heartbeat *heartbeat = &c->msg.u.heartbeat;

		if (c->msg.type == PEN_FRAME_SCENE_GET)
			serve_scene(c);
		else if (c->msg.type == PEN_FRAME_HEARTBEAT)
			c->heartbeat_lease = heartbeat->count > 0 ? heartbeat->leases[0] : 0;
		else
			return true;
	}
	return false;
}

const struct pen_msg *coordinator_expect(struct coordinator *c, enum pen_frame_type type)
{
	if (!coordinator_receive(c, PATIENCE_MS))
		fail_msg("no message of type %d", (int)type);
	if (c->msg.type == PEN_FRAME_FAILURE && type != PEN_FRAME_FAILURE)
		fail_msg("lease %llu failed: %s", (unsigned long long)c->msg.u.failure.lease,
			c->msg.u.failure.reason);
	assert_int_equal(c->msg.type, type);
	return &c->msg;
}

void coordinator_await_running(struct coordinator *c, uint64_t lease)
{
	int64_t end_ms = pen_clock_ms() + PATIENCE_MS;

	while (c->heartbeat_lease != lease) {
		if (pen_clock_ms() > end_ms)
			fail_msg("lease %llu is not being rendered", (unsigned long long)lease);
		assert_false(coordinator_receive(c, 5));
	}
}

static struct pen_rect tile_of(uint64_t lease)
{
	uint32_t x0 = TILE_PX * (uint32_t)(lease % 8);

	return (struct pen_rect){x0, 0, x0 + TILE_PX, TILE_PX};
}

void coordinator_lease(struct coordinator *c, uint64_t lease, uint32_t seed, uint32_t deadline_ms)
{
	coordinator_send(c, &(struct pen_msg){
				    .type = PEN_FRAME_LEASE,
				    .u.lease =
					    {
						    .lease = lease,
						    .job = 7,
						    .epoch = 1,
						    .tile = (uint32_t)(lease % 8),
						    .frame = c->frame,
						    .rect = tile_of(lease),
						    .sample_first = 1,
						    .sample_end = 16,
						    .scene_sha256 = scene_name(seed),
						    .deadline_ms = deadline_ms,
						    .channels = PEN_CHANNELS_MIN,
					    },
			    });
}

static void check_pattern(const struct pen_msg *msg, struct pen_rect rect, uint32_t seed)
{
	const unsigned char *pixel = msg->payload;

	assert_int_equal(msg->payload_size, pen_rect_area(rect) * PEN_CHANNELS_MIN * sizeof(float));
	for (uint32_t y = rect.y0; y < rect.y1; y++)
		for (uint32_t x = rect.x0; x < rect.x1;
			x++, pixel += PEN_CHANNELS_MIN * sizeof(float)) {
			float expected[PEN_CHANNELS_MIN] = {(float)x, (float)y, (float)seed, 15};

			assert_memory_equal(pixel, expected, sizeof expected);
		}
}

void coordinator_expect_result(struct coordinator *c, uint64_t lease, uint32_t seed)
{
	const struct pen_msg *msg = coordinator_expect(c, PEN_FRAME_RESULT);

	assert_int_equal(msg->u.result.lease, lease);
	assert_int_equal(msg->u.result.job, 7);
	assert_int_equal(msg->u.result.epoch, 1);
	assert_int_equal(msg->u.result.rays, 2);
	assert_int_equal(msg->u.result.xxh3, pen_xxh3(msg->payload, msg->payload_size));
	check_pattern(msg, tile_of(lease), seed);
}

void coordinator_expect_failure(
	struct coordinator *c, uint64_t lease, enum pen_fault fault, const char *text)
{
	const struct pen_msg *msg = coordinator_expect(c, PEN_FRAME_FAILURE);

	assert_int_equal(msg->u.failure.lease, lease);
	assert_int_equal(msg->u.failure.fault, fault);
	if (!strstr(msg->u.failure.reason, text))
		fail_msg("\"%s\" does not say \"%s\"", msg->u.failure.reason, text);
}

/* Name, state and parent of a process; false when there is none. */
static bool read_stat(pid_t pid, char *ret_name, char *ret_state, pid_t *ret_parent)
{
	char path[64], line[512];
	FILE *file;
	bool found;

	(void)snprintf(path, sizeof path, "/proc/%d/stat", (int)pid);
	file = fopen(path, "re");
	if (!file)
		return false;
	found = fgets(line, sizeof line, file) &&
		sscanf(line, "%*d (%15[^)]) %c %d", ret_name, ret_state, ret_parent) == 3;
	(void)fclose(file);
	return found;
}

bool coordinator_lives(pid_t pid)
{
	char name[16], state;
	pid_t parent;

	return read_stat(pid, name, &state, &parent) && state != 'Z';
}

pid_t coordinator_parent(pid_t pid)
{
	char name[16], state;
	pid_t parent;

	assert_true(read_stat(pid, name, &state, &parent));
	return parent;
}

static bool descends(pid_t pid, pid_t ancestor)
{
	char name[16], state;

	for (int depth = 0; depth < 5 && pid > 1; depth++) {
		if (pid == ancestor)
			return true;
		if (!read_stat(pid, name, &state, &pid))
			return false;
	}
	return false;
}

size_t coordinator_processes(
	const struct coordinator *c, const char *name, pid_t *ret_pids, size_t max)
{
	DIR *directory = opendir("/proc");
	const struct dirent *item;
	size_t count = 0;

	assert_non_null(directory);
	while ((item = readdir(directory))) {
		pid_t pid = (pid_t)strtol(item->d_name, NULL, 10), parent;
		char found[16], state;

		if (pid <= 0 || !read_stat(pid, found, &state, &parent) ||
			!descends(pid, c->worker))
			continue;
		if (name ? state == 'Z' || strcmp(found, name) != 0 : state != 'Z')
			continue;
		if (count < max)
			ret_pids[count] = pid;
		count++;
	}
	(void)closedir(directory);
	return count;
}

void coordinator_await_processes(struct coordinator *c, const char *name, size_t count)
{
	int64_t end_ms = pen_clock_ms() + PATIENCE_MS;

	while (coordinator_processes(c, name, NULL, 0) != count) {
		if (pen_clock_ms() > end_ms)
			fail_msg("not %zu processes called %s, but %zu", count, name,
				coordinator_processes(c, name, NULL, 0));
		assert_false(coordinator_receive(c, 5));
	}
}
