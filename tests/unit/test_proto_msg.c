/* SPDX-License-Identifier: Apache-2.0 */
#include "proto/msg.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { ARENA_MAX = 64 << 10 };

static struct {
	struct pen_arena arena;
	struct pen_frame_reader reader;
	struct pen_error err;
} wire;

static int set_up(void **state)
{
	(void)state;
	pen_arena_init(&wire.arena, ARENA_MAX);
	pen_frame_reader_init(&wire.reader);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	pen_arena_finish(&wire.arena);
	pen_frame_reader_finish(&wire.reader);
	return 0;
}

/* Writes msg and reads it back; what reading returns. */
static int pass(const struct pen_msg *msg, struct pen_msg *ret_msg)
{
	struct pen_frame frame;
	struct pen_buf out;
	uint32_t sequence = 0;
	size_t size;
	void *space;

	pen_buf_init(&out, 8 << 20);
	assert_int_equal(pen_msg_write(msg, &out, &sequence, &wire.err), 0);
	(void)tear_down(NULL);
	(void)set_up(NULL);
	space = pen_frame_reader_space(&wire.reader, &size);
	assert_true(out.size <= size);
	memcpy(space, out.data, out.size);
	pen_frame_reader_fed(&wire.reader, out.size);
	pen_buf_finish(&out);
	assert_int_equal(pen_frame_reader_next(&wire.reader, &frame, &wire.err), 1);
	return pen_msg_read(&frame, &wire.arena, ret_msg, &wire.err);
}

static void expect_pass(const struct pen_msg *msg, struct pen_msg *ret_msg)
{
	if (pass(msg, ret_msg) < 0)
		fail_msg("type %d: %s", (int)msg->type, wire.err.text);
	assert_int_equal(ret_msg->type, msg->type);
}

/* Refused with a reason, and the output left alone. */
static void expect_refusal(const struct pen_msg *msg)
{
	struct pen_msg got = {.type = PEN_FRAME_TYPE_END};

	wire.err.text[0] = '\0';
	assert_int_equal(pass(msg, &got), PEN_EPROTOCOL);
	assert_true(wire.err.text[0] != '\0');
	assert_int_equal(got.type, PEN_FRAME_TYPE_END);
}

static struct pen_msg hello(void)
{
	return (struct pen_msg){
		.type = PEN_FRAME_HELLO,
		.u.hello = {1, "näme", 2, "1/x86-64-v3/embree/AMD", "0.1.0", 77},
	};
}

static struct pen_msg lease(void)
{
	return (struct pen_msg){
		.type = PEN_FRAME_LEASE,
		.u.lease =
			{
				.lease = 1ull << 60,
				.job = 2,
				.epoch = 3,
				.tile = 4,
				.round = 5,
				.frame = 6,
				.rect = {16, 32, 64, 80},
				.sample_first = 16,
				.sample_end = 32,
				.scene_sha256 = {{1, 2, 3}},
				.has_world = true,
				.world_sha256 = {{4, 5}},
				.deadline_ms = 1000,
				.channels = 4,
			},
	};
}

static struct pen_msg scene_data(void)
{
	return (struct pen_msg){
		.type = PEN_FRAME_SCENE_DATA,
		.u.scene_data = {.sha256 = {{9}}, .size = 10, .offset = 4},
		.payload = "abcdef",
		.payload_size = 6,
	};
}

/* Fails when a field of a message is dropped, swapped or cut on the way. */
static void test_hello(void **state)
{
	struct pen_msg msg = hello(), got;

	(void)state;
	expect_pass(&msg, &got);
	assert_int_equal(got.u.hello.protocol, 1);
	assert_string_equal(got.u.hello.name, "näme");
	assert_int_equal(got.u.hello.processes, 2);
	assert_string_equal(got.u.hello.equivalence_class, "1/x86-64-v3/embree/AMD");
	assert_string_equal(got.u.hello.version, "0.1.0");
	assert_int_equal(got.u.hello.pid, 77);
}

