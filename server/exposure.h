/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_EXPOSURE_H
#define PEN_SERVER_EXPOSURE_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>

/*
 * Whether HTTP may listen there: on loopback always, elsewhere with TLS and tokens. PEN_EINVALID
 * tells what is missing, and how one gets it.
 */
int pen_exposure_check_http(const struct sockaddr_storage *address, bool has_tls, uint32_t tokens,
	struct pen_error *err);

/* The same of the port for workers: elsewhere it takes keys. */
int pen_exposure_check_workers(
	const struct sockaddr_storage *address, uint32_t keys, struct pen_error *err);

#endif
