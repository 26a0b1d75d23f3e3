/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/shot.h"

#include "core/base/clock.h"
#include "core/render/geometry.h"
#include "core/render/isa.h"
#include "core/render/layout.h"
#include "core/render/lights.h"
#include "core/render/scene.h"

#include <stdlib.h>

enum {
	BEHIND = 2,	       /* frames kept ready: a unit of theirs may come back */
	AHEAD_MS = 15,	       /* spent on frames that nobody has asked for yet */
	AHEAD_BYTES = 64 << 20 /* of geometry, likewise */
};

struct pen_render_shot {
	const struct pen_scene *desc;
	const struct pen_pictures *pictures;
	enum pen_isa isa;
	const struct pen_kernel *kernel;
	bool is_still; /* one frame is all there is: nothing to share */
	struct pen_layout layout;
	struct pen_layout_mark shared; /* how much of the layout all frames share */
	struct pen_geometry geometry;  /* that, as the trees of base read it */
	uint32_t shared_models, shared_shapes;
	struct pen_trace *base;
	struct pen_lights *lights; /* of all frames, when they stand still; made by the first */
	uint32_t first, count;	   /* frames that are ready */
	struct pen_render_scene *scenes[PEN_SHOT_FRAMES_MAX];
};

/* The shared trees read the pools in place: they are built anew where a pool had to move. */
static int build_base(struct pen_render_shot *shot, struct pen_error *err)
{
	const struct pen_geometry now = pen_layout_view(&shot->layout);
	struct pen_geometry *shared = &shot->geometry;

	if (shot->base && now.vertices == shared->vertices && now.indices == shared->indices &&
		now.spheres == shared->spheres && now.disks == shared->disks)
		return 0;
	pen_trace_destroy(shot->base);
	shot->base = NULL;
	*shared = now;
	shared->model_count = shot->shared_models;
	shared->shape_count = shot->shared_shapes;
	return pen_trace_create(shared, shot->isa, shot->kernel, &shot->base, err);
}

static void note_shared(struct pen_render_shot *shot)
{
	const struct pen_geometry view = pen_layout_view(&shot->layout);

	shot->shared = pen_layout_mark(&shot->layout);
	shot->shared_models = view.model_count;
	shot->shared_shapes = view.shape_count;
}

int pen_render_shot_create(const struct pen_scene *desc, const struct pen_pictures *pictures,
	enum pen_isa isa, struct pen_render_shot **ret_shot, struct pen_error *err)
{
	struct pen_render_shot *shot = calloc(1, sizeof *shot);
	int r;

	if (!shot)
		return pen_error_memory(err);
	shot->desc = desc;
	shot->pictures = pictures;
	shot->isa = isa;
	shot->is_still = desc->frames.first == desc->frames.last;
	r = pen_render_kernel(isa, &shot->kernel, err);
	if (r == 0 && !shot->is_still) {
		r = pen_layout_init(&shot->layout, desc, desc->frames.first, err);
		if (r == 0)
			r = pen_geometry_add(&shot->layout, PEN_GEOMETRY_SHARED);
		if (r == 0)
			note_shared(shot);
	}
	if (r < 0)
		pen_render_shot_destroy(shot);
	else
		*ret_shot = shot;
	return r;
}

static void drop_frames(struct pen_render_shot *shot)
{
	for (uint32_t i = 0; i < shot->count; i++)
		pen_render_scene_destroy(shot->scenes[i]);
	shot->count = 0;
}

void pen_render_shot_destroy(struct pen_render_shot *shot)
{
	if (!shot)
		return;
	drop_frames(shot);
	pen_lights_destroy(shot->lights);
	pen_trace_destroy(shot->base);
	pen_layout_finish(&shot->layout);
	free(shot);
}

/* Where a frame's models and shapes are in the pools. */
struct span {
	uint32_t models_end, shapes_first, shapes_end;
};

static int lay_out_frame(
	struct pen_render_shot *shot, uint32_t frame, struct span *ret_span, struct pen_error *err)
{
	struct pen_layout *l = &shot->layout;
	const struct pen_layout_mark mark = pen_layout_mark(l);
	const uint32_t shapes_first = pen_layout_view(l).shape_count;
	struct pen_geometry view;
	int r;

	l->err = err;
	l->shutter = pen_shutter_of(shot->desc, frame);
	/* What deforms has another form in each frame: none may take the one before for its own. */
	pen_layout_forget_models(l, shot->shared_models);
	r = pen_geometry_add(l, PEN_GEOMETRY_FRAME);
	if (r < 0) {
		pen_layout_rewind(l, &mark);
		return r;
	}
	view = pen_layout_view(l);
	*ret_span = (struct span){view.model_count, shapes_first, view.shape_count};
	return 0;
}

