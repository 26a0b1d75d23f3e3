/* SPDX-License-Identifier: Apache-2.0 */
#include "proto/frame.h"

#include "core/base/digest.h"
#include "core/base/limits.h"

#include <assert.h>
#include <endian.h>
#include <string.h>

enum { READ_AHEAD = 64 << 10 };

#define FRAME_MAX (PEN_FRAME_HEADER + PEN_FRAME_CONTROL_MAX + PEN_FRAME_PAYLOAD_MAX)
#define MAGIC	  0x754e4550u /* "PENu" */

/* As on the wire, little-endian. */
struct header {
	uint32_t magic;
	uint8_t version;
	uint8_t type;
	uint16_t control_size;
	uint32_t payload_size;
	uint32_t sequence;
	uint64_t xxh3;
};
static_assert(sizeof(struct header) == PEN_FRAME_HEADER, "no padding");

static const struct {
	uint16_t control_max;
	uint32_t payload_max;
} caps[PEN_FRAME_TYPE_END] = {
	[PEN_FRAME_HELLO] = {4096, 0},
	[PEN_FRAME_WELCOME] = {1024, 0},
	[PEN_FRAME_REFUSE] = {4096, 0},
	[PEN_FRAME_SCENE_GET] = {1024, 0},
	[PEN_FRAME_SCENE_DATA] = {1024, PEN_FRAME_PAYLOAD_MAX},
	[PEN_FRAME_LEASE] = {1024, PEN_MASK_BYTES_MAX},
	[PEN_FRAME_REVOKE] = {1024, 0},
	[PEN_FRAME_RESULT] = {1024, PEN_TILE_BYTES_MAX},
	[PEN_FRAME_FAILURE] = {4096, 0},
	[PEN_FRAME_HEARTBEAT] = {16384, 0},
	[PEN_FRAME_DRAIN] = {4096, 0},
	[PEN_FRAME_ASSET_GET] = {1024, 0},
	[PEN_FRAME_ASSET_DATA] = {1024, PEN_FRAME_PAYLOAD_MAX},
	[PEN_FRAME_SCENE_REPORT] = {36 << 10, 0},
};
static_assert(16384 <= PEN_FRAME_CONTROL_MAX && PEN_TILE_BYTES_MAX <= PEN_FRAME_PAYLOAD_MAX,
	"every cap is within the frame's");

size_t pen_frame_control_max(enum pen_frame_type type)
{
	return caps[type].control_max;
}

void pen_frame_reader_init(struct pen_frame_reader *reader)
{
	*reader = (struct pen_frame_reader){0};
	pen_buf_init(&reader->buf, FRAME_MAX + READ_AHEAD);
}

void pen_frame_reader_finish(struct pen_frame_reader *reader)
{
	pen_buf_finish(&reader->buf);
}

static void drop_last_frame(struct pen_frame_reader *reader)
{
	pen_buf_consume(&reader->buf, reader->consume);
	reader->consume = 0;
}

static int check_header(const struct header *header, uint32_t sequence, struct pen_error *err)
{
	if (header->magic != MAGIC)
		return pen_error_set(
			err, PEN_EPROTOCOL, "the peer does not speak the tile protocol");
	if (header->version != PEN_FRAME_VERSION)
		return pen_error_set(err, PEN_EPROTOCOL, "frame version %u, this program speaks %d",
			header->version, PEN_FRAME_VERSION);
	if (header->type == 0 || header->type >= PEN_FRAME_TYPE_END)
		return pen_error_set(err, PEN_EPROTOCOL, "unknown frame type %u", header->type);
	if (header->control_size > caps[header->type].control_max ||
		header->payload_size > caps[header->type].payload_max)
		return pen_error_set(err, PEN_EPROTOCOL,
			"frame type %u with %u + %u bytes, over its cap", header->type,
			header->control_size, header->payload_size);
	if (header->sequence != sequence)
		return pen_error_set(err, PEN_EPROTOCOL, "frame %u where %u was due",
			header->sequence, sequence);
	return 0;
}

