/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/kernel.h"

#include "core/render/admit.h"
#include "core/render/handful.h"
#include "core/render/sieve.h"
#include "core/render/sphere.h"
#include "core/render/wavefront.h"

/* The build gives the name: pen_kernel_v2, …. */
const struct pen_kernel PEN_KERNEL = {
	.unit = pen_wavefront_unit,
	.sphere_distances = pen_sphere_distances,
	.admit_rays = pen_admit_rays,
	.admit_box_met = pen_admit_box_met,
	.handful_closest = pen_handful_closest,
	.handful_occluded = pen_handful_occluded,
	.sieve_stops = pen_sieve_stops,
};