/* As test_hello, for a lease. */
static void test_lease(void **state)
{
	struct pen_msg msg = lease(), got;

	(void)state;
	expect_pass(&msg, &got);
	assert_int_equal(got.u.lease.lease, 1ull << 60);
	assert_int_equal(got.u.lease.job, 2);
	assert_int_equal(got.u.lease.epoch, 3);
	assert_int_equal(got.u.lease.tile, 4);
	assert_int_equal(got.u.lease.round, 5);
	assert_int_equal(got.u.lease.frame, 6);
	assert_memory_equal(&got.u.lease.rect, &msg.u.lease.rect, sizeof got.u.lease.rect);
	assert_int_equal(got.u.lease.sample_first, 16);
	assert_int_equal(got.u.lease.sample_end, 32);
	assert_true(pen_sha256_equal(&got.u.lease.scene_sha256, &msg.u.lease.scene_sha256));
	assert_true(got.u.lease.has_world);
	assert_true(pen_sha256_equal(&got.u.lease.world_sha256, &msg.u.lease.world_sha256));
	assert_int_equal(got.u.lease.deadline_ms, 1000);
	assert_int_equal(got.u.lease.channels, 4);
}

/* As test_hello, for a result; and when one of half pixels gets through. */
static void test_result(void **state)
{
	const float pixels[8] = {1, 2, 3, 4, 5, 6, 7, 8};
	struct pen_msg msg = {
		.type = PEN_FRAME_RESULT,
		.u.result = {1, 2, 3, 4, 5, UINT64_MAX, 7, 8, 9, 10, 11},
		.payload = pixels,
		.payload_size = sizeof pixels,
	};
	struct pen_msg got;

	(void)state;
	expect_pass(&msg, &got);
	assert_int_equal(got.u.result.lease, 1);
	assert_int_equal(got.u.result.frame, 11);
	assert_int_equal(got.u.result.job, 2);
	assert_int_equal(got.u.result.epoch, 3);
	assert_int_equal(got.u.result.tile, 4);
	assert_int_equal(got.u.result.round, 5);
	assert_true(got.u.result.xxh3 == UINT64_MAX);
	assert_int_equal(got.u.result.render_us, 7);
	assert_int_equal(got.u.result.rays, 8);
	assert_int_equal(got.u.result.rays_dropped, 9);
	assert_int_equal(got.u.result.samples_black, 10);
	assert_memory_equal(got.payload, pixels, sizeof pixels);
	msg.payload_size = 17;
	expect_refusal(&msg);
	msg.payload_size = 0;
	expect_refusal(&msg);
}

/* Fails when a piece of a scene changes on the way, or one that lies outside of it is taken. */
static void test_scene_data(void **state)
{
	struct pen_msg msg = scene_data(), got;

	(void)state;
	expect_pass(&msg, &got);
	assert_true(pen_sha256_equal(&got.u.scene_data.sha256, &msg.u.scene_data.sha256));
	assert_int_equal(got.u.scene_data.size, 10);
	assert_int_equal(got.u.scene_data.offset, 4);
	assert_int_equal(got.payload_size, 6);
	assert_memory_equal(got.payload, "abcdef", 6);
	/* A piece may not reach past the end, start there, or be empty. */
	msg.u.scene_data.offset = 5;
	expect_refusal(&msg);
	msg.u.scene_data.offset = UINT64_MAX;
	expect_refusal(&msg);
	msg = scene_data();
	msg.payload_size = 0;
	expect_refusal(&msg);
	/* The whole has its bound. */
	msg = scene_data();
	msg.u.scene_data.size = PEN_SCENE_BYTES_MAX - 1;
	expect_pass(&msg, &got);
	msg.u.scene_data.size = PEN_SCENE_BYTES_MAX;
	expect_pass(&msg, &got);
	msg.u.scene_data.size = PEN_SCENE_BYTES_MAX + 1;
	expect_refusal(&msg);
	/* What is missing has no bytes. */
	msg = (struct pen_msg){.type = PEN_FRAME_SCENE_DATA, .u.scene_data.missing = true};
	expect_pass(&msg, &got);
	assert_true(got.u.scene_data.missing);
	msg.payload = "x";
	msg.payload_size = 1;
	expect_refusal(&msg);
}

