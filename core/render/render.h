/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_RENDER_H
#define PEN_RENDER_RENDER_H

#include "core/base/error.h"
#include "core/base/rect.h"
#include "core/scene/desc.h"

#include <stddef.h>
#include <stdint.h>

/*
 * The renderer: a scene made ready once, then units rendered from it in any order by any number
 * of forked processes. The same unit gives the same bits, whatever was rendered before it, and a
 * pixel's bits depend on nothing but the scene and the sample range.
 */

/* Raised by hand whenever a change alters any bit of any image (a golden-image test guards it). */
#define PEN_RENDER_ABI 7

/* Instruction sets the hot files are built for; each implies Embree's isa. */
enum pen_isa { PEN_ISA_V2, PEN_ISA_V3, PEN_ISA_V4, PEN_ISA_COUNT };

/* "x86-64-v2", … */
const char *pen_isa_name(enum pen_isa isa);

/* From a name, or "v2".."v4"; PEN_EINVALID names the choices. */
int pen_isa_parse(const char *name, enum pen_isa *ret_isa, struct pen_error *err);

/* The best that this processor runs. */
enum pen_isa pen_isa_best(void);

/* Whether this processor runs it. */
int pen_isa_supported(enum pen_isa isa);

enum { PEN_CLASS_TEXT = 96 };

/*
 * The equivalence class in which images are bit-identical:
 * "ABI/ISA/embree-VERSION/CPU-VENDOR", at most PEN_CLASS_TEXT characters with the NUL.
 */
void pen_class_format(enum pen_isa isa, char *ret_text);

/* A scene as one frame shows it: at the frame's time, its samples seeded by its number. */
struct pen_render_scene;
struct pen_pictures;

/*
 * Builds the Embree scene and the tables (with all threads that Embree likes). After this the
 * process may fork; children may only call pen_renderer_*. pictures: those of desc, see
 * core/render/pictures.h; NULL when it has none. Both must outlive the result.
 */
int pen_render_scene_create(const struct pen_scene *desc, const struct pen_pictures *pictures,
	uint32_t frame, enum pen_isa isa, struct pen_render_scene **ret_scene,
	struct pen_error *err);
void pen_render_scene_destroy(struct pen_render_scene *scene);

/*
 * Makes the Embree device (about 10 ms) before a scene is known, so that a spare process has it;
 * pen_render_scene_create of the same isa then uses it. Optional, at most once a process.
 */
int pen_render_warm_up(enum pen_isa isa, struct pen_error *err);

/* A unit of work: one tile's share of one round of a frame. Samples [sample_first, sample_end). */
struct pen_unit {
	struct pen_rect rect;
	uint32_t frame;
	uint32_t sample_first, sample_end;
	uint32_t at_centre;  /* 1: through the pixels' centres, whatever the filter */
	const uint8_t *mask; /* pixels that are rendered, see core/base/mask.h; NULL: all */
};

struct pen_render_stats {
	uint64_t rays;		/* lanes traced, all kinds */
	uint64_t samples;	/* paths started */
	uint64_t rays_dropped;	/* rays with a value Embree must not see; their light is lost */
	uint64_t samples_black; /* samples whose result was not finite; counted as black */
};

/* One process's working memory. Not shared between threads. */
struct pen_renderer;

int pen_renderer_create(const struct pen_render_scene *scene, struct pen_renderer **ret_renderer,
	struct pen_error *err);
void pen_renderer_destroy(struct pen_renderer *renderer);

/* From now on units are rendered from another frame of the same scene. */
void pen_renderer_set_scene(struct pen_renderer *renderer, const struct pen_render_scene *scene);

/*
 * Renders a unit, which is of the scene's frame. ret_pixels: the scene's film (pen_scene_film), row
 * by row of unit->rect, overwritten: sums over the unit's samples and their count; zeros where the
 * mask has none. A pixel's samples are summed in index order in blocks of 16 aligned to absolute
 * indices, blocks in order, all in float32. ret_stats and progress (samples finished so far, raised
 * as they finish) may be NULL.
 */
void pen_renderer_unit(struct pen_renderer *renderer, const struct pen_unit *unit,
	float *ret_pixels, struct pen_render_stats *ret_stats, _Atomic uint64_t *progress);

#endif
