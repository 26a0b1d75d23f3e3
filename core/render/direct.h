/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_DIRECT_H
#define PEN_RENDER_DIRECT_H

#include "core/render/path.h"
#include "core/render/point.h"

/*
 * Adds the light that reaches the points straight from lights, the environment and, on diffuse
 * surfaces of the distribution integrator, a background of one color, each tested with shadow rays.
 */
void pen_direct_add(struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct pen_gathered *sum);

/*
 * Adds what the rays themselves see: the background, and lights by their emitting side; the
 * environment and lights are weighted against what light sampling from the ray's origin finds.
 */
void pen_direct_seen(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct pen_gathered *sum);

#endif