/* Fails when an asset gets the bounds of a scene, or a file without bytes cannot be sent. */
static void test_asset_data(void **state)
{
	struct pen_msg msg = scene_data(), got;

	(void)state;
	msg.type = PEN_FRAME_ASSET_DATA;
	msg.u.scene_data.size = PEN_ASSET_BYTES_MAX - 1;
	expect_pass(&msg, &got);
	msg.u.scene_data.size = PEN_ASSET_BYTES_MAX;
	expect_pass(&msg, &got);
	assert_int_equal(got.u.scene_data.offset, 4);
	assert_memory_equal(got.payload, "abcdef", 6);
	msg.u.scene_data.size = PEN_ASSET_BYTES_MAX + 1;
	expect_refusal(&msg);
	msg = (struct pen_msg){.type = PEN_FRAME_ASSET_DATA};
	expect_pass(&msg, &got);
	msg.u.scene_data.offset = 1;
	expect_refusal(&msg);
	msg = (struct pen_msg){.type = PEN_FRAME_ASSET_GET, .u.scene_get = {{{5, 6}}}};
	expect_pass(&msg, &got);
	assert_true(pen_sha256_equal(&got.u.scene_get.sha256, &msg.u.scene_get.sha256));
}

/* As test_hello, for the others; and when a number past its bound gets through. */
static void test_small_messages(void **state)
{
	struct pen_msg msg, got;

	(void)state;
	msg = (struct pen_msg){.type = PEN_FRAME_WELCOME, .u.welcome = {3, 2000}};
	expect_pass(&msg, &got);
	assert_int_equal(got.u.welcome.worker, 3);
	assert_int_equal(got.u.welcome.heartbeat_ms, 2000);
	msg.u.welcome.heartbeat_ms = 0;
	expect_refusal(&msg);
	msg.u.welcome.heartbeat_ms = PEN_DEAD_MS + 1;
	expect_refusal(&msg);
	msg = (struct pen_msg){.type = PEN_FRAME_REFUSE, .u.text = {"because"}};
	expect_pass(&msg, &got);
	assert_string_equal(got.u.text.reason, "because");
	msg = (struct pen_msg){.type = PEN_FRAME_DRAIN, .u.text = {"leaving"}};
	expect_pass(&msg, &got);
	assert_string_equal(got.u.text.reason, "leaving");
	msg = (struct pen_msg){.type = PEN_FRAME_SCENE_GET, .u.scene_get = {{{5, 6}}}};
	expect_pass(&msg, &got);
	assert_true(pen_sha256_equal(&got.u.scene_get.sha256, &msg.u.scene_get.sha256));
	msg = (struct pen_msg){.type = PEN_FRAME_REVOKE, .u.revoke = {UINT64_MAX}};
	expect_pass(&msg, &got);
	assert_true(got.u.revoke.lease == UINT64_MAX);
	msg = (struct pen_msg){.type = PEN_FRAME_FAILURE, .u.failure = {5, PEN_FAULT_KILLED, "x"}};
	expect_pass(&msg, &got);
	assert_int_equal(got.u.failure.lease, 5);
	assert_int_equal(got.u.failure.fault, PEN_FAULT_KILLED);
	assert_string_equal(got.u.failure.reason, "x");
	msg.u.failure.fault = PEN_FAULT_NONE;
	expect_refusal(&msg);
	msg.u.failure.fault = (enum pen_fault)(PEN_FAULT_NO_SCENE + 1);
	expect_refusal(&msg);
}