/* 1 and a checked header, 0 when it is not whole yet, or PEN_EPROTOCOL. */
static int peek_header(
	const struct pen_frame_reader *reader, struct header *ret_header, struct pen_error *err)
{
	struct header header;
	int r;

	if (reader->buf.size < sizeof header)
		return 0;
	memcpy(&header, reader->buf.data, sizeof header);
	header.magic = le32toh(header.magic);
	header.control_size = le16toh(header.control_size);
	header.payload_size = le32toh(header.payload_size);
	header.sequence = le32toh(header.sequence);
	header.xxh3 = le64toh(header.xxh3);
	r = check_header(&header, reader->sequence, err);
	if (r < 0)
		return r;
	*ret_header = header;
	return 1;
}

static size_t frame_size(const struct header *header)
{
	return sizeof *header + header->control_size + header->payload_size;
}

void *pen_frame_reader_space(struct pen_frame_reader *reader, size_t *ret_size)
{
	struct header header;
	size_t size = READ_AHEAD;
	void *space;

	drop_last_frame(reader);
	if (peek_header(reader, &header, NULL) > 0 && frame_size(&header) > reader->buf.size)
		size = frame_size(&header) - reader->buf.size;
	if (size > reader->buf.max - reader->buf.size)
		size = reader->buf.max - reader->buf.size;
	if (size == 0)
		return NULL;
	space = pen_buf_reserve(&reader->buf, size);
	if (space)
		*ret_size = size;
	return space;
}

void pen_frame_reader_fed(struct pen_frame_reader *reader, size_t size)
{
	assert(size < reader->buf.capacity - reader->buf.size);
	reader->buf.size += size;
}

int pen_frame_reader_next(
	struct pen_frame_reader *reader, struct pen_frame *ret_frame, struct pen_error *err)
{
	struct header header;
	const uint8_t *body;
	int r;

	drop_last_frame(reader);
	r = peek_header(reader, &header, err);
	if (r <= 0)
		return r;
	if (reader->buf.size < frame_size(&header))
		return 0;
	body = (const uint8_t *)reader->buf.data + sizeof header;
	if (pen_xxh3(body, frame_size(&header) - sizeof header) != header.xxh3)
		return pen_error_set(
			err, PEN_EPROTOCOL, "frame %u was damaged on the way", header.sequence);
	*ret_frame = (struct pen_frame){
		.type = header.type,
		.control = body,
		.control_size = header.control_size,
		.payload = body + header.control_size,
		.payload_size = header.payload_size,
	};
	reader->consume = frame_size(&header);
	reader->sequence++;
	return 1;
}

int pen_frame_write(struct pen_buf *out, uint32_t *sequence, const struct pen_frame *frame)
{
	size_t body_size = frame->control_size + frame->payload_size;
	bool fits = sizeof(struct header) + body_size <= out->max - out->size;
	struct header header;
	uint8_t *end;

	assert(frame->type > 0 && frame->type < PEN_FRAME_TYPE_END);
	assert(frame->control_size <= caps[frame->type].control_max);
	assert(frame->payload_size <= caps[frame->type].payload_max);
	end = pen_buf_reserve(out, sizeof header + body_size);
	if (!end)
		return fits ? PEN_ENOMEM : PEN_ELIMIT;
	if (frame->control_size > 0)
		memcpy(end + sizeof header, frame->control, frame->control_size);
	if (frame->payload_size > 0)
		memcpy(end + sizeof header + frame->control_size, frame->payload,
			frame->payload_size);
	header = (struct header){
		.magic = htole32(MAGIC),
		.version = PEN_FRAME_VERSION,
		.type = (uint8_t)frame->type,
		.control_size = htole16((uint16_t)frame->control_size),
		.payload_size = htole32((uint32_t)frame->payload_size),
		.sequence = htole32(*sequence),
		.xxh3 = htole64(pen_xxh3(end + sizeof header, body_size)),
	};
	memcpy(end, &header, sizeof header);
	out->size += sizeof header + body_size;
	out->data[out->size] = '\0';
	++*sequence;
	return 0;
}
