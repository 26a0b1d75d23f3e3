/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_KEY_H
#define PEN_WORKER_KEY_H

#include "core/base/error.h"
#include "proto/secure.h"

#include <stdbool.h>
#include <stdint.h>

/* What the coordinator knows this worker by, and it the coordinator; without, name is "". */
struct pen_key {
	char name[PEN_SECURE_NAME_MAX + 1];
	uint8_t bits[PEN_SECURE_KEY];
	bool is_single_use; /* good for one connection */
};

/* A line "NAME HEX" from a descriptor, which is closed. */
int pen_key_read(int fd, struct pen_key *ret_key, struct pen_error *err);

/* The same from a file, which nobody but its owner may read. */
int pen_key_read_file(const char *path, struct pen_key *ret_key, struct pen_error *err);

#endif