/* Fails when a heartbeat's arrays differ from what was sent, or their bound is off by one. */
static void test_heartbeat(void **state)
{
	static uint64_t leases[PEN_LEASES_MAX + 1], samples[PEN_LEASES_MAX + 1];
	struct pen_msg msg = {.type = PEN_FRAME_HEARTBEAT, .u.heartbeat = {0, leases, samples}};
	struct pen_msg got;

	(void)state;
	for (size_t i = 0; i <= PEN_LEASES_MAX; i++) {
		leases[i] = UINT64_MAX - i;
		samples[i] = i;
	}
	for (uint32_t count = PEN_LEASES_MAX - 1; count <= PEN_LEASES_MAX; count++) {
		msg.u.heartbeat.count = count;
		expect_pass(&msg, &got);
		assert_int_equal(got.u.heartbeat.count, count);
		assert_memory_equal(got.u.heartbeat.leases, leases, count * sizeof *leases);
		assert_memory_equal(got.u.heartbeat.samples, samples, count * sizeof *samples);
	}
	msg.u.heartbeat.count = PEN_LEASES_MAX + 1;
	expect_refusal(&msg);
	msg.u.heartbeat.count = 0;
	expect_pass(&msg, &got);
	assert_int_equal(got.u.heartbeat.count, 0);
}

static char pointers[PEN_SCENE_ERRORS_MAX + 1][PEN_SCENE_ERROR_BYTES_MAX + 2];
static char details[PEN_SCENE_ERRORS_MAX + 1][PEN_SCENE_ERROR_BYTES_MAX + 2];
static char warnings[PEN_SCENE_WARNINGS_MAX + 1][PEN_SCENE_WARNING_BYTES_MAX + 2];

struct report_texts {
	const char *pointers[PEN_SCENE_ERRORS_MAX + 1];
	const char *details[PEN_SCENE_ERRORS_MAX + 1];
	const char *warnings[PEN_SCENE_WARNINGS_MAX + 1];
};

/* Every text as long as it may be, and different from the others. */
static struct pen_msg report(struct report_texts *texts, uint32_t errors, uint32_t count)
{
	for (uint32_t i = 0; i <= PEN_SCENE_ERRORS_MAX; i++) {
		memset(pointers[i], 'p', PEN_SCENE_ERROR_BYTES_MAX);
		memset(details[i], 'd', PEN_SCENE_ERROR_BYTES_MAX);
		pointers[i][0] = details[i][1] = (char)('0' + i);
		texts->pointers[i] = pointers[i];
		texts->details[i] = details[i];
	}
	for (uint32_t i = 0; i <= PEN_SCENE_WARNINGS_MAX; i++) {
		memset(warnings[i], 'w', PEN_SCENE_WARNING_BYTES_MAX);
		warnings[i][2] = (char)('0' + i);
		texts->warnings[i] = warnings[i];
	}
	return (struct pen_msg){
		.type = PEN_FRAME_SCENE_REPORT,
		.u.scene_report = {1ull << 60, {{7, 8}}, errors, texts->pointers, texts->details,
			count, texts->warnings},
	};
}

/* Fails when errors change on the way, the fullest report does not fit, or a bound is off by one.
 */
static void test_report_errors(void **state)
{
	struct report_texts texts;
	struct pen_msg msg, got;

	(void)state;
	for (uint32_t n = PEN_SCENE_ERRORS_MAX - 1; n <= PEN_SCENE_ERRORS_MAX; n++) {
		msg = report(&texts, n, 0);
		expect_pass(&msg, &got);
		assert_true(got.u.scene_report.job == 1ull << 60);
		assert_int_equal(got.u.scene_report.scene_sha256.bytes[1], 8);
		assert_int_equal(got.u.scene_report.error_count, n);
		assert_int_equal(got.u.scene_report.warning_count, 0);
		for (uint32_t i = 0; i < n; i++) {
			assert_string_equal(got.u.scene_report.pointers[i], pointers[i]);
			assert_string_equal(got.u.scene_report.details[i], details[i]);
		}
	}
	msg.u.scene_report.error_count = PEN_SCENE_ERRORS_MAX + 1;
	expect_refusal(&msg);
	msg.u.scene_report.error_count = 1;
	pointers[0][PEN_SCENE_ERROR_BYTES_MAX] = 'x';
	expect_refusal(&msg);
	pointers[0][PEN_SCENE_ERROR_BYTES_MAX] = '\0';
	expect_pass(&msg, &got);
	details[0][PEN_SCENE_ERROR_BYTES_MAX] = 'x';
	expect_refusal(&msg);
	details[0][PEN_SCENE_ERROR_BYTES_MAX] = '\0';
	details[0][5] = '\n';
	expect_refusal(&msg);
}

