/* SPDX-License-Identifier: Apache-2.0 */
#include "proto/msg.h"

#include "core/base/mask.h"
#include "core/base/text.h"
#include "proto/penumbra.pb-c.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

static_assert((int)PEN_FAULT_CRASH == PEN__WIRE__FAULT__FAULT_CRASH &&
		      (int)PEN_FAULT_KILLED == PEN__WIRE__FAULT__FAULT_KILLED &&
		      (int)PEN_FAULT_DEADLINE == PEN__WIRE__FAULT__FAULT_DEADLINE &&
		      (int)PEN_FAULT_SCENE == PEN__WIRE__FAULT__FAULT_SCENE &&
		      (int)PEN_FAULT_RETURNED == PEN__WIRE__FAULT__FAULT_RETURNED &&
		      (int)PEN_FAULT_NO_SCENE == PEN__WIRE__FAULT__FAULT_NO_SCENE,
	"faults have the same numbers on the wire");

enum { CONTROL_MAX = 36 << 10, HEARTBEAT_MS_MIN = 10 };

union wire {
	ProtobufCMessage base;
	Pen__Wire__Hello hello;
	Pen__Wire__Welcome welcome;
	Pen__Wire__Refuse refuse;
	Pen__Wire__SceneGet scene_get;
	Pen__Wire__SceneData scene_data;
	Pen__Wire__Lease lease;
	Pen__Wire__Revoke revoke;
	Pen__Wire__Result result;
	Pen__Wire__Failure failure;
	Pen__Wire__Heartbeat heartbeat;
	Pen__Wire__Drain drain;
	Pen__Wire__SceneReport scene_report;
};

static int check_text(const char *text, size_t max, const char *name, struct pen_error *err)
{
	const size_t length = strlen(text);

	if (length > max)
		return pen_error_set(err, PEN_EPROTOCOL, "%s is longer than %zu bytes", name, max);
	if (pen_text_plain(text) < length)
		return pen_error_set(err, PEN_EPROTOCOL, "%s is not plain UTF-8 text", name);
	return 0;
}

static int check_range(
	uint64_t value, uint64_t min, uint64_t max, const char *name, struct pen_error *err)
{
	if (value < min || value > max)
		return pen_error_set(err, PEN_EPROTOCOL, "%s is %llu, not within %llu and %llu",
			name, (unsigned long long)value, (unsigned long long)min,
			(unsigned long long)max);
	return 0;
}

static int read_sha256(
	const ProtobufCBinaryData *bytes, struct pen_sha256 *ret_sha256, struct pen_error *err)
{
	if (bytes->len != sizeof ret_sha256->bytes)
		return pen_error_set(err, PEN_EPROTOCOL, "a hash of %zu bytes", bytes->len);
	memcpy(ret_sha256->bytes, bytes->data, bytes->len);
	return 0;
}

/* One reader a message: checks it and fills in the struct of its type. */

static int read_hello(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Hello *hello = &wire->hello;
	int r;

	r = check_text(hello->name, PEN_NAME_MAX, "the worker's name", err);
	if (r == 0)
		r = check_text(hello->equivalence_class, PEN_NAME_MAX, "the class", err);
	if (r == 0)
		r = check_text(hello->version, PEN_NAME_MAX, "the version", err);
	if (r == 0)
		r = check_range(hello->processes, 1, PEN_PROCESSES_MAX, "processes", err);
	if (r < 0)
		return r;
	if (hello->name[0] == '\0' || hello->equivalence_class[0] == '\0')
		return pen_error_set(err, PEN_EPROTOCOL, "a worker without name or class");
	msg->u.hello = (struct pen_msg_hello){
		.protocol = hello->protocol,
		.name = hello->name,
		.processes = hello->processes,
		.equivalence_class = hello->equivalence_class,
		.version = hello->version,
		.pid = hello->pid,
	};
	return 0;
}

static int read_welcome(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Welcome *welcome = &wire->welcome;

	msg->u.welcome = (struct pen_msg_welcome){welcome->worker, welcome->heartbeat_ms};
	return check_range(
		welcome->heartbeat_ms, HEARTBEAT_MS_MIN, PEN_DEAD_MS, "heartbeat_ms", err);
}

