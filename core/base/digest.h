/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_DIGEST_H
#define PEN_BASE_DIGEST_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* SHA-256, for what is named by its content. */
struct pen_sha256 {
	uint8_t bytes[32];
};

enum { PEN_SHA256_TEXT = 65 }; /* 64 hex digits and a NUL */

int pen_sha256_of(
	const void *data, size_t size, struct pen_sha256 *ret_digest, struct pen_error *err);

/* The same of bytes that come in pieces. PEN_EIO when the library refuses. */
struct pen_sha256_stream;

int pen_sha256_stream_create(struct pen_sha256_stream **ret_stream, struct pen_error *err);
void pen_sha256_stream_destroy(struct pen_sha256_stream *stream);
int pen_sha256_stream_append(
	struct pen_sha256_stream *stream, const void *data, size_t size, struct pen_error *err);

/* Of all that was appended; the stream then begins anew. */
void pen_sha256_stream_take(struct pen_sha256_stream *stream, struct pen_sha256 *ret_digest);

/* Lower-case hex; ret_text holds PEN_SHA256_TEXT characters. */
void pen_sha256_format(const struct pen_sha256 *digest, char *ret_text);

/* Exactly 64 lower-case hex digits of text, which need not end there; false otherwise. */
bool pen_sha256_parse(const char *text, struct pen_sha256 *ret_digest);

bool pen_sha256_equal(const struct pen_sha256 *a, const struct pen_sha256 *b);

/* XXH3, 64 bits, seed 0: against accidents, never against liars. */
uint64_t pen_xxh3(const void *data, size_t size);

#endif