/* As test_report_errors, for warnings; and when a report of nothing, or of both, gets through. */
static void test_report_warnings(void **state)
{
	struct report_texts texts;
	struct pen_msg msg, got;

	(void)state;
	for (uint32_t n = PEN_SCENE_WARNINGS_MAX - 1; n <= PEN_SCENE_WARNINGS_MAX; n++) {
		msg = report(&texts, 0, n);
		expect_pass(&msg, &got);
		assert_int_equal(got.u.scene_report.error_count, 0);
		assert_int_equal(got.u.scene_report.warning_count, n);
		for (uint32_t i = 0; i < n; i++)
			assert_string_equal(got.u.scene_report.warnings[i], warnings[i]);
	}
	msg.u.scene_report.warning_count = PEN_SCENE_WARNINGS_MAX + 1;
	expect_refusal(&msg);
	msg.u.scene_report.warning_count = 1;
	warnings[0][PEN_SCENE_WARNING_BYTES_MAX] = 'x';
	expect_refusal(&msg);
	msg = report(&texts, 1, 1);
	expect_refusal(&msg);
	msg = report(&texts, 0, 0);
	expect_refusal(&msg);
}

/* Fails when a hello without a needed part, or with one past its bound, is let in. */
static void test_hello_bounds(void **state)
{
	char name[PEN_NAME_MAX + 2];
	struct pen_msg msg, got;

	(void)state;
	memset(name, 'n', sizeof name);
	for (size_t length = PEN_NAME_MAX - 1; length <= PEN_NAME_MAX + 1; length++) {
		name[length] = '\0';
		msg = hello();
		msg.u.hello.name = name;
		if (length <= PEN_NAME_MAX)
			expect_pass(&msg, &got);
		else
			expect_refusal(&msg);
		name[length] = 'n';
	}
	msg = hello();
	msg.u.hello.name = "";
	expect_refusal(&msg);
	msg = hello();
	msg.u.hello.equivalence_class = "";
	expect_refusal(&msg);
	for (uint32_t processes = PEN_PROCESSES_MAX - 1; processes <= PEN_PROCESSES_MAX + 1;
		processes++) {
		msg = hello();
		msg.u.hello.processes = processes;
		if (processes <= PEN_PROCESSES_MAX)
			expect_pass(&msg, &got);
		else
			expect_refusal(&msg);
	}
	msg.u.hello.processes = 0;
	expect_refusal(&msg);
}

/* Fails when text that is not UTF-8, or that could forge a log line, gets through. */
static void test_text(void **state)
{
	static const char *const good[] = {"", "a b", "\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80",
		"\xed\x9f\xbf", "\xef\xbf\xbf", "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf"};
	static const char *const bad[] = {"\n", "\x1b[2J", "\x7f", "\x80", "\xc1\xbf", "\xc2",
		"\xe0\x9f\xbf", "\xe1\x80", "\xed\xa0\x80", "\xf0\x8f\xbf\xbf", "\xf4\x90\x80\x80",
		"\xf5\x80\x80\x80", "\xf1\x80\x80", "ok\xff"};
	struct pen_msg msg = {.type = PEN_FRAME_DRAIN}, got;

	(void)state;
	for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
		msg.u.text.reason = good[i];
		expect_pass(&msg, &got);
		assert_string_equal(got.u.text.reason, good[i]);
	}
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		msg.u.text.reason = bad[i];
		expect_refusal(&msg);
	}
}

/* Fails when a lease gets through with a mask that is no mask of its tile. */
static void test_lease_mask(void **state)
{
	uint8_t mask[8] = {0xff, 0, 0, 0, 0, 0, 0, 0x07};
	struct pen_msg msg = lease(), got;

	(void)state;
	msg.u.lease.rect = (struct pen_rect){16, 32, 33, 35};
	msg.u.lease.at_centre = true;
	msg.payload = mask;
	msg.payload_size = 7;
	expect_pass(&msg, &got);
	assert_true(got.u.lease.at_centre);
	assert_int_equal(got.payload_size, 7);
	assert_memory_equal(got.payload, mask, 7);
	mask[6] = 0x07;
	expect_pass(&msg, &got);
	mask[6] = 0x08;
	expect_refusal(&msg);
	mask[6] = 0;
	msg.payload_size = 6;
	expect_refusal(&msg);
	msg.payload_size = 8;
	expect_refusal(&msg);
}

