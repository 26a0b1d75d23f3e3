/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_PROTO_MSG_H
#define PEN_PROTO_MSG_H

#include "core/base/arena.h"
#include "core/base/buf.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/limits.h"
#include "core/base/rect.h"
#include "proto/frame.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * The messages of penumbra.proto as plain structs, so that nobody else sees protobuf-c. What
 * pen_msg_read returns has been validated: strings are UTF-8 within their bounds, counts and
 * rectangles within limits.h, hashes whole, sample ranges not empty, payload sizes as the message
 * says.
 */

struct pen_msg_hello {
	uint32_t protocol;
	const char *name;
	uint32_t processes;
	const char *equivalence_class;
	const char *version;
	uint32_t pid;
};

struct pen_msg_welcome {
	uint64_t worker;
	uint32_t heartbeat_ms;
};

struct pen_msg_text { /* Refuse, Drain */
	const char *reason;
};

/* The same of assets, whose frames have types of their own. */
struct pen_msg_scene_get {
	struct pen_sha256 sha256;
};

struct pen_msg_scene_data {
	struct pen_sha256 sha256;
	uint64_t size, offset;
	bool missing;
};

enum { PEN_LEASE_RENDER_TEXT = 65 };

struct pen_msg_lease {
	uint64_t lease, job;
	uint32_t epoch, tile, round, frame;
	struct pen_rect rect;
	uint32_t sample_first, sample_end;
	struct pen_sha256 scene_sha256;
	bool has_world; /* scenes with the same one differ in their view alone */
	struct pen_sha256 world_sha256;
	uint32_t deadline_ms;
	bool at_centre;			    /* samples go through the pixels' centres */
	uint32_t channels;		    /* PEN_CHANNELS_MIN .. PEN_CHANNELS_MAX */
	char render[PEN_LEASE_RENDER_TEXT]; /* the render's id, for logs */
	char trace[PEN_TRACEPARENT_TEXT];   /* its traceparent, for logs; "": none */
};

struct pen_msg_revoke {
	uint64_t lease;
};

struct pen_msg_result {
	uint64_t lease, job;
	uint32_t epoch, tile, round;
	uint64_t xxh3;
	uint32_t render_us;
	uint64_t rays, rays_dropped, samples_black;
	uint32_t frame;
};

enum pen_fault {
	PEN_FAULT_NONE,
	PEN_FAULT_CRASH,
	PEN_FAULT_KILLED,
	PEN_FAULT_DEADLINE,
	PEN_FAULT_SCENE,
	PEN_FAULT_RETURNED,
	PEN_FAULT_NO_SCENE
};

struct pen_msg_failure {
	uint64_t lease;
	enum pen_fault fault;
	const char *reason;
};

struct pen_msg_heartbeat {
	uint32_t count; /* <= PEN_LEASES_MAX */
	const uint64_t *leases;
	const uint64_t *samples;
};

/* Errors, or warnings: one of them, never both. */
struct pen_msg_scene_report {
	uint64_t job;
	struct pen_sha256 scene_sha256;
	uint32_t error_count; /* <= PEN_SCENE_ERRORS_MAX */
	const char *const *pointers, *const *details;
	uint32_t warning_count; /* <= PEN_SCENE_WARNINGS_MAX */
	const char *const *warnings;
};

struct pen_msg {
	enum pen_frame_type type;
	union {
		struct pen_msg_hello hello;
		struct pen_msg_welcome welcome;
		struct pen_msg_text text;
		struct pen_msg_scene_get scene_get;
		struct pen_msg_scene_data scene_data;
		struct pen_msg_lease lease;
		struct pen_msg_revoke revoke;
		struct pen_msg_result result;
		struct pen_msg_failure failure;
		struct pen_msg_heartbeat heartbeat;
		struct pen_msg_scene_report scene_report;
	} u;
	const void *payload; /* of SCENE_DATA, ASSET_DATA and RESULT; of LEASE: NULL or a mask of
				the tile */
	size_t payload_size;
};

/*
 * Decodes and validates a frame. Strings and arrays of *ret_msg live in arena (the caller resets
 * it between messages), the payload in the frame. PEN_EPROTOCOL names what is wrong.
 */
int pen_msg_read(const struct pen_frame *frame, struct pen_arena *arena, struct pen_msg *ret_msg,
	struct pen_error *err);

/* Encodes msg as one frame at the end of out; see pen_frame_write. */
int pen_msg_write(
	const struct pen_msg *msg, struct pen_buf *out, uint32_t *sequence, struct pen_error *err);

#endif
