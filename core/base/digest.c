/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/digest.h"

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>
#include <string.h>
#include <xxhash.h>

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