struct bound {
	struct pen_rect rect;
	uint32_t sample_first, sample_end, deadline_ms;
	bool good;
};

/* Fails when a lease past a bound of limits.h, or an empty one, gets through. */
static void test_lease_bounds(void **state)
{
	const uint32_t side = PEN_TILE_SIDE_MAX, image = PEN_IMAGE_SIDE_MAX;
	const uint32_t samples = PEN_SAMPLES_MAX, round = PEN_ROUND_SAMPLES_MAX;
	const struct bound bounds[] = {
		{{0, 0, 1, 1}, 0, 1, 1, true},
		{{0, 0, side - 1, side - 1}, 0, 1, 1, true},
		{{0, 0, side, side}, 0, 1, 1, true},
		{{0, 0, side + 1, side}, 0, 1, 1, false},
		{{0, 0, side, side + 1}, 0, 1, 1, false},
		{{image - 1, image - 1, image, image}, 0, 1, 1, true},
		{{image, 0, image + 1, 1}, 0, 1, 1, false},
		{{0, image, 1, image + 1}, 0, 1, 1, false},
		{{5, 0, 5, 1}, 0, 1, 1, false},
		{{0, 5, 1, 4}, 0, 1, 1, false},
		{{0, 0, 1, 1}, 1, 1, 1, false},
		{{0, 0, 1, 1}, 2, 1, 1, false},
		{{0, 0, 1, 1}, 0, round - 1, 1, true},
		{{0, 0, 1, 1}, 0, round, 1, true},
		{{0, 0, 1, 1}, 0, round + 1, 1, false},
		{{0, 0, 1, 1}, samples - 2, samples - 1, 1, true},
		{{0, 0, 1, 1}, samples - 1, samples, 1, true},
		{{0, 0, 1, 1}, samples, samples + 1, 1, false},
		{{0, 0, 1, 1}, 0, 1, 0, false},
		{{0, 0, 1, 1}, 0, 1, PEN_LEASE_HARD_MS, true},
		{{0, 0, 1, 1}, 0, 1, PEN_LEASE_HARD_MS + 1, false},
	};

	(void)state;
	for (size_t i = 0; i < sizeof bounds / sizeof *bounds; i++) {
		struct pen_msg msg = lease(), got;

		msg.u.lease.rect = bounds[i].rect;
		msg.u.lease.sample_first = bounds[i].sample_first;
		msg.u.lease.sample_end = bounds[i].sample_end;
		msg.u.lease.deadline_ms = bounds[i].deadline_ms;
		if (bounds[i].good)
			expect_pass(&msg, &got);
		else
			expect_refusal(&msg);
	}
	for (uint32_t n = PEN_CHANNELS_MIN - 1; n <= PEN_CHANNELS_MAX + 1; n++) {
		struct pen_msg msg = lease(), got;

		msg.u.lease.channels = n;
		if (n >= PEN_CHANNELS_MIN && n <= PEN_CHANNELS_MAX)
			expect_pass(&msg, &got);
		else
			expect_refusal(&msg);
	}
}

static int read_control(enum pen_frame_type type, const void *control, size_t size)
{
	const struct pen_frame frame = {.type = type, .control = control, .control_size = size};
	struct pen_msg got;
	int r;

	pen_arena_reset(&wire.arena);
	r = pen_msg_read(&frame, &wire.arena, &got, &wire.err);
	return r;
}

/* Fails when fields of a later protocol are refused, or more than a few of them accepted. */
static void test_unknown_fields(void **state)
{
	uint8_t control[3 * (PEN_FRAME_UNKNOWN_MAX + 1)];

	(void)state;
	/* Field 100 as a varint of 1: tag 100 << 3 in two bytes, then the value. */
	for (size_t i = 0; i < sizeof control; i += 3)
		memcpy(control + i, "\xa0\x06\x01", 3);
	assert_int_equal(read_control(PEN_FRAME_REVOKE, control, 3 * PEN_FRAME_UNKNOWN_MAX), 0);
	assert_int_equal(read_control(PEN_FRAME_REVOKE, control, sizeof control), PEN_EPROTOCOL);
}

