/* SPDX-License-Identifier: Apache-2.0 */
#include "proto/frame.h"

#include "core/base/digest.h"
#include "core/base/limits.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Offsets of frame.h. */
enum { AT_TYPE = 5, AT_CONTROL = 6, AT_PAYLOAD = 8, AT_XXH3 = 16 };

static struct pen_buf write_frame(uint32_t sequence, enum pen_frame_type type, const char *control,
	size_t control_size, const char *payload, size_t payload_size)
{
	const struct pen_frame frame = {
		.type = type,
		.control = (const uint8_t *)control,
		.control_size = control_size,
		.payload = (const uint8_t *)payload,
		.payload_size = payload_size,
	};
	struct pen_buf out;

	pen_buf_init(&out, 16 << 20);
	assert_int_equal(pen_frame_write(&out, &sequence, &frame), 0);
	return out;
}

static void feed(struct pen_frame_reader *reader, const char *data, size_t size)
{
	while (size > 0) {
		size_t space_size, part;
		void *space = pen_frame_reader_space(reader, &space_size);

		assert_non_null(space);
		part = size < space_size ? size : space_size;
		memcpy(space, data, part);
		pen_frame_reader_fed(reader, part);
		data += part;
		size -= part;
	}
}

/* Fails when the layout of frame.h is not what goes over the wire. */
static void test_layout(void **state)
{
	struct pen_buf out = write_frame(0x01020304, PEN_FRAME_RESULT, "ab", 2, "payload", 7);
	const unsigned char expected[] = {
		'P', 'E', 'N', 'u', 1, PEN_FRAME_RESULT, 2, 0, 7, 0, 0, 0, 4, 3, 2, 1};
	uint64_t xxh3 = pen_xxh3("abpayload", 9);

	(void)state;
	assert_int_equal(out.size, PEN_FRAME_HEADER + 9);
	assert_memory_equal(out.data, expected, sizeof expected);
	assert_memory_equal(out.data + AT_XXH3, &xxh3, sizeof xxh3);
	assert_memory_equal(out.data + PEN_FRAME_HEADER, "abpayload", 9);
	pen_buf_finish(&out);
}

/* Fails when the result depends on where the stream was cut. */
static void test_splits(void **state)
{
	static const char *const payloads[] = {"", "x", "a longer one"};
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_buf stream;
	uint32_t sequence = 0;

	(void)state;
	pen_buf_init(&stream, 1 << 20);
	for (size_t i = 0; i < 3; i++) {
		const struct pen_frame frame = {PEN_FRAME_SCENE_DATA, (const uint8_t *)"control", i,
			(const uint8_t *)payloads[i], strlen(payloads[i])};

		assert_int_equal(pen_frame_write(&stream, &sequence, &frame), 0);
	}
	assert_int_equal(sequence, 3);
	for (size_t step = 1; step <= stream.size; step++) {
		struct pen_frame_reader reader;
		struct pen_frame frame;
		size_t found = 0;

		pen_frame_reader_init(&reader);
		for (size_t at = 0; at < stream.size; at += step) {
			size_t part = stream.size - at < step ? stream.size - at : step;

			feed(&reader, stream.data + at, part);
			while (pen_frame_reader_next(&reader, &frame, &err) == 1) {
				assert_int_equal(frame.control_size, found);
				assert_int_equal(frame.payload_size, strlen(payloads[found]));
				assert_memory_equal(frame.control, "control", found);
				assert_memory_equal(
					frame.payload, payloads[found], frame.payload_size);
				found++;
			}
		}
		assert_int_equal(err.code, PEN_OK);
		assert_int_equal(found, 3);
		pen_frame_reader_finish(&reader);
	}
	pen_buf_finish(&stream);
}

/* Whether a stream that starts with these bytes is refused, now and for good. */
static bool refused(const struct pen_buf *stream)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_frame_reader reader;
	struct pen_frame frame;
	int first, second;

	pen_frame_reader_init(&reader);
	feed(&reader, stream->data, stream->size);
	first = pen_frame_reader_next(&reader, &frame, &err);
	second = pen_frame_reader_next(&reader, &frame, &err);
	pen_frame_reader_finish(&reader);
	if (first < 0)
		assert_int_equal(second, first);
	assert_true(first >= 0 || (first == PEN_EPROTOCOL && err.text[0] != '\0'));
	return first < 0;
}

/* Fails when any single flipped bit of a frame gets through. */
static void test_corruption(void **state)
{
	struct pen_buf stream = write_frame(0, PEN_FRAME_RESULT, "control", 7, "payload", 7);

	(void)state;
	assert_false(refused(&stream));
	for (size_t bit = 0; bit < stream.size * 8; bit++) {
		struct pen_error err = PEN_ERROR_INIT;
		struct pen_frame_reader reader;
		struct pen_frame frame;

		stream.data[bit / 8] = (char)(stream.data[bit / 8] ^ 1 << bit % 8);
		pen_frame_reader_init(&reader);
		feed(&reader, stream.data, stream.size);
		/* A length that grew makes the reader wait for more. */
		assert_true(pen_frame_reader_next(&reader, &frame, &err) <= 0);
		pen_frame_reader_finish(&reader);
		stream.data[bit / 8] = (char)(stream.data[bit / 8] ^ 1 << bit % 8);
	}
	pen_buf_finish(&stream);
}

