/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_KERNEL_H
#define PEN_RENDER_KERNEL_H

#include "core/render/render.h"

struct pen_spheres;
struct pen_wavefront;

/*
 * The hot half of the renderer: compiled once for each instruction set, each build linked into one
 * object of which only this table is visible.
 */
struct pen_kernel {
	/* See pen_renderer_unit. */
	void (*unit)(struct pen_wavefront *wavefront, const struct pen_unit *unit,
		float *ret_pixels, struct pen_render_stats *ret_stats, _Atomic uint64_t *progress);
	/* See pen_sphere_distances. */
	void (*sphere_distances)(const struct pen_spheres *spheres, uint32_t primitive,
		const float *rays, uint32_t n, float *ret_distances);
};

extern const struct pen_kernel pen_kernel_v2, pen_kernel_v3, pen_kernel_v4;

#endif