/* Fails when bytes that are no message, a short hash, or memory past the arena get through. */
static void test_broken_control(void **state)
{
	/* A SceneGet with a hash of 31 bytes. */
	uint8_t get[33] = {0x0a, 31};
	uint8_t heartbeat[8000];

	(void)state;
	assert_int_equal(read_control(PEN_FRAME_REVOKE, "\x08", 1), PEN_EPROTOCOL);
	assert_int_equal(read_control(PEN_FRAME_REVOKE, "\xff\xff\xff\xff", 4), PEN_EPROTOCOL);
	assert_int_equal(read_control(PEN_FRAME_SCENE_GET, get, sizeof get), PEN_EPROTOCOL);
	assert_int_equal(read_control(PEN_FRAME_SCENE_GET, "", 0), PEN_EPROTOCOL);
	/* One packed byte becomes eight: 7997 leases would take 64 KiB, which the arena has not. */
	memset(heartbeat, 1, sizeof heartbeat);
	memcpy(heartbeat, "\x0a\xbd\x3e", 3);
	assert_int_equal(
		read_control(PEN_FRAME_HEARTBEAT, heartbeat, sizeof heartbeat), PEN_EPROTOCOL);
}

/* Fails when a random message crashes, or one that is accepted breaks a bound. */
static void test_random_control(void **state)
{
	uint8_t control[64];

	(void)state;
	srand(1);
	for (int round = 0; round < 200000; round++) {
		size_t size = (size_t)rand() % sizeof control;
		int type = PEN_FRAME_HELLO + rand() % (PEN_FRAME_TYPE_END - PEN_FRAME_HELLO);
		struct pen_frame frame = {
			.type = (enum pen_frame_type)type,
			.control = control,
			.control_size = size,
		};
		struct pen_msg got;

		for (size_t i = 0; i < size; i++)
			control[i] = (uint8_t)(rand() % 3 ? rand() % 16 * 8 + rand() % 3 : rand());
		pen_arena_reset(&wire.arena);
		if (pen_msg_read(&frame, &wire.arena, &got, NULL) < 0)
			continue;
		if (type == PEN_FRAME_HEARTBEAT)
			assert_true(got.u.heartbeat.count <= PEN_LEASES_MAX);
		if (type == PEN_FRAME_WELCOME)
			assert_in_range(got.u.welcome.heartbeat_ms, 1, PEN_DEAD_MS);
	}
}

/* Fails when a message that no peer would take is written. */
static void test_write_bounds(void **state)
{
	char *reason = calloc(1, 8192);
	struct pen_msg msg = {.type = PEN_FRAME_DRAIN, .u.text = {reason}};
	uint32_t sequence = 0;
	struct pen_buf out;

	(void)state;
	memset(reason, 'r', 8191);
	pen_buf_init(&out, 1 << 20);
	assert_int_equal(pen_msg_write(&msg, &out, &sequence, &wire.err), PEN_ELIMIT);
	assert_int_equal(out.size, 0);
	assert_int_equal(sequence, 0);
	pen_buf_finish(&out);
	free(reason);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_hello),
		cmocka_unit_test(test_lease),
		cmocka_unit_test(test_result),
		cmocka_unit_test(test_scene_data),
		cmocka_unit_test(test_asset_data),
		cmocka_unit_test(test_small_messages),
		cmocka_unit_test(test_heartbeat),
		cmocka_unit_test(test_report_errors),
		cmocka_unit_test(test_report_warnings),
		cmocka_unit_test(test_hello_bounds),
		cmocka_unit_test(test_text),
		cmocka_unit_test(test_lease_bounds),
		cmocka_unit_test(test_lease_mask),
		cmocka_unit_test(test_unknown_fields),
		cmocka_unit_test(test_broken_control),
		cmocka_unit_test(test_random_control),
		cmocka_unit_test(test_write_bounds),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