/* Fails when a frame is taken out of order, as one that was replayed or left out. */
static void test_sequence(void **state)
{
	struct pen_buf stream = write_frame(1, PEN_FRAME_REVOKE, "", 0, "", 0);

	(void)state;
	assert_true(refused(&stream));
	pen_buf_finish(&stream);
}

/* Whether the header alone, with these lengths, is refused. */
static bool lengths_refused(enum pen_frame_type type, size_t control_size, size_t payload_size)
{
	struct pen_buf stream = write_frame(0, PEN_FRAME_REVOKE, "", 0, "", 0);
	uint16_t control = (uint16_t)control_size;
	uint32_t payload = (uint32_t)payload_size;
	bool result;

	stream.data[AT_TYPE] = (char)type;
	memcpy(stream.data + AT_CONTROL, &control, sizeof control);
	memcpy(stream.data + AT_PAYLOAD, &payload, sizeof payload);
	result = refused(&stream);
	pen_buf_finish(&stream);
	return result;
}

/* Fails when a cap is off by one, or checked only after the bytes have come. */
static void test_caps(void **state)
{
	(void)state;
	for (int type = PEN_FRAME_HELLO; type < PEN_FRAME_TYPE_END; type++) {
		enum pen_frame_type t = (enum pen_frame_type)type;
		size_t control_max = pen_frame_control_max(t);
		size_t payload_max = t == PEN_FRAME_SCENE_DATA	 ? PEN_FRAME_PAYLOAD_MAX
				     : t == PEN_FRAME_ASSET_DATA ? PEN_FRAME_PAYLOAD_MAX
				     : t == PEN_FRAME_RESULT	 ? PEN_TILE_BYTES_MAX
				     : t == PEN_FRAME_LEASE	 ? PEN_MASK_BYTES_MAX
								 : 0;

		assert_true(control_max <= PEN_FRAME_CONTROL_MAX);
		assert_false(lengths_refused(t, control_max - 1, 0));
		assert_false(lengths_refused(t, control_max, payload_max));
		assert_true(lengths_refused(t, control_max + 1, 0));
		assert_true(lengths_refused(t, 0, payload_max + 1));
		if (payload_max > 0)
			assert_false(lengths_refused(t, 0, payload_max - 1));
	}
	assert_true(lengths_refused((enum pen_frame_type)0, 0, 0));
	assert_true(lengths_refused(PEN_FRAME_TYPE_END, 0, 0));
	assert_true(lengths_refused(PEN_FRAME_RESULT, 0, UINT32_MAX));
}

/* Fails when the largest frame does not pass, or a reader holds much more than one frame. */
static void test_largest(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_frame_reader reader;
	struct pen_frame frame;
	char *payload = calloc(1, PEN_FRAME_PAYLOAD_MAX);
	struct pen_buf stream;

	(void)state;
	payload[PEN_FRAME_PAYLOAD_MAX - 1] = 'z';
	stream = write_frame(0, PEN_FRAME_SCENE_DATA, "c", 1, payload, PEN_FRAME_PAYLOAD_MAX);
	pen_frame_reader_init(&reader);
	feed(&reader, stream.data, 100);
	assert_int_equal(pen_frame_reader_next(&reader, &frame, &err), 0);
	feed(&reader, stream.data + 100, stream.size - 100);
	assert_int_equal(pen_frame_reader_next(&reader, &frame, &err), 1);
	assert_int_equal(frame.payload_size, PEN_FRAME_PAYLOAD_MAX);
	assert_int_equal(frame.payload[PEN_FRAME_PAYLOAD_MAX - 1], 'z');
	assert_true(reader.buf.max <=
		    PEN_FRAME_HEADER + 2 * PEN_FRAME_CONTROL_MAX + PEN_FRAME_PAYLOAD_MAX);
	pen_frame_reader_finish(&reader);
	pen_buf_finish(&stream);
	free(payload);
}

/* Fails when a full buffer gets half a frame, or its sequence number is spent. */
static void test_full(void **state)
{
	const struct pen_frame frame = {PEN_FRAME_REVOKE, (const uint8_t *)"x", 1, NULL, 0};
	uint32_t sequence = 5;
	struct pen_buf out;

	(void)state;
	pen_buf_init(&out, PEN_FRAME_HEADER);
	assert_int_equal(pen_frame_write(&out, &sequence, &frame), PEN_ELIMIT);
	assert_int_equal(out.size, 0);
	assert_int_equal(sequence, 5);
	pen_buf_finish(&out);
	pen_buf_init(&out, PEN_FRAME_HEADER + 1);
	assert_int_equal(pen_frame_write(&out, &sequence, &frame), 0);
	assert_int_equal(sequence, 6);
	pen_buf_finish(&out);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_layout),
		cmocka_unit_test(test_splits),
		cmocka_unit_test(test_corruption),
		cmocka_unit_test(test_sequence),
		cmocka_unit_test(test_caps),
		cmocka_unit_test(test_largest),
		cmocka_unit_test(test_full),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