static int read_refuse(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Refuse *refuse = &wire->refuse;

	msg->u.text.reason = refuse->reason;
	return check_text(refuse->reason, PEN_REASON_MAX, "the reason", err);
}

static int read_drain(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Drain *drain = &wire->drain;

	msg->u.text.reason = drain->reason;
	return check_text(drain->reason, PEN_REASON_MAX, "the reason", err);
}

static int read_scene_get(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__SceneGet *get = &wire->scene_get;

	return read_sha256(&get->sha256, &msg->u.scene_get.sha256, err);
}

static int read_scene_data(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__SceneData *data = &wire->scene_data;
	struct pen_msg_scene_data *scene_data = &msg->u.scene_data;
	int r;

	*scene_data = (struct pen_msg_scene_data){
		.size = data->size,
		.offset = data->offset,
		.missing = data->missing,
	};
	r = read_sha256(&data->sha256, &scene_data->sha256, err);
	if (r < 0)
		return r;
	if (data->missing)
		return msg->payload_size == 0
			       ? 0
			       : pen_error_set(err, PEN_EPROTOCOL, "what is missing has bytes");
	if (msg->type == PEN_FRAME_ASSET_DATA && data->size == 0 && data->offset == 0 &&
		msg->payload_size == 0)
		return 0; /* an empty file */
	r = msg->type == PEN_FRAME_ASSET_DATA
		    ? check_range(data->size, 1, PEN_ASSET_BYTES_MAX, "the asset's size", err)
		    : check_range(data->size, 1, PEN_SCENE_BYTES_MAX, "the scene's size", err);
	if (r == 0)
		r = check_range(data->offset, 0, data->size - 1, "the offset", err);
	if (r == 0)
		r = check_range(msg->payload_size, 1, data->size - data->offset,
			"the size of a piece", err);
	return r;
}

static int check_lease(const struct pen_msg_lease *lease, struct pen_error *err)
{
	int r;

	if (!pen_rect_valid(lease->rect))
		return pen_error_set(err, PEN_EPROTOCOL, "the tile is empty");
	if (lease->sample_first >= lease->sample_end)
		return pen_error_set(err, PEN_EPROTOCOL, "the sample range is empty");
	r = check_range(lease->rect.x1, 1, PEN_IMAGE_SIDE_MAX, "x1", err);
	if (r == 0)
		r = check_range(lease->rect.y1, 1, PEN_IMAGE_SIDE_MAX, "y1", err);
	if (r == 0)
		r = check_range(
			pen_rect_width(lease->rect), 1, PEN_TILE_SIDE_MAX, "the tile's width", err);
	if (r == 0)
		r = check_range(pen_rect_height(lease->rect), 1, PEN_TILE_SIDE_MAX,
			"the tile's height", err);
	if (r == 0)
		r = check_range(lease->sample_end, 1, PEN_SAMPLES_MAX, "sample_end", err);
	if (r == 0)
		r = check_range(lease->sample_end - lease->sample_first, 1, PEN_ROUND_SAMPLES_MAX,
			"the number of samples", err);
	if (r == 0)
		r = check_range(lease->deadline_ms, 1, PEN_LEASE_HARD_MS, "deadline_ms", err);
	if (r == 0)
		r = check_range(
			lease->channels, PEN_CHANNELS_MIN, PEN_CHANNELS_MAX, "channels", err);
	return r;
}

/* The payload of a lease: nothing, or a bit for each pixel of the tile and none besides. */
static int check_mask(const struct pen_msg *msg, struct pen_error *err)
{
	const struct pen_rect rect = msg->u.lease.rect;
	const uint8_t *mask = msg->payload;
	const unsigned used = pen_rect_area(rect) % 8;

	if (msg->payload_size == 0)
		return 0;
	if (msg->payload_size != pen_mask_bytes(rect))
		return pen_error_set(err, PEN_EPROTOCOL, "a mask of %zu bytes", msg->payload_size);
	if (used != 0 && mask[msg->payload_size - 1] >> used != 0)
		return pen_error_set(err, PEN_EPROTOCOL, "a mask of more pixels than the tile has");
	return 0;
}

