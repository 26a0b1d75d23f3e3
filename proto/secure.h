/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_PROTO_SECURE_H
#define PEN_PROTO_SECURE_H

#include "core/base/buf.h"
#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * One end of a connection in TLS 1.3, where both ends know each other by a key that nobody else
 * has, and agree on others for each connection (psk_dhe_ke): who learns the key later cannot read
 * what was said. Bytes in, bytes out; whose socket it is stays with the caller.
 */
struct pen_secure;

enum { PEN_SECURE_KEY = 32, PEN_SECURE_NAME_MAX = 64, PEN_SECURE_FIRST_BYTE = 0x16 };

/* The key of a name; false when there is none: the other end cannot tell that from a wrong key. */
typedef bool (*pen_secure_lookup)(void *user, const char *name, uint8_t *ret_key);

/* The end that dials, and has the key of this name. */
int pen_secure_create_client(const char *name, const uint8_t *key, struct pen_secure **ret_secure,
	struct pen_error *err);

/* The end that is dialled; lookup is called while it is fed, at most once. */
int pen_secure_create_server(pen_secure_lookup lookup, void *user, struct pen_secure **ret_secure,
	struct pen_error *err);
void pen_secure_destroy(struct pen_secure *secure);

/*
 * Bytes that came from the other end. They stay the caller's, and stay as they are until shaking or
 * reading tells that more has to come; PEN_EPROTOCOL when that of the last ones was not waited for.
 */
int pen_secure_feed(
	struct pen_secure *secure, const void *data, size_t size, struct pen_error *err);

/*
 * Goes on getting to know the other end, at the client's before anything is fed. 1: done; 0: more
 * has to come; PEN_EPROTOCOL: it is not who it says. What is to be sent is in pen_secure_out.
 */
int pen_secure_shake(struct pen_secure *secure, struct pen_error *err);

/* Whether both know each other: before that nothing is read or written. */
bool pen_secure_is_open(const struct pen_secure *secure);

/* The name that the other end has shown itself to be, once it is open; of the server only. */
const char *pen_secure_name(const struct pen_secure *secure);

/* What the other end has said: up to size bytes, *ret_size of them; 0: more has to come. */
int pen_secure_read(struct pen_secure *secure, void *data, size_t size, size_t *ret_size,
	struct pen_error *err);

/* Appends to pen_secure_out what says this to the other end. */
int pen_secure_write(
	struct pen_secure *secure, const void *data, size_t size, struct pen_error *err);

/* Bytes for the other end, which the caller takes out. */
struct pen_buf *pen_secure_out(struct pen_secure *secure);

#endif
