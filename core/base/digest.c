/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/digest.h"

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

struct pen_sha256_stream {
	gnutls_hash_hd_t hash;
};

int pen_sha256_of(
	const void *data, size_t size, struct pen_sha256 *ret_digest, struct pen_error *err)
{
	struct pen_sha256 digest;
	int r = gnutls_hash_fast(GNUTLS_DIG_SHA256, data, size, digest.bytes);

	if (r < 0)
		return pen_error_set(err, PEN_EIO, "SHA-256: %s", gnutls_strerror(r));
	*ret_digest = digest;
	return 0;
}

int pen_sha256_stream_create(struct pen_sha256_stream **ret_stream, struct pen_error *err)
{
	struct pen_sha256_stream *stream = calloc(1, sizeof *stream);
	int r;

	if (!stream)
		return pen_error_memory(err);
	r = gnutls_hash_init(&stream->hash, GNUTLS_DIG_SHA256);
	if (r < 0) {
		free(stream);
		return pen_error_set(err, PEN_EIO, "SHA-256: %s", gnutls_strerror(r));
	}
	*ret_stream = stream;
	return 0;
}

void pen_sha256_stream_destroy(struct pen_sha256_stream *stream)
{
	if (!stream)
		return;
	gnutls_hash_deinit(stream->hash, NULL);
	free(stream);
}

int pen_sha256_stream_append(
	struct pen_sha256_stream *stream, const void *data, size_t size, struct pen_error *err)
{
	int r = gnutls_hash(stream->hash, data, size);

	return r < 0 ? pen_error_set(err, PEN_EIO, "SHA-256: %s", gnutls_strerror(r)) : 0;
}

void pen_sha256_stream_take(struct pen_sha256_stream *stream, struct pen_sha256 *ret_digest)
{
	gnutls_hash_output(stream->hash, ret_digest->bytes);
}

void pen_sha256_format(const struct pen_sha256 *digest, char *ret_text)
{
	static const char digits[] = "0123456789abcdef";

	for (size_t i = 0; i < sizeof digest->bytes; i++) {
		ret_text[2 * i] = digits[digest->bytes[i] >> 4];
		ret_text[2 * i + 1] = digits[digest->bytes[i] & 15];
	}
	ret_text[PEN_SHA256_TEXT - 1] = '\0';
}

static int digit_value(char c)
{
	if (c >= '0' && c <= '9')
		return c - '0';
	return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

bool pen_sha256_parse(const char *text, struct pen_sha256 *ret_digest)
{
	struct pen_sha256 digest;

	for (size_t i = 0; i < sizeof digest.bytes; i++) {
		int high = digit_value(text[2 * i]);
		int low = high < 0 ? -1 : digit_value(text[2 * i + 1]);

		if (low < 0)
			return false;
		digest.bytes[i] = (uint8_t)(high << 4 | low);
	}
	*ret_digest = digest;
	return true;
}

bool pen_sha256_equal(const struct pen_sha256 *a, const struct pen_sha256 *b)
{
	return memcmp(a->bytes, b->bytes, sizeof a->bytes) == 0;
}

uint64_t pen_xxh3(const void *data, size_t size)
{
	return XXH3_64bits(data, size);
}