/* For logs: kept as they are, so they must be plain and short. */
static int read_ids(const Pen__Wire__Lease *lease, struct pen_msg_lease *msg, struct pen_error *err)
{
	int r = check_text(lease->render, sizeof msg->render - 1, "render", err);

	if (r == 0)
		r = check_text(lease->traceparent, sizeof msg->trace - 1, "traceparent", err);
	if (r == 0) {
		(void)snprintf(msg->render, sizeof msg->render, "%s", lease->render);
		(void)snprintf(msg->trace, sizeof msg->trace, "%s", lease->traceparent);
	}
	return r;
}

static int read_lease(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Lease *lease = &wire->lease;
	int r;

	msg->u.lease = (struct pen_msg_lease){
		.lease = lease->lease,
		.job = lease->job,
		.epoch = lease->epoch,
		.tile = lease->tile,
		.round = lease->round,
		.frame = lease->frame,
		.rect = {lease->x0, lease->y0, lease->x1, lease->y1},
		.sample_first = lease->sample_first,
		.sample_end = lease->sample_end,
		.deadline_ms = lease->deadline_ms,
		.channels = lease->channels,
		.at_centre = lease->at_centre,
	};
	r = read_sha256(&lease->scene_sha256, &msg->u.lease.scene_sha256, err);
	msg->u.lease.has_world = lease->world_sha256.len > 0;
	if (r == 0 && msg->u.lease.has_world)
		r = read_sha256(&lease->world_sha256, &msg->u.lease.world_sha256, err);
	if (r == 0)
		r = read_ids(lease, &msg->u.lease, err);
	if (r == 0)
		r = check_lease(&msg->u.lease, err);
	return r < 0 ? r : check_mask(msg, err);
}

static int read_revoke(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Revoke *revoke = &wire->revoke;

	(void)err;
	msg->u.revoke.lease = revoke->lease;
	return 0;
}

static int read_result(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Result *result = &wire->result;
	msg->u.result = (struct pen_msg_result){
		.lease = result->lease,
		.job = result->job,
		.epoch = result->epoch,
		.tile = result->tile,
		.round = result->round,
		.xxh3 = result->xxh3,
		.render_us = result->render_us,
		.rays = result->rays,
		.rays_dropped = result->rays_dropped,
		.samples_black = result->samples_black,
		.frame = result->frame,
	};
	if (msg->payload_size == 0 || msg->payload_size % sizeof(float) != 0)
		return pen_error_set(err, PEN_EPROTOCOL, "a result of %zu bytes, not whole floats",
			msg->payload_size);
	return 0;
}

static int read_failure(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Failure *failure = &wire->failure;
	int r;

	r = check_range(
		(uint64_t)failure->fault, PEN_FAULT_CRASH, PEN_FAULT_NO_SCENE, "fault", err);
	if (r == 0)
		r = check_text(failure->reason, PEN_REASON_MAX, "the reason", err);
	if (r < 0)
		return r;
	msg->u.failure = (struct pen_msg_failure){
		.lease = failure->lease,
		.fault = (enum pen_fault)failure->fault,
		.reason = failure->reason,
	};
	return 0;
}

static int read_heartbeat(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__Heartbeat *heartbeat = &wire->heartbeat;

	if (heartbeat->n_leases != heartbeat->n_samples)
		return pen_error_set(err, PEN_EPROTOCOL, "a heartbeat of %zu leases and %zu counts",
			heartbeat->n_leases, heartbeat->n_samples);
	if (heartbeat->n_leases > PEN_LEASES_MAX)
		return pen_error_set(
			err, PEN_EPROTOCOL, "a heartbeat of %zu leases", heartbeat->n_leases);
	msg->u.heartbeat = (struct pen_msg_heartbeat){
		.count = (uint32_t)heartbeat->n_leases,
		.leases = heartbeat->leases,
		.samples = heartbeat->samples,
	};
	return 0;
}

