/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_PATH_H
#define PEN_RENDER_PATH_H

#include "core/render/scene.h"
#include "core/render/sequence.h"
#include "core/render/trace.h"

#include <math.h>

/* Sixteen paths on their way: the ray of each, and what light along it counts for. */
struct pen_paths {
	struct pen_packet packet;
	float red[PEN_LANES]; /* throughput */
	float green[PEN_LANES];
	float blue[PEN_LANES];
	float lobe_pdf[PEN_LANES]; /* with which the ray's direction was sampled; 0: no light
				      sampling could have found it */
	/* What a sample sees, in scenes with textures or an environment: a cone about the ray. */
	float width[PEN_LANES];	 /* at its origin */
	float spread[PEN_LANES]; /* what a length of 1 adds */
	/* In scenes where lights are chosen from: see pen_points_receiver. */
	float receiver_x[PEN_LANES];
	float receiver_y[PEN_LANES];
	float receiver_z[PEN_LANES];
	uint32_t slot[PEN_LANES];  /* of the sample, within the batch */
	uint32_t key[PEN_LANES];   /* of the sample's pixel, see core/render/sequence.h */
	uint32_t index[PEN_LANES]; /* of the sample */
};

/* What sixteen paths gather at one event. */
struct pen_gathered {
	_Alignas(64) float red[PEN_LANES];
	float green[PEN_LANES];
	float blue[PEN_LANES];
};

/* What every stage reads, and the counts that it raises. */
struct pen_pass {
	const struct pen_render_scene *scene;
	const struct pen_sampler *sampler;
	uint32_t depth;	  /* scattering events behind the rays: 0 for camera rays */
	bool at_centre;	  /* camera rays pass through the pixels' centres */
	bool is_coherent; /* camera packets of canonical composition, and what derives from them */
	uint64_t rays;	  /* lanes traced */
	uint64_t rays_dropped;
};

/* No ray of this lane is to be traced. */
static inline void pen_rays_park(struct pen_rays *rays, int lane)
{
	rays->tnear[lane] = 1.0f;
	rays->tfar[lane] = 0.0f;
}

/* Of two ways to sample one thing, what the way with density a counts (Veach 1997). */
static inline float pen_power_heuristic(float a, float b)
{
	return a * a / (a * a + b * b);
}

#endif
