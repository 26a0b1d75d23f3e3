/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_ADMIT_H
#define PEN_RENDER_ADMIT_H

#include "core/render/packet.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * The lanes to trace. Parked ones are marked, and whatever Embree would abort at (a value that is
 * not finite or beyond 1e18) is parked: with instruction sets below AVX-512 it looks at every lane,
 * marked or not. Returns how many of those there were.
 */
uint32_t pen_admit_rays(struct pen_rays *rays, int32_t ret_valid[PEN_LANES]);

/* A box that tells which rays need not ask a tree. */
struct pen_admit_box {
	float lower[3], upper[3];
};

/* The box of a tree's bounds, wider by more than the rounding of any test of a ray and a box. */
void pen_admit_box_init(struct pen_admit_box *box, const float lower[3], const float upper[3]);

/* False only when no ray passes through the box between its tnear and its tfar. */
bool pen_admit_box_met(const struct pen_admit_box *box, const struct pen_rays *rays);

#endif