static int check_texts(
	char *const *texts, size_t count, size_t max, const char *name, struct pen_error *err)
{
	int r = 0;

	for (size_t i = 0; r == 0 && i < count; i++)
		r = check_text(texts[i], max, name, err);
	return r;
}

static int check_report(const Pen__Wire__SceneReport *report, struct pen_error *err)
{
	const size_t errors = report->n_pointers, warnings = report->n_warnings;
	int r;

	if (errors != report->n_details || (errors > 0) == (warnings > 0))
		return pen_error_set(err, PEN_EPROTOCOL,
			"a report of %zu pointers, %zu details and %zu warnings", errors,
			report->n_details, warnings);
	r = check_range(errors, 0, PEN_SCENE_ERRORS_MAX, "the number of errors", err);
	if (r == 0)
		r = check_range(warnings, 0, PEN_SCENE_WARNINGS_MAX, "the number of warnings", err);
	if (r == 0)
		r = check_texts(
			report->pointers, errors, PEN_SCENE_ERROR_BYTES_MAX, "a pointer", err);
	if (r == 0)
		r = check_texts(
			report->details, errors, PEN_SCENE_ERROR_BYTES_MAX, "a detail", err);
	if (r == 0)
		r = check_texts(
			report->warnings, warnings, PEN_SCENE_WARNING_BYTES_MAX, "a warning", err);
	return r;
}

static int read_scene_report(const union wire *wire, struct pen_msg *msg, struct pen_error *err)
{
	const Pen__Wire__SceneReport *report = &wire->scene_report;
	int r;

	r = read_sha256(&report->scene_sha256, &msg->u.scene_report.scene_sha256, err);
	if (r == 0)
		r = check_report(report, err);
	if (r < 0)
		return r;
	msg->u.scene_report.job = report->job;
	msg->u.scene_report.error_count = (uint32_t)report->n_pointers;
	msg->u.scene_report.pointers = (const char *const *)report->pointers;
	msg->u.scene_report.details = (const char *const *)report->details;
	msg->u.scene_report.warning_count = (uint32_t)report->n_warnings;
	msg->u.scene_report.warnings = (const char *const *)report->warnings;
	return 0;
}

/* Packing only reads, but protobuf-c's structs have no const. */
static char *text_of(const char *text)
{
	return (char *)(uintptr_t)(text ? text : "");
}

static char **texts_of(const char *const *texts)
{
	return (char **)(uintptr_t)texts;
}

static uint64_t *numbers_of(const uint64_t *numbers)
{
	return (uint64_t *)(uintptr_t)numbers;
}

static ProtobufCBinaryData bytes_of(const struct pen_sha256 *sha256)
{
	return (ProtobufCBinaryData){
		.len = sizeof sha256->bytes,
		.data = (uint8_t *)(uintptr_t)sha256->bytes,
	};
}

/* One writer a message: wire has been initialised for its type. */

static void write_hello(const struct pen_msg *msg, union wire *wire)
{
	const struct pen_msg_hello *hello = &msg->u.hello;

	wire->hello.protocol = hello->protocol;
	wire->hello.name = text_of(hello->name);
	wire->hello.processes = hello->processes;
	wire->hello.equivalence_class = text_of(hello->equivalence_class);
	wire->hello.version = text_of(hello->version);
	wire->hello.pid = hello->pid;
}

static void write_welcome(const struct pen_msg *msg, union wire *wire)
{
	wire->welcome.worker = msg->u.welcome.worker;
	wire->welcome.heartbeat_ms = msg->u.welcome.heartbeat_ms;
}

static void write_refuse(const struct pen_msg *msg, union wire *wire)
{
	wire->refuse.reason = text_of(msg->u.text.reason);
}

static void write_drain(const struct pen_msg *msg, union wire *wire)
{
	wire->drain.reason = text_of(msg->u.text.reason);
}

static void write_scene_get(const struct pen_msg *msg, union wire *wire)
{
	wire->scene_get.sha256 = bytes_of(&msg->u.scene_get.sha256);
}

