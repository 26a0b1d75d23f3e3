/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_TRACE_H
#define PEN_RENDER_TRACE_H

#include "core/render/geometry.h"
#include "core/render/kernel.h"
#include "core/render/packet.h"
#include "core/render/render.h"
#include "core/render/sieve.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * Embree, confined, and before it the handful of primitives that need no tree. Rays are traced
 * sixteen at a time, always, and never by another call: single rays give other last bits. Under
 * the default flag a ray's result depends on the ray alone; a packet may be called coherent only
 * when its composition is a function of the request.
 */

struct pen_trace;

/* Of the library that this was built for: "3.13.5". */
const char *pen_trace_version(void);

/* See pen_render_warm_up. */
int pen_trace_warm_up(enum pen_isa isa, struct pen_error *err);

/*
 * Builds the Embree scene, with threads of Embree's own that are idle afterwards. The geometry
 * must outlive it: Embree reads its vertices in place. Spheres are met by the kernel's own test.
 */
int pen_trace_create(const struct pen_geometry *geometry, enum pen_isa isa,
	const struct pen_kernel *kernel, struct pen_trace **ret_trace, struct pen_error *err);

/*
 * The same of the shapes from first on; rays meet what is in base before them. The geometry is
 * base's with more at its end. base gets the trees of its models when they are placed first, so
 * that the next to stand on it finds them. It must outlive the result.
 */
int pen_trace_create_on(struct pen_trace *base, const struct pen_geometry *geometry, uint32_t first,
	struct pen_trace **ret_trace, struct pen_error *err);
void pen_trace_destroy(struct pen_trace *trace);

/* Half the diagonal of the scene's bounding box; 0 for an empty scene. */
double pen_trace_radius(const struct pen_trace *trace);

/*
 * The closest hits; hits are overwritten in every lane. Lanes that Embree must not see (a value
 * that is not finite or beyond 1e18) become misses; returns how many. sieve is asked where shapes
 * let rays pass.
 */
uint32_t pen_trace_closest(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_packet *packet);

/* Whether anything is in between: tfar becomes negative there, and in lanes that were dropped. */
uint32_t pen_trace_occluded(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_rays *rays);

/* World from own coordinates of a shape with placements, at a fraction of the shutter. */
void pen_trace_placement(
	const struct pen_trace *trace, uint32_t shape, float time, float ret_world[3][4]);

#endif