/* Whether it is time to stop with frames that nobody has asked for. */
static bool is_enough(struct pen_render_shot *shot, int64_t start_ms)
{
	size_t shared = 0;

	for (int i = 0; i < PEN_LAYOUT_POOLS; i++)
		shared += shot->shared.sizes[i];
	return pen_clock_ms() - start_ms >= AHEAD_MS ||
	       pen_layout_bytes(&shot->layout) - shared >= AHEAD_BYTES;
}

/* Frames from first on, up to wanted at least; tells how many. */
static int lay_out_frames(struct pen_render_shot *shot, uint32_t first, uint32_t wanted,
	struct span ret_spans[PEN_SHOT_FRAMES_MAX], uint32_t *ret_count, struct pen_error *err)
{
	const int64_t start_ms = pen_clock_ms();
	uint32_t count = 0;
	int r = 0;

	while (r == 0 && count < PEN_SHOT_FRAMES_MAX && first + count <= shot->desc->frames.last &&
		(first + count <= wanted || !is_enough(shot, start_ms))) {
		r = lay_out_frame(shot, first + count, &ret_spans[count],
			first + count <= wanted ? err : NULL);
		count += r == 0;
	}
	/* What is wrong with a later frame is told when that is asked for. */
	if (first + count <= wanted)
		return r;
	*ret_count = count;
	return 0;
}

static int build_frame(struct pen_render_shot *shot, uint32_t frame, const struct span *span,
	struct pen_error *err)
{
	struct pen_geometry view = pen_layout_view(&shot->layout);
	int r;

	view.model_count = span->models_end;
	view.shape_count = span->shapes_end;
	r = pen_render_scene_create_on(shot->desc, shot->pictures, frame, shot->isa, &view,
		shot->base, span->shapes_first, &shot->lights, &shot->scenes[shot->count], err);
	shot->count += r == 0;
	return r;
}

static int build_frames(
	struct pen_render_shot *shot, uint32_t first, uint32_t wanted, struct pen_error *err)
{
	const int64_t start_ms = pen_clock_ms();
	struct span spans[PEN_SHOT_FRAMES_MAX];
	uint32_t count = 0;
	int r = lay_out_frames(shot, first, wanted, spans, &count, err);

	if (r == 0)
		r = build_base(shot, err);
	shot->first = first;
	for (uint32_t i = 0; r == 0 && i < count; i++) {
		if (first + i > wanted && is_enough(shot, start_ms))
			break;
		r = build_frame(shot, first + i, &spans[i], err);
	}
	return r;
}

/* Where the frames to make ready begin. */
static uint32_t choose_first(const struct pen_render_shot *shot, uint32_t frame)
{
	const uint32_t end = shot->first + shot->count;
	uint32_t first = frame;

	if (shot->count == 0 || frame < end || frame > end + BEHIND)
		return frame;
	while (first > shot->first && frame - first < BEHIND)
		first--;
	return first;
}

int pen_render_shot_prepare(struct pen_render_shot *shot, uint32_t frame, struct pen_error *err)
{
	uint32_t first;
	int r;

	if (pen_render_shot_scene(shot, frame))
		return 0;
	if (frame < shot->desc->frames.first || frame > shot->desc->frames.last)
		return pen_error_set(err, PEN_EINVALID, "the animation has no frame %u", frame);
	if (shot->is_still) {
		r = pen_render_scene_create(
			shot->desc, shot->pictures, frame, shot->isa, &shot->scenes[0], err);
		shot->first = frame;
		shot->count = r == 0;
		return r;
	}
	first = choose_first(shot, frame);
	drop_frames(shot);
	pen_layout_rewind(&shot->layout, &shot->shared);
	r = build_frames(shot, first, frame, err);
	if (r < 0)
		drop_frames(shot);
	return r;
}

int pen_render_shot_look(struct pen_render_shot *shot, struct pen_error *err)
{
	int r;

	/* What the frames of an animation share stays when they go. */
	if (!shot->is_still || shot->count == 0) {
		drop_frames(shot);
		return 0;
	}
	r = pen_render_scene_look(shot->scenes[0], err);
	if (r < 0)
		drop_frames(shot);
	return r;
}

const struct pen_render_scene *pen_render_shot_scene(
	const struct pen_render_shot *shot, uint32_t frame)
{
	if (frame < shot->first || frame - shot->first >= shot->count)
		return NULL;
	return shot->scenes[frame - shot->first];
}

void pen_render_shot_ready(
	const struct pen_render_shot *shot, uint32_t *ret_first, uint32_t *ret_end)
{
	*ret_first = shot->first;
	*ret_end = shot->first + shot->count;
}
