/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_WORKER_KEY_H
#define PEN_SERVER_WORKER_KEY_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "proto/secure.h"

#include <stddef.h>
#include <stdint.h>

/*
 * The keys that workers are known by, one each. Both ends need the key itself, so that it cannot
 * be kept as a hash: the file is as good as all of them.
 */
struct pen_worker_key {
	char name[PEN_KEY_NAME_MAX + 1];
	uint8_t bits[PEN_SECURE_KEY];
};

/* All of a file; zeroed, there are none. */
struct pen_worker_keys {
	struct pen_worker_key *list;
	size_t count;
};

enum { PEN_WORKER_KEY_TEXT = PEN_KEY_NAME_MAX + 1 + 2 * PEN_SECURE_KEY + 2 };

/* Of a file that is not there, none. As pen_key_file_read; keys stay as they are on failure. */
int pen_worker_keys_load(struct pen_worker_keys *keys, const char *path, struct pen_error *err);
int pen_worker_keys_save(
	const struct pen_worker_keys *keys, const char *path, struct pen_error *err);
void pen_worker_keys_finish(struct pen_worker_keys *keys);

/*
 * A new key of 256 random bits. PEN_ECONFLICT: there is one of that name. PEN_ELIMIT: there are
 * PEN_WORKERS_MAX.
 */
int pen_worker_keys_add(struct pen_worker_keys *keys, const char *name,
	const struct pen_worker_key **ret_key, struct pen_error *err);

/* PEN_ENOTFOUND. */
int pen_worker_keys_remove(struct pen_worker_keys *keys, const char *name, struct pen_error *err);

/* NULL when there is none. */
const struct pen_worker_key *pen_worker_keys_find(
	const struct pen_worker_keys *keys, const char *name);

/* "NAME HEX" and a newline, as a worker takes it; ret_text holds PEN_WORKER_KEY_TEXT characters. */
void pen_worker_key_format(const char *name, const uint8_t *bits, char *ret_text);

#endif