static void write_scene_data(const struct pen_msg *msg, union wire *wire)
{
	const struct pen_msg_scene_data *data = &msg->u.scene_data;

	wire->scene_data.sha256 = bytes_of(&data->sha256);
	wire->scene_data.size = data->size;
	wire->scene_data.offset = data->offset;
	wire->scene_data.missing = data->missing;
}

static void write_lease(const struct pen_msg *msg, union wire *wire)
{
	const struct pen_msg_lease *lease = &msg->u.lease;

	wire->lease.lease = lease->lease;
	wire->lease.job = lease->job;
	wire->lease.epoch = lease->epoch;
	wire->lease.tile = lease->tile;
	wire->lease.round = lease->round;
	wire->lease.frame = lease->frame;
	wire->lease.x0 = lease->rect.x0;
	wire->lease.y0 = lease->rect.y0;
	wire->lease.x1 = lease->rect.x1;
	wire->lease.y1 = lease->rect.y1;
	wire->lease.sample_first = lease->sample_first;
	wire->lease.sample_end = lease->sample_end;
	wire->lease.scene_sha256 = bytes_of(&lease->scene_sha256);
	if (lease->has_world)
		wire->lease.world_sha256 = bytes_of(&lease->world_sha256);
	wire->lease.deadline_ms = lease->deadline_ms;
	wire->lease.channels = lease->channels;
	wire->lease.at_centre = lease->at_centre;
	wire->lease.render = (char *)(uintptr_t)lease->render;
	wire->lease.traceparent = (char *)(uintptr_t)lease->trace;
}

static void write_revoke(const struct pen_msg *msg, union wire *wire)
{
	wire->revoke.lease = msg->u.revoke.lease;
}

static void write_result(const struct pen_msg *msg, union wire *wire)
{
	const struct pen_msg_result *result = &msg->u.result;

	wire->result.lease = result->lease;
	wire->result.job = result->job;
	wire->result.epoch = result->epoch;
	wire->result.tile = result->tile;
	wire->result.round = result->round;
	wire->result.xxh3 = result->xxh3;
	wire->result.render_us = result->render_us;
	wire->result.rays = result->rays;
	wire->result.rays_dropped = result->rays_dropped;
	wire->result.samples_black = result->samples_black;
	wire->result.frame = result->frame;
}

static void write_failure(const struct pen_msg *msg, union wire *wire)
{
	wire->failure.lease = msg->u.failure.lease;
	wire->failure.fault = (Pen__Wire__Fault)msg->u.failure.fault;
	wire->failure.reason = text_of(msg->u.failure.reason);
}

static void write_heartbeat(const struct pen_msg *msg, union wire *wire)
{
	const struct pen_msg_heartbeat *heartbeat = &msg->u.heartbeat;

	wire->heartbeat.n_leases = heartbeat->count;
	wire->heartbeat.leases = numbers_of(heartbeat->leases);
	wire->heartbeat.n_samples = heartbeat->count;
	wire->heartbeat.samples = numbers_of(heartbeat->samples);
}

static void write_scene_report(const struct pen_msg *msg, union wire *wire)
{
	const struct pen_msg_scene_report *report = &msg->u.scene_report;

	wire->scene_report.job = report->job;
	wire->scene_report.scene_sha256 = bytes_of(&report->scene_sha256);
	wire->scene_report.n_pointers = wire->scene_report.n_details = report->error_count;
	wire->scene_report.pointers = texts_of(report->pointers);
	wire->scene_report.details = texts_of(report->details);
	wire->scene_report.n_warnings = report->warning_count;
	wire->scene_report.warnings = texts_of(report->warnings);
}

