/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/shot.h"

#include "core/base/limits.h"
#include "core/render/pictures.h"

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/*
 * A renderer for tests of the worker: writes a pattern that a test can recompute, and misbehaves
 * on demand. The scene's seed says how.
 */
enum {
	SEED_CRASH = 666001,	   /* units end by SIGSEGV */
	SEED_HANG = 666002,	   /* units never end */
	SEED_CRASH_BUILD = 666003, /* building ends by SIGABRT */
	SEED_SLOW = 666004,	   /* units take 300 ms */
	SEED_FAIL_BUILD = 666005,  /* building fails with a reason */
	SEED_DAMAGE = 666006,	   /* units give NaN */
	SEED_SLOW_BUILD = 666007   /* building takes 500 ms */
};

/* How many frames of an animation stand ready at a time. */
enum { FRAMES_READY = 4, SEED_FAIL_FRAME = 666008 /* frame 9 cannot be built */ };

struct pen_render_scene {
	uint32_t seed, frame;
};

struct pen_render_shot {
	const struct pen_scene *desc;
	uint32_t seed, last, first, count;
	struct pen_render_scene scenes[FRAMES_READY];
};

struct pen_renderer {
	uint32_t seed, frame;
};

static void sleep_ms(long ms)
{
	const struct timespec pause = {ms / 1000, ms % 1000 * 1000000};

	(void)nanosleep(&pause, NULL);
}

const char *pen_isa_name(enum pen_isa isa)
{
	(void)isa;
	return "x86-64-v2";
}

int pen_isa_parse(const char *name, enum pen_isa *ret_isa, struct pen_error *err)
{
	if (strcmp(name, "v2") != 0)
		return pen_error_set(err, PEN_EINVALID, "use v2");
	*ret_isa = PEN_ISA_V2;
	return 0;
}

enum pen_isa pen_isa_best(void)
{
	return PEN_ISA_V2;
}

int pen_isa_supported(enum pen_isa isa)
{
	return isa == PEN_ISA_V2;
}

void pen_class_format(enum pen_isa isa, char *ret_text)
{
	(void)isa;
	(void)snprintf(ret_text, PEN_CLASS_TEXT, "1/x86-64-v2/fake/test");
}

int pen_render_warm_up(enum pen_isa isa, struct pen_error *err)
{
	(void)isa;
	(void)err;
	return 0;
}

int pen_pictures_load(const struct pen_scene *scene, const struct pen_blob *blobs,
	struct pen_scene_errors *errors, struct pen_pictures **ret_pictures, struct pen_error *err)
{
	(void)scene;
	(void)blobs;
	(void)errors;
	(void)err;
	*ret_pictures = NULL;
	return 0;
}

int pen_render_shot_create(const struct pen_scene *scene, const struct pen_pictures *pictures,
	enum pen_isa isa, struct pen_render_shot **ret_shot, struct pen_error *err)
{
	(void)pictures;
	(void)isa;
	if (scene->sampling.seed == SEED_FAIL_BUILD)
		return pen_error_set(err, PEN_EINVALID, "this scene cannot be built");
	if (scene->sampling.seed == SEED_CRASH_BUILD)
		abort();
	if (scene->sampling.seed == SEED_SLOW_BUILD)
		sleep_ms(500);
	*ret_shot = calloc(1, sizeof **ret_shot);
	if (!*ret_shot)
		return pen_error_memory(err);
	(*ret_shot)->desc = scene;
	(*ret_shot)->seed = scene->sampling.seed;
	(*ret_shot)->last = scene->frames.last;
	return 0;
}

int pen_render_shot_look(struct pen_render_shot *shot, struct pen_error *err)
{
	(void)err;
	shot->seed = shot->desc->sampling.seed;
	shot->count = 0;
	return 0;
}

int pen_render_shot_prepare(struct pen_render_shot *shot, uint32_t frame, struct pen_error *err)
{
	if (pen_render_shot_scene(shot, frame))
		return 0;
	if (shot->seed == SEED_FAIL_FRAME && frame == 9)
		return pen_error_set(err, PEN_EINVALID, "this frame cannot be built");
	shot->first = frame;
	shot->count = shot->last - frame < FRAMES_READY ? shot->last - frame + 1 : FRAMES_READY;
	for (uint32_t i = 0; i < shot->count; i++)
		shot->scenes[i] = (struct pen_render_scene){shot->seed, frame + i};
	return 0;
}

const struct pen_render_scene *pen_render_shot_scene(
	const struct pen_render_shot *shot, uint32_t frame)
{
	if (frame < shot->first || frame - shot->first >= shot->count)
		return NULL;
	return &shot->scenes[frame - shot->first];
}

void pen_render_shot_ready(
	const struct pen_render_shot *shot, uint32_t *ret_first, uint32_t *ret_end)
{
	*ret_first = shot->first;
	*ret_end = shot->first + shot->count;
}

int pen_renderer_create(const struct pen_render_scene *scene, struct pen_renderer **ret_renderer,
	struct pen_error *err)
{
	*ret_renderer = malloc(sizeof **ret_renderer);
	if (!*ret_renderer)
		return pen_error_memory(err);
	pen_renderer_set_scene(*ret_renderer, scene);
	return 0;
}

void pen_renderer_set_scene(struct pen_renderer *renderer, const struct pen_render_scene *scene)
{
	renderer->seed = scene->seed;
	renderer->frame = scene->frame;
}

void pen_renderer_destroy(struct pen_renderer *renderer)
{
	free(renderer);
}

static void misbehave(uint32_t seed)
{
	if (seed == SEED_CRASH)
		*(volatile char *)(uintptr_t)seed = 0; /* mapped nowhere */
	if (seed == SEED_SLOW)
		sleep_ms(300);
	while (seed == SEED_HANG)
		sleep_ms(1000);
}

/* A pixel is (x, y, seed, samples). */
void pen_renderer_unit(struct pen_renderer *renderer, const struct pen_unit *unit,
	float *ret_pixels, struct pen_render_stats *ret_stats, _Atomic uint64_t *progress)
{
	float samples = (float)(unit->sample_end - unit->sample_first);
	float *pixel = ret_pixels;

	misbehave(renderer->seed);
	for (uint32_t y = unit->rect.y0; y < unit->rect.y1; y++)
		for (uint32_t x = unit->rect.x0; x < unit->rect.x1;
			x++, pixel += PEN_CHANNELS_MIN) {
			pixel[0] = (float)x;
			pixel[1] = (float)y;
			pixel[2] = (float)renderer->seed;
			pixel[3] = samples;
		}
	if (renderer->seed == SEED_DAMAGE)
		ret_pixels[1] = NAN;
	*ret_stats = (struct pen_render_stats){.samples = 1, .rays = 2};
	atomic_store(progress, pen_rect_area(unit->rect));
}
