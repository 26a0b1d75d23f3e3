/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_ASSETS_H
#define PEN_WORKER_ASSETS_H

#include "core/base/digest.h"
#include "proto/msg.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * The assets at hand, each fetched once and kept as sealed memory for whichever scene names it
 * next. Past a number of bytes those go that were wanted least recently, but none that was wanted
 * in the last seconds: a scene that is being built may still ask for it.
 */
struct pen_assets;

struct pen_assets_events {
	/* Somebody should send this asset. */
	void (*fetch)(void *user, const struct pen_sha256 *sha256);
	/* What pen_assets_demand answers may be different now. */
	void (*changed)(void *user);
	void *user;
};

int pen_assets_create(uint64_t bytes_max, const struct pen_assets_events *events,
	struct pen_assets **ret_assets, struct pen_error *err);
void pen_assets_destroy(struct pen_assets *assets);

enum pen_demand { PEN_DEMAND_READY, PEN_DEMAND_WAIT, PEN_DEMAND_FAILED };

/*
 * Asks for an asset: READY and *ret_fd, a sealed memory that stays this table's and is good until
 * the next call; WAIT, and it is under way or will be; or FAILED, with the reason, valid as long,
 * and whether the coordinator lacks it. It is asked for anew a second after it failed.
 */
enum pen_demand pen_assets_demand(struct pen_assets *assets, const struct pen_sha256 *sha256,
	int *ret_fd, const char **ret_reason, bool *ret_missing);

/* A piece of an asset, or that there is none, has arrived. */
void pen_assets_receive(struct pen_assets *assets, const struct pen_msg *asset_data);

/* The connection is gone: what was on its way is forgotten, and so is what was not to be had. */
void pen_assets_disconnect(struct pen_assets *assets);

#endif
