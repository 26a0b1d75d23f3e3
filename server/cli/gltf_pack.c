/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/gltf_pack.h"

#include "core/base/limits.h"
#include "server/cli/folder.h"

#include <jansson.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { CHUNK_JSON = 0x4E4F534A, CHUNK_BINARY = 0x004E4942, GLB_VERSION = 2 };

static const char magic[] = "glTF";

/* One packing: offsets are of the text's buffers in the one that takes their place. */
struct packing {
	int folder;
	const char *path;
	json_t *root;
	struct pen_buf binary;
	size_t *offsets;
	size_t offset_count;
	struct pen_error *err;
};

bool pen_gltf_is_glb(const struct pen_buf *bytes)
{
	return bytes->size >= 4 && memcmp(bytes->data, magic, 4) == 0;
}

bool pen_gltf_is_text(const char *name)
{
	const char *extension = strrchr(name, '.');

	return extension && strcasecmp(extension, ".gltf") == 0;
}

static int refuse(struct packing *packing, const char *what, size_t index, const char *detail)
{
	return pen_error_set(packing->err, PEN_EINVALID, "%.200s: %s %zu %s", packing->path, what,
		index, detail);
}

/* URIs */

static int base64_value(char c)
{
	if (c >= 'A' && c <= 'Z')
		return c - 'A';
	if (c >= 'a' && c <= 'z')
		return c - 'a' + 26;
	if (c >= '0' && c <= '9')
		return c - '0' + 52;
	return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/* RFC 4648, section 4; false for a character that is none of it. */
static bool base64_decode(const char *text, struct pen_buf *out)
{
	uint32_t bits = 0;
	int count = 0;

	for (; *text && *text != '='; text++) {
		int value = base64_value(*text);

		if (value < 0)
			return false;
		bits = bits << 6 | (uint32_t)value;
		count += 6;
		if (count >= 8) {
			char byte = (char)(bits >> (count - 8) & 0xFF);

			count -= 8;
			(void)pen_buf_append(out, &byte, 1);
		}
	}
	return true;
}

static int hex_value(char c)
{
	if (c >= '0' && c <= '9')
		return c - '0';
	c |= 0x20;
	return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* The path below the folder that a relative reference (RFC 3986) of the text means. */
static int uri_path(struct packing *packing, const char *uri, struct pen_buf *out)
{
	const char *end = strrchr(packing->path, '/');

	if (end && uri[0] != '/')
		(void)pen_buf_append(out, packing->path, (size_t)(end - packing->path) + 1);
	while (*uri) {
		int high = *uri == '%' ? hex_value(uri[1]) : -1;
		int low = high >= 0 ? hex_value(uri[2]) : -1;
		char byte = *uri;

		if (low >= 0)
			byte = (char)(high << 4 | low);
		(void)pen_buf_append(out, &byte, 1);
		uri += low >= 0 ? 3 : 1;
	}
	return out->failed ? pen_error_set(packing->err, PEN_EINVALID, "%.200s: a URI is too long",
				     packing->path)
			   : 0;
}

/* Appends the bytes that a URI stands for to the binary chunk. */
static int uri_append(struct packing *packing, const char *what, size_t index, const char *uri)
{
	struct pen_buf path;
	const char *data;
	int r;

	if (strncmp(uri, "data:", 5) == 0) {
		data = strstr(uri, ";base64,");
		if (!data || !base64_decode(data + 8, &packing->binary))
			return refuse(packing, what, index, "has a data URI that is no base64");
		return packing->binary.failed ? refuse(packing, what, index, "is too large") : 0;
	}
	pen_buf_init(&path, PEN_SCENE_STRING_MAX);
	r = uri_path(packing, uri, &path);
	if (r == 0)
		r = pen_folder_read(packing->folder, path.size ? path.data : "", &packing->binary,
			packing->err);
	pen_buf_finish(&path);
	return r;
}

/* Each piece begins at a multiple of four. */
static int binary_align(struct packing *packing)
{
	static const char zeros[4];

	if (pen_buf_append(&packing->binary, zeros, -packing->binary.size & 3) < 0)
		return pen_error_set(packing->err, PEN_ELIMIT, "%.200s is too large with its files",
			packing->path);
	return 0;
}

/* The parts of a glTF */

static int buffer_pack(struct packing *packing, size_t index, json_t *buffer)
{
	const char *uri = json_string_value(json_object_get(buffer, "uri"));
	const json_int_t length = json_integer_value(json_object_get(buffer, "byteLength"));
	int r = binary_align(packing);

	if (r < 0)
		return r;
	if (!uri)
		return refuse(packing, "buffer", index, "has no uri");
	packing->offsets[index] = packing->binary.size;
	r = uri_append(packing, "buffer", index, uri);
	if (r == 0 && packing->binary.size - packing->offsets[index] < (uint64_t)length)
		return refuse(packing, "buffer", index, "is shorter than its byteLength");
	return r;
}

static int buffers_pack(struct packing *packing)
{
	json_t *buffers = json_object_get(packing->root, "buffers"), *buffer;
	size_t i;

	packing->offset_count = json_array_size(buffers);
	packing->offsets = calloc(packing->offset_count + 1, sizeof *packing->offsets);
	if (!packing->offsets)
		return pen_error_memory(packing->err);
	json_array_foreach (buffers, i, buffer) {
		int r = buffer_pack(packing, i, buffer);

		if (r < 0)
			return r;
	}
	return 0;
}

static int views_move(struct packing *packing)
{
	json_t *view;
	size_t i;

	json_array_foreach (json_object_get(packing->root, "bufferViews"), i, view) {
		const json_int_t index = json_integer_value(json_object_get(view, "buffer"));
		const json_int_t offset = json_integer_value(json_object_get(view, "byteOffset"));

		if (index < 0 || (uint64_t)index >= packing->offset_count || offset < 0 ||
			offset > INT32_MAX)
			return refuse(packing, "bufferView", i, "is of no buffer");
		(void)json_object_set_new(view, "buffer", json_integer(0));
		(void)json_object_set_new(view, "byteOffset",
			json_integer(offset + (json_int_t)packing->offsets[index]));
	}
	return 0;
}

static const char *media_type(const char *bytes, size_t size)
{
	if (size >= 4 && memcmp(bytes, "\x89PNG", 4) == 0)
		return "image/png";
	return size >= 2 && memcmp(bytes, "\xff\xd8", 2) == 0 ? "image/jpeg"
							      : "application/octet-stream";
}

static int image_pack(struct packing *packing, size_t index, json_t *image, json_t *views)
{
	const char *uri = json_string_value(json_object_get(image, "uri"));
	size_t start, size;
	int r = binary_align(packing);

	if (r < 0 || !uri)
		return r;
	start = packing->binary.size;
	r = uri_append(packing, "image", index, uri);
	if (r < 0)
		return r;
	size = packing->binary.size - start;
	(void)json_object_set_new(
		image, "mimeType", json_string(media_type(packing->binary.data + start, size)));
	(void)json_object_set_new(
		image, "bufferView", json_integer((json_int_t)json_array_size(views)));
	(void)json_object_del(image, "uri");
	(void)json_array_append_new(
		views, json_pack("{s:i,s:I,s:I}", "buffer", 0, "byteOffset", (json_int_t)start,
			       "byteLength", (json_int_t)size));
	return 0;
}

static int images_pack(struct packing *packing)
{
	json_t *images = json_object_get(packing->root, "images"), *image;
	json_t *views = json_object_get(packing->root, "bufferViews");
	size_t i;

	if (!json_is_array(views) && json_array_size(images) > 0) {
		views = json_array();
		(void)json_object_set_new(packing->root, "bufferViews", views);
	}
	json_array_foreach (images, i, image) {
		int r = image_pack(packing, i, image, views);

		if (r < 0)
			return r;
	}
	return binary_align(packing);
}

/* The container */

static void number_append(struct pen_buf *out, size_t number)
{
	const unsigned char bytes[] = {
		number & 0xFF, number >> 8 & 0xFF, number >> 16 & 0xFF, number >> 24 & 0xFF};

	(void)pen_buf_append(out, bytes, sizeof bytes);
}

static int glb_write(struct packing *packing, struct pen_buf *out)
{
	const size_t binary = packing->binary.size;
	char *text;
	size_t length, padding, total;

	if (binary > 0)
		(void)json_object_set_new(packing->root, "buffers",
			json_pack("[{s:I}]", "byteLength", (json_int_t)binary));
	text = json_dumps(packing->root, JSON_COMPACT);
	if (!text)
		return pen_error_memory(packing->err);
	length = strlen(text);
	padding = -length & 3;
	total = 12 + 8 + length + padding + (binary > 0 ? 8 + binary : 0);
	pen_buf_clear(out);
	(void)pen_buf_text(out, magic);
	number_append(out, GLB_VERSION);
	number_append(out, total);
	number_append(out, length + padding);
	number_append(out, CHUNK_JSON);
	(void)pen_buf_append(out, text, length);
	(void)pen_buf_append(out, "   ", padding);
	if (binary > 0) {
		number_append(out, binary);
		number_append(out, CHUNK_BINARY);
		(void)pen_buf_append(out, packing->binary.data, binary);
	}
	free(text);
	return out->failed ? pen_error_set(packing->err, PEN_ELIMIT,
				     "%.200s is too large with its files", packing->path)
			   : 0;
}

int pen_gltf_pack(struct pen_buf *bytes, int folder, const char *path, struct pen_error *err)
{
	struct packing packing = {.folder = folder, .path = path, .err = err};
	json_error_t where;
	int r = 0;

	pen_buf_init(&packing.binary, bytes->max);
	packing.root = json_loadb(
		bytes->size ? bytes->data : "", bytes->size, JSON_REJECT_DUPLICATES, &where);
	if (!json_is_object(packing.root))
		r = pen_error_set(err, PEN_EINVALID, "%.200s: line %d, column %d, byte %d: %s",
			path, where.line, where.column, where.position,
			packing.root ? "not a JSON object" : where.text);
	if (r == 0)
		r = buffers_pack(&packing);
	if (r == 0)
		r = views_move(&packing);
	if (r == 0)
		r = images_pack(&packing);
	if (r == 0)
		r = glb_write(&packing, bytes);
	json_decref(packing.root);
	free(packing.offsets);
	pen_buf_finish(&packing.binary);
	return r;
}
