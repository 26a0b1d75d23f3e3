/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_container.h"

#include "core/base/limits.h"

#include <stdint.h>
#include <string.h>

enum {
	HEADER_BYTES = 12,
	CHUNK_HEADER_BYTES = 8,
	CHUNK_JSON = 0x4E4F534A,
	CHUNK_BINARY = 0x004E4942
};

static uint32_t word_at(const void *bytes, size_t offset)
{
	const unsigned char *b = (const unsigned char *)bytes + offset;

	return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* Counts commas and brackets outside strings: at least as many values as there are. */
static int measure(const struct pen_gltf_container *container, struct pen_error *err)
{
	size_t depth = 0, values = 1;
	bool within_string = false;

	for (size_t i = 0; i < container->text_size; i++) {
		const char c = container->text[i];

		if (within_string && c == '\\')
			i++;
		else if (c == '"')
			within_string = !within_string;
		if (within_string)
			continue;
		values += c == ',' || c == '[' || c == '{';
		depth += c == '[' || c == '{';
		depth -= (c == ']' || c == '}') && depth > 0;
		if (depth > PEN_GLTF_TEXT_DEPTH_MAX)
			return pen_error_set(err, PEN_ELIMIT,
				"its JSON is nested more than %u levels deep",
				PEN_GLTF_TEXT_DEPTH_MAX);
		if (values > PEN_GLTF_TEXT_VALUES_MAX)
			return pen_error_set(err, PEN_ELIMIT, "its JSON holds more than %u values",
				PEN_GLTF_TEXT_VALUES_MAX);
	}
	return 0;
}

static int open_binary_chunk(const void *bytes, size_t size, size_t offset,
	struct pen_gltf_container *container, struct pen_error *err)
{
	uint32_t length;

	if (offset == size)
		return 0;
	if (size - offset < CHUNK_HEADER_BYTES)
		return pen_error_set(err, PEN_EINVALID, "its second chunk is cut short");
	length = word_at(bytes, offset);
	if (word_at(bytes, offset + 4) != CHUNK_BINARY)
		return pen_error_set(err, PEN_EINVALID, "its second chunk is not of type BIN");
	offset += CHUNK_HEADER_BYTES;
	if (length > size - offset)
		return pen_error_set(err, PEN_EINVALID,
			"its BIN chunk of %u bytes is cut short: %zu are there", length,
			size - offset);
	container->chunk = (const char *)bytes + offset;
	container->chunk_offset = offset;
	container->chunk_size = length;
	return 0;
}

static int open_binary(
	const void *bytes, size_t size, struct pen_gltf_container *container, struct pen_error *err)
{
	uint32_t length, text_size;

	if (size < HEADER_BYTES + CHUNK_HEADER_BYTES)
		return pen_error_set(err, PEN_EINVALID, "its GLB header is cut short");
	if (word_at(bytes, 4) != 2)
		return pen_error_set(err, PEN_EINVALID,
			"it is a GLB of version %u; only version 2 is read", word_at(bytes, 4));
	length = word_at(bytes, 8);
	if (length > size || length < HEADER_BYTES + CHUNK_HEADER_BYTES)
		return pen_error_set(err, PEN_EINVALID,
			"its GLB header tells of %u bytes, but %zu are there", length, size);
	text_size = word_at(bytes, HEADER_BYTES);
	if (word_at(bytes, HEADER_BYTES + 4) != CHUNK_JSON)
		return pen_error_set(err, PEN_EINVALID, "its first chunk is not of type JSON");
	if (text_size > length - HEADER_BYTES - CHUNK_HEADER_BYTES)
		return pen_error_set(
			err, PEN_EINVALID, "its JSON chunk of %u bytes is cut short", text_size);
	container->text = (const char *)bytes + HEADER_BYTES + CHUNK_HEADER_BYTES;
	container->text_size = text_size;
	return open_binary_chunk(
		bytes, length, HEADER_BYTES + CHUNK_HEADER_BYTES + text_size, container, err);
}

int pen_gltf_container_open(const void *bytes, size_t size,
	struct pen_gltf_container *ret_container, struct pen_error *err)
{
	struct pen_gltf_container container = {.text = bytes, .text_size = size};
	int r = 0;

	container.is_binary = size >= 4 && memcmp(bytes, "glTF", 4) == 0;
	if (container.is_binary)
		r = open_binary(bytes, size, &container, err);
	if (r == 0 && container.text_size > PEN_GLTF_TEXT_BYTES_MAX)
		r = pen_error_set(err, PEN_ELIMIT, "its JSON is longer than %u bytes",
			PEN_GLTF_TEXT_BYTES_MAX);
	if (r == 0)
		r = measure(&container, err);
	if (r == 0)
		*ret_container = container;
	return r;
}
