/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_HTTP_H
#define PEN_SERVER_HTTP_H

#include "core/base/error.h"
#include "server/encode.h"
#include "server/farm.h"
#include "server/job.h"

#include <netinet/in.h>
#include <uv.h>

struct pen_certificate;
struct pen_shelf;

/*
 * The HTTP interface (shared contract: paths, methods, status codes and field names of version 1)
 * on the loop's thread; see server/turns.h.
 */
struct pen_http;

struct pen_http_options {
	struct sockaddr_storage address; /* port 0: any */
	int socket;			 /* a listening one to use instead, or -1 */
	const char *path;		 /* of a socket in the file system, borrowed; NULL: none */
	const struct pen_certificate *certificate; /* borrowed, asked at each connection; NULL: no
						      TLS */
	struct pen_jobs *jobs;
	struct pen_farm *farm;
	struct pen_encoders *encoders;
	struct pen_shelf *shelf;
	struct pen_guard *guard; /* borrowed; NULL: everybody may do all */
	const char *assets_dir;	 /* see server/asset_file.h; borrowed */
	const char *scenes_dir;	 /* see server/scene_file.h; borrowed */
};

int pen_http_create(uv_loop_t *loop, const struct pen_http_options *options,
	struct pen_http **ret_http, struct pen_error *err);

/* The port it listens on. */
uint16_t pen_http_port(const struct pen_http *http);

/* From now on new renders are answered 503 with Retry-After. */
void pen_http_drain(struct pen_http *http);

void pen_http_destroy(struct pen_http *http);

#endif
