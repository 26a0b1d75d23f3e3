/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SIEVE_H
#define PEN_RENDER_SIEVE_H

#include "core/render/vec.h"

#include <stdbool.h>
#include <stdint.h>

struct pen_pass;

/*
 * What decides whether a ray stops where it meets a surface that is transparent or seen from one
 * side only (struct pen_shape, lets_pass). Opacity is the chance to stop: the choice is a function
 * of the sample, the event and the primitive alone, so that it does not matter in which order, how
 * often and with which companions a ray is asked.
 */
struct pen_sieve {
	const struct pen_pass *pass;
	const uint32_t *key, *index; /* of the packet's samples */
	bool is_shadow; /* shadow rays and paths must not choose alike, for one follows the other */
};

/* Where a ray meets a shape. */
struct pen_meeting {
	int lane;
	uint32_t shape, primitive;
	float u, v;		/* barycentric */
	struct pen_vec3 normal; /* geometric, outwards, in the coordinates of the shape's model */
	bool behind;		/* the ray comes from behind the surface */
};

/* Whether the ray stops there. */
bool pen_sieve_stops(const struct pen_sieve *sieve, const struct pen_meeting *meeting);

#endif
