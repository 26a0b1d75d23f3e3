/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CANVAS_H
#define PEN_SERVER_CANVAS_H

#include "core/base/error.h"
#include "server/framebuf.h"
#include "server/quota.h"

#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

/*
 * The framebuffer file of a frame that renders. All file work is done on libuv's thread pool, one
 * task after the other in the order of the calls; events come from the loop, never from within a
 * call.
 */
struct pen_canvas;

/* What a tile holds: as many rounds, bytes that hash so, samples over all its pixels. */
struct pen_canvas_tile {
	uint16_t rounds;
	uint64_t xxh3;
	uint64_t samples;
};

struct pen_canvas_events {
	/* tiles has as many as the tiling; those whose bytes are not what they should be, or whose
	 * quota is lost, have 0 rounds. Only of pen_canvas_open. */
	void (*opened)(
		void *user, uint64_t job, uint32_t frame, const struct pen_canvas_tile *tiles);
	void (*merged)(void *user, uint64_t job, uint32_t frame, uint32_t tile,
		const struct pen_canvas_tile *state);
	void (*decided)(void *user, uint64_t job, uint32_t frame);
	void (*synced)(void *user, uint64_t job, uint32_t frame);
	/* The last event: nothing asked for after the failure has been done. */
	void (*failed)(void *user, uint64_t job, const struct pen_error *err);
	void *user;
};

/* A new file at path, which replaces an older one. */
int pen_canvas_create(uv_loop_t *loop, uint64_t job, uint32_t frame, const char *path,
	const struct pen_framebuf *framebuf, const struct pen_canvas_events *events,
	struct pen_canvas **ret_canvas, struct pen_error *err);

/*
 * The file that is there, checked against tiles (copied, samples counted anew); a new one when it
 * is missing.
 */
int pen_canvas_open(uv_loop_t *loop, uint64_t job, uint32_t frame, const char *path,
	const struct pen_framebuf *framebuf, const struct pen_canvas_tile *tiles,
	const struct pen_canvas_events *events, struct pen_canvas **ret_canvas,
	struct pen_error *err);

/* pixels (heap) become the canvas's. PEN_ENOMEM. */
int pen_canvas_merge(struct pen_canvas *canvas, uint32_t tile, uint32_t round, float *pixels,
	struct pen_error *err);

/*
 * Decides which pixels go on when every tile has what it shall have so far, else does nothing;
 * decided is told in either case. See server/decide.h.
 */
int pen_canvas_decide(struct pen_canvas *canvas, struct pen_error *err);

/* What a tile shall have, as far as is decided. */
struct pen_demand pen_canvas_demand(const struct pen_canvas *canvas, uint32_t tile);

/* See pen_quota_mask; while nothing is being decided. */
bool pen_canvas_mask(
	const struct pen_canvas *canvas, uint32_t tile, uint32_t round, uint8_t *ret_mask);

/*
 * The file is on the disk when synced is told; when it need not be durable, what was asked for
 * before is done.
 */
int pen_canvas_sync(struct pen_canvas *canvas, bool is_durable, struct pen_error *err);

/* No event comes after this; what has not begun is dropped. May be called from within an event. */
void pen_canvas_destroy(struct pen_canvas *canvas);

#endif
