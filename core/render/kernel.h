/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_KERNEL_H
#define PEN_RENDER_KERNEL_H

#include "core/render/render.h"

#include <stdbool.h>

struct pen_admit_box;
struct pen_handful;
struct pen_meeting;
struct pen_packet;
struct pen_rays;
struct pen_sieve;
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
	/* See core/render/admit.h. */
	uint32_t (*admit_rays)(struct pen_rays *rays, int32_t *ret_valid);
	bool (*admit_box_met)(const struct pen_admit_box *box, const struct pen_rays *rays);
	/* See core/render/handful.h. */
	void (*handful_closest)(const struct pen_handful *handful, struct pen_packet *packet);
	bool (*handful_occluded)(const struct pen_handful *handful, struct pen_rays *rays);
	/* See core/render/sieve.h. */
	bool (*sieve_stops)(const struct pen_sieve *sieve, const struct pen_meeting *meeting);
};

extern const struct pen_kernel pen_kernel_v2, pen_kernel_v3, pen_kernel_v4;

#endif