static const struct {
	const ProtobufCMessageDescriptor *descriptor;
	int (*read)(const union wire *wire, struct pen_msg *msg, struct pen_error *err);
	void (*write)(const struct pen_msg *msg, union wire *wire);
} kinds[PEN_FRAME_TYPE_END] = {
	[PEN_FRAME_HELLO] = {&pen__wire__hello__descriptor, read_hello, write_hello},
	[PEN_FRAME_WELCOME] = {&pen__wire__welcome__descriptor, read_welcome, write_welcome},
	[PEN_FRAME_REFUSE] = {&pen__wire__refuse__descriptor, read_refuse, write_refuse},
	[PEN_FRAME_SCENE_GET] = {&pen__wire__scene_get__descriptor, read_scene_get,
		write_scene_get},
	[PEN_FRAME_SCENE_DATA] = {&pen__wire__scene_data__descriptor, read_scene_data,
		write_scene_data},
	[PEN_FRAME_ASSET_GET] = {&pen__wire__scene_get__descriptor, read_scene_get,
		write_scene_get},
	[PEN_FRAME_ASSET_DATA] = {&pen__wire__scene_data__descriptor, read_scene_data,
		write_scene_data},
	[PEN_FRAME_LEASE] = {&pen__wire__lease__descriptor, read_lease, write_lease},
	[PEN_FRAME_REVOKE] = {&pen__wire__revoke__descriptor, read_revoke, write_revoke},
	[PEN_FRAME_RESULT] = {&pen__wire__result__descriptor, read_result, write_result},
	[PEN_FRAME_FAILURE] = {&pen__wire__failure__descriptor, read_failure, write_failure},
	[PEN_FRAME_HEARTBEAT] = {&pen__wire__heartbeat__descriptor, read_heartbeat,
		write_heartbeat},
	[PEN_FRAME_DRAIN] = {&pen__wire__drain__descriptor, read_drain, write_drain},
	[PEN_FRAME_SCENE_REPORT] = {&pen__wire__scene_report__descriptor, read_scene_report,
		write_scene_report},
};

static void *arena_alloc(void *arena, size_t size)
{
	return pen_arena_alloc(arena, 1, size);
}

static void arena_free(void *arena, void *piece)
{
	(void)arena;
	(void)piece;
}

int pen_msg_read(const struct pen_frame *frame, struct pen_arena *arena, struct pen_msg *ret_msg,
	struct pen_error *err)
{
	ProtobufCAllocator allocator = {arena_alloc, arena_free, arena};
	struct pen_msg msg = {
		.type = frame->type,
		.payload = frame->payload,
		.payload_size = frame->payload_size,
	};
	const union wire *wire;
	int r;

	assert(frame->type > 0 && frame->type < PEN_FRAME_TYPE_END);
	wire = (const union wire *)protobuf_c_message_unpack(
		kinds[frame->type].descriptor, &allocator, frame->control_size, frame->control);
	if (!wire)
		return pen_error_set(
			err, PEN_EPROTOCOL, "cannot decode a message of type %d", (int)frame->type);
	if (wire->base.n_unknown_fields > PEN_FRAME_UNKNOWN_MAX)
		return pen_error_set(err, PEN_EPROTOCOL, "a message with %u unknown fields",
			wire->base.n_unknown_fields);
	r = kinds[frame->type].read(wire, &msg, err);
	if (r < 0)
		return r;
	*ret_msg = msg;
	return 0;
}

int pen_msg_write(
	const struct pen_msg *msg, struct pen_buf *out, uint32_t *sequence, struct pen_error *err)
{
	uint8_t control[CONTROL_MAX];
	struct pen_frame frame = {
		.type = msg->type,
		.control = control,
		.payload = msg->payload,
		.payload_size = msg->payload_size,
	};
	union wire wire;
	int r;

	assert(msg->type > 0 && msg->type < PEN_FRAME_TYPE_END);
	protobuf_c_message_init(kinds[msg->type].descriptor, &wire.base);
	kinds[msg->type].write(msg, &wire);
	frame.control_size = protobuf_c_message_get_packed_size(&wire.base);
	if (frame.control_size > pen_frame_control_max(msg->type))
		return pen_error_set(err, PEN_ELIMIT, "a message of type %d with %zu bytes",
			(int)msg->type, frame.control_size);
	(void)protobuf_c_message_pack(&wire.base, control);
	r = pen_frame_write(out, sequence, &frame);
	if (r < 0)
		return pen_error_set(
			err, r, r == PEN_ELIMIT ? "the peer does not read" : "out of memory");
	return 0;
}
