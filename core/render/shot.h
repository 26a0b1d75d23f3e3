/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SHOT_H
#define PEN_RENDER_SHOT_H

#include "core/render/render.h"

/*
 * A scene over its frames: what all of them share is built once, and on it a few frames at a time.
 * Building those frames costs what moves, not what rests; rigid things that move cost a transform.
 */
struct pen_render_shot;

enum { PEN_SHOT_FRAMES_MAX = 32 }; /* that stand ready at a time */

/* Builds what the frames share. As pen_render_scene_create; no frame is ready yet. */
int pen_render_shot_create(const struct pen_scene *desc, const struct pen_pictures *pictures,
	enum pen_isa isa, struct pen_render_shot **ret_shot, struct pen_error *err);
void pen_render_shot_destroy(struct pen_render_shot *shot);

/*
 * Makes a frame ready, with some that follow it and the one or two before it, as far as that is
 * cheap; does nothing when it is. Scenes of frames that are dropped become invalid. After a failure
 * no frame is ready; PEN_EINVALID for a frame that the animation does not have.
 */
int pen_render_shot_prepare(struct pen_render_shot *shot, uint32_t frame, struct pen_error *err);

/*
 * Of desc the camera, but for its shutter, the image and the sampling have changed: shows that from
 * now on. Scenes of frames become invalid. After a failure no frame is ready.
 */
int pen_render_shot_look(struct pen_render_shot *shot, struct pen_error *err);

/* A frame that is ready, else NULL. */
const struct pen_render_scene *pen_render_shot_scene(
	const struct pen_render_shot *shot, uint32_t frame);

/* The frames that are ready: from first on, before end; as many as 0. */
void pen_render_shot_ready(
	const struct pen_render_shot *shot, uint32_t *ret_first, uint32_t *ret_end);

#endif
