/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_PROTO_FRAME_H
#define PEN_PROTO_FRAME_H

#include "core/base/buf.h"
#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * Frames of the tile protocol, both ways:
 *
 *   offset 0   u32  magic "PENu"
 *          4   u8   version (1)
 *          5   u8   type (enum pen_frame_type)
 *          6   u16  control length: bytes of protobuf message
 *          8   u32  payload length: raw bytes behind the message
 *         12   u32  sequence: 0, 1, 2 … for each direction of a connection
 *         16   u64  xxh3 of message and payload together
 *         24   message, then payload
 *
 * All little-endian. Both lengths are checked against the type's caps before a byte is allocated.
 */
enum { PEN_FRAME_HEADER = 24, PEN_FRAME_VERSION = 1 };

enum pen_frame_type {
	PEN_FRAME_HELLO = 1,
	PEN_FRAME_WELCOME,
	PEN_FRAME_REFUSE,
	PEN_FRAME_SCENE_GET,
	PEN_FRAME_SCENE_DATA, /* with payload */
	PEN_FRAME_LEASE,      /* with payload, or without */
	PEN_FRAME_REVOKE,
	PEN_FRAME_RESULT, /* with payload */
	PEN_FRAME_FAILURE,
	PEN_FRAME_HEARTBEAT,
	PEN_FRAME_DRAIN,
	PEN_FRAME_SCENE_REPORT,
	PEN_FRAME_ASSET_GET,
	PEN_FRAME_ASSET_DATA, /* with payload */
	PEN_FRAME_TYPE_END
};

struct pen_frame {
	enum pen_frame_type type;
	const uint8_t *control;
	size_t control_size;
	const uint8_t *payload;
	size_t payload_size;
};

/* Splits a byte stream into frames, however it was cut on the way. */
struct pen_frame_reader {
	struct pen_buf buf;
	uint32_t sequence;
	size_t consume; /* bytes of the frame handed out last */
};

void pen_frame_reader_init(struct pen_frame_reader *reader);
void pen_frame_reader_finish(struct pen_frame_reader *reader);

/* Where to read the next bytes of the stream to, at least one; NULL without memory. */
void *pen_frame_reader_space(struct pen_frame_reader *reader, size_t *ret_size);

/* size bytes have been read there. */
void pen_frame_reader_fed(struct pen_frame_reader *reader, size_t size);

/*
 * The next whole frame: 1 and *ret_frame (valid until the next call on the reader), 0 when more
 * bytes are needed, PEN_EPROTOCOL when the stream is broken, for good.
 */
int pen_frame_reader_next(
	struct pen_frame_reader *reader, struct pen_frame *ret_frame, struct pen_error *err);

/* The cap on the control bytes of a type. */
size_t pen_frame_control_max(enum pen_frame_type type);

/*
 * Appends one frame to out and counts *sequence up; lengths over the type's caps are a bug
 * (asserted). PEN_ELIMIT or PEN_ENOMEM when out is full: nothing is appended then.
 */
int pen_frame_write(struct pen_buf *out, uint32_t *sequence, const struct pen_frame *frame);

#endif
