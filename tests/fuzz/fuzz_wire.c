/* SPDX-License-Identifier: Apache-2.0 */

/*
 * Any bytes as a stream of the tile protocol, and as the control message of a frame: nothing but an
 * error or valid messages come of them, and a message written again reads as the same type.
 */
#include "proto/frame.h"
#include "proto/msg.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* As a worker or a coordinator takes bytes off the network. */
static void read_stream(const uint8_t *data, size_t size)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_frame_reader reader;
	struct pen_frame frame;
	int r = 0;

	pen_frame_reader_init(&reader);
	while (size > 0 && r == 0) {
		size_t space_size = 0;
		void *space = pen_frame_reader_space(&reader, &space_size);
		size_t part = size < space_size ? size : space_size;

		memcpy(space, data, part);
		pen_frame_reader_fed(&reader, part);
		data += part;
		size -= part;
		while ((r = pen_frame_reader_next(&reader, &frame, &err)) > 0)
			;
	}
	pen_frame_reader_finish(&reader);
}

static void read_message(const uint8_t *data, size_t size)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_frame frame = {
		.type = (enum pen_frame_type)(1 + data[0] % (PEN_FRAME_TYPE_END - 1)),
		.control = data + 1,
		.control_size = size - 1,
	};
	struct pen_arena arena;
	struct pen_buf out;
	struct pen_msg msg;
	uint32_t sequence = 0;

	/* A result's and a piece's payload are any bytes. */
	if (frame.type == PEN_FRAME_RESULT || frame.type == PEN_FRAME_SCENE_DATA) {
		frame.payload = data;
		frame.payload_size = size - size % 16;
	}
	pen_arena_init(&arena, 256 << 10);
	pen_buf_init(&out, 1 << 20);
	if (frame.control_size <= pen_frame_control_max(frame.type) &&
		frame.payload_size <= PEN_TILE_BYTES_MAX &&
		pen_msg_read(&frame, &arena, &msg, &err) == 0 &&
		pen_msg_write(&msg, &out, &sequence, &err) == 0) {
		frame.control = (const uint8_t *)out.data + PEN_FRAME_HEADER;
		frame.control_size = out.size - PEN_FRAME_HEADER - frame.payload_size;
		if (pen_msg_read(&frame, &arena, &msg, &err) < 0)
			abort();
	}
	pen_buf_finish(&out);
	pen_arena_finish(&arena);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	read_stream(data, size);
	if (size > 0)
		read_message(data, size);
	return 0;
}
