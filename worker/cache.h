/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_CACHE_H
#define PEN_WORKER_CACHE_H

#include "core/base/digest.h"
#include "proto/msg.h"
#include "worker/assets.h"
#include "worker/config.h"
#include "worker/host.h"

#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

/*
 * The scenes at hand: each one's text, fetched once, and the scene process that has built it from
 * that and from the assets that it asks for; at most PEN_SCENES_CACHED_MAX, the least recently used
 * one goes first. A scene that differs from another in its view alone takes over that one's
 * process, unless somebody wants that one still. Beside them one spare scene process is always kept
 * ready for the next scene.
 */
struct pen_cache;

struct pen_cache_events {
	/* Somebody should send this scene. */
	void (*fetch)(void *user, const struct pen_sha256 *sha256);
	void (*fetch_asset)(void *user, const struct pen_sha256 *sha256);
	/* Whether a lease needs it, so that it must stay. */
	bool (*in_use)(void *user, const struct pen_sha256 *sha256);
	/* Whether it is a lease whose result somebody wants. */
	bool (*is_wanted)(void *user, const struct pen_sha256 *sha256);
	/* Its process ended while building: the unit waiting longest takes the fault. */
	void (*crashed)(void *user, const struct pen_sha256 *sha256, enum pen_fault fault,
		const char *reason);
	/* What pen_cache_demand answers, or which slots are idle, may be different now. */
	void (*changed)(void *user);
	/* As in struct pen_host_events. */
	void (*done)(void *user, struct pen_host *host, uint32_t slot,
		const struct pen_answer *answer, const float *pixels);
	void (*lost)(void *user, uint32_t slot, uint64_t lease, enum pen_fault fault,
		const char *reason);
};

int pen_cache_create(uv_loop_t *loop, const struct pen_zygote *zygote,
	const struct pen_worker_config *config, const struct pen_cache_events *events, void *user,
	struct pen_cache **ret_cache, struct pen_error *err);
void pen_cache_destroy(struct pen_cache *cache);

/*
 * Asks for the process of a lease's scene, for its frame: READY and *ret_host; WAIT, and what is
 * missing is under way or every place is in use; or FAILED, with the fault of its units and the
 * reason, valid until the next call.
 */
enum pen_demand pen_cache_demand(struct pen_cache *cache, const struct pen_msg_lease *lease,
	struct pen_host **ret_host, struct pen_msg_failure *ret_failure);

/*
 * What a render's owner has to be told of a scene that is ready or has failed, once for each
 * render: true and *ret_report, whose texts are valid until the next call; false when there is
 * nothing to tell, or it has been told.
 */
bool pen_cache_report(struct pen_cache *cache, const struct pen_sha256 *sha256, uint64_t job,
	struct pen_msg_scene_report *ret_report);

/* A piece of a text, or that there is none, has arrived. */
void pen_cache_receive(struct pen_cache *cache, const struct pen_msg *scene_data);

/* The same of an asset that a scene process needs. */
void pen_cache_receive_asset(struct pen_cache *cache, const struct pen_msg *asset_data);

/* The connection is gone: texts that were on their way are forgotten, and what has been told. */
void pen_cache_disconnect(struct pen_cache *cache);

/* The zygote tells that scene process id has ended. */
void pen_cache_child(struct pen_cache *cache, uint32_t id, int status);

/* Starts what is due. */
void pen_cache_tick(struct pen_cache *cache, int64_t now_ms);

#endif
