/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_HOST_H
#define PEN_WORKER_HOST_H

#include "proto/msg.h"
#include "worker/channel.h"
#include "worker/config.h"
#include "worker/findings.h"
#include "worker/zygote.h"

#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

/*
 * The pool's side of one scene process and of the render processes below it: one for each slot,
 * started again when it ends. Nothing that comes from them is trusted: descriptors are never taken
 * from them, processes are ended by what the kernel says who they are.
 */
struct pen_host;

/* Any but lost may destroy the host. */
struct pen_host_events {
	/* It has told which assets it needs: pen_host_needs. */
	void (*needs)(void *user, struct pen_host *host);
	/* The scene has been built, or (reason) cannot be. */
	void (*ready)(void *user, struct pen_host *host);
	void (*failed)(void *user, struct pen_host *host, const char *reason);
	/* A slot takes an order now. */
	void (*idle)(void *user, struct pen_host *host);
	/*
	 * An order has been rendered, and the slot takes the next one now. The pixels stay until
	 * the one after that; they may still change under a reader.
	 */
	void (*done)(void *user, struct pen_host *host, uint32_t slot,
		const struct pen_answer *answer, const float *pixels);
	/* A slot's order ends without pixels. */
	void (*lost)(void *user, uint32_t slot, uint64_t lease, enum pen_fault fault,
		const char *reason);
};

/* id names the scene process to the zygote and is never used twice. */
int pen_host_create(uv_loop_t *loop, const struct pen_zygote *zygote, uint32_t id,
	const struct pen_worker_config *config, const struct pen_host_events *events, void *user,
	struct pen_host **ret_host, struct pen_error *err);

/* Ends its processes without a word. */
void pen_host_destroy(struct pen_host *host);

/* What has been told of the scene so far: it passes to the caller. */
struct pen_findings pen_host_take_findings(struct pen_host *host);

uint32_t pen_host_id(const struct pen_host *host);

/*
 * Gives it its scene, once, and the frame that is wanted first; text is sealed memory and stays the
 * caller's.
 */
int pen_host_load(struct pen_host *host, int text, uint32_t frame, struct pen_error *err);

/*
 * Has it show another view of the scene that it has built; every order is lost to it. text and
 * frame are as above.
 */
int pen_host_look(struct pen_host *host, int text, uint32_t frame, struct pen_error *err);

/* The assets that it needs, each once, in the order in which it takes them; 0 until it told all. */
uint32_t pen_host_needs(const struct pen_host *host, const struct pen_sha256 **ret_needs);

/* Gives it asset index, sealed memory that stays the caller's; false when it cannot take it yet. */
bool pen_host_give(struct pen_host *host, uint32_t index, int asset);

bool pen_host_idle(const struct pen_host *host, uint32_t slot);

/* Whether the process of an idle slot has the frame: each has a few of an animation. */
bool pen_host_has_frame(const struct pen_host *host, uint32_t slot, uint32_t frame);

/* Gives an idle slot another process, which has the frame; the slot is idle again when it is there.
 */
void pen_host_turn(struct pen_host *host, uint32_t slot, uint32_t frame);

/*
 * Hands an order to an idle slot that has its frame, whose place it sets; false when the slot's
 * process is just ending.
 */
bool pen_host_order(struct pen_host *host, uint32_t slot, struct pen_order *order);

/* Kills the slot's render process; its order ends without an event. */
void pen_host_abort(struct pen_host *host, uint32_t slot);

/* Samples finished of the slot's order. */
uint64_t pen_host_progress(const struct pen_host *host, uint32_t slot);

/* Starts render processes that are due, and ends a scene process that hangs. Call it often. */
void pen_host_tick(struct pen_host *host, int64_t now_ms);

/* The scene process has ended: every order is lost to the same fault. Destroy the host next. */
void pen_host_ended(struct pen_host *host, enum pen_fault fault, const char *reason);

#endif
