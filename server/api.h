/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_H
#define PEN_SERVER_API_H

#include "server/encode.h"
#include "server/exchange.h"
#include "server/farm.h"
#include "server/held.h"
#include "server/job.h"
#include "server/rate.h"
#include "server/recent.h"

#include <stdbool.h>
#include <uv.h>

struct pen_shelf;
struct pen_watches;

/* What version 1 of the HTTP interface offers: paths and methods to their handlers. */
struct pen_api {
	uv_loop_t *loop;
	struct pen_jobs *jobs;
	struct pen_farm *farm;
	struct pen_encoders *encoders;
	struct pen_watches *watches;
	struct pen_shelf *shelf;
	struct pen_guard *guard; /* NULL: everybody may do all */
	struct pen_rates rates;	 /* of what is asked to be rendered */
	struct pen_recent recent;
	struct pen_held held;
	unsigned streams;	/* of events, that have clients */
	const char *assets_dir; /* see server/asset_file.h */
	const char *scenes_dir; /* see server/scene_file.h */
	bool draining;		/* no new renders */
	uint64_t boot;		/* differs from start to start: revisions begin anew with each */
};

/* What a path held in place of {…}. */
struct pen_api_parameters {
	char id[64];
	char hash[PEN_SHA256_TEXT];
	char frame[16]; /* "": none */
	char extension[8];
	char page[64];					  /* the rest of the path */
	char region[64], size[32], turn[16], quality[16]; /* see server/api_iiif.h */
};

/*
 * The header is complete and its body has not begun: may say where the body goes. False when the
 * exchange has been answered already.
 */
bool pen_api_admit(struct pen_exchange *exchange);

/* Answers the exchange, now or later. */
void pen_api_handle(struct pen_exchange *exchange);

/* Whether who asks may know of what is this owner's: it is his own, or he may do all. */
bool pen_api_may_see(const struct pen_exchange *exchange, const struct pen_owner *owner);

/*
 * The render of that id, if who asks may know of it; NULL else. All that is asked about a render is
 * asked by this or the next, so that nobody learns whether another one has it.
 */
struct pen_job *pen_api_look_for_render(const struct pen_exchange *exchange, const char *id);

/* The same; when there is none, answers 404 or 410. */
struct pen_job *pen_api_find_render(struct pen_exchange *exchange, const char *id);

#endif
