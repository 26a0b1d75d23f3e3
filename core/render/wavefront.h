/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_WAVEFRONT_H
#define PEN_RENDER_WAVEFRONT_H

#include "core/base/film.h"
#include "core/render/path.h"
#include "core/render/scatter.h"

/* What a camera ray met first, for the planes of the film; all zeros: nothing. */
struct pen_first {
	float albedo[3];
	float normal[3];
	float depth, hits;
};

/*
 * A batch of paths and its queues. All paths of a batch take their first step, then all that are
 * left take their second, and so on; the queues stay in the processor's L2 cache. Nothing that a
 * path gathers depends on its companions.
 */
struct pen_wavefront {
	const struct pen_render_scene *scene;
	struct pen_film film;
	struct pen_sampler sampler;
	uint32_t frame;	      /* that the sampler is for */
	uint32_t packets_max; /* of camera rays in a batch */
	struct pen_path_queue now, next;
	/* Of each slot of a batch and of one more, for what is dropped. */
	float *radiance;	  /* R, G and B */
	struct pen_first *firsts; /* untouched unless the film has such planes */
};

/*
 * Camera packets of a batch. Whitted's tree of rays doubles at every level, so that its batches
 * are small.
 */
enum {
	PEN_BATCH_PACKETS = 64,
	PEN_BATCH_PACKETS_MIN =
		16 /* a 4x4 block of pixels needs a packet a sample, and stays whole */
};

/* See pen_renderer_unit. */
void pen_wavefront_unit(struct pen_wavefront *wavefront, const struct pen_unit *unit,
	float *ret_pixels, struct pen_render_stats *ret_stats, _Atomic uint64_t *progress);

#endif
