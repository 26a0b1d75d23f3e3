/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_LIGHT_CHOICE_H
#define PEN_RENDER_LIGHT_CHOICE_H

#include "core/base/error.h"

#include <stdint.h>

/*
 * One of many lights, with a probability in proportion to its power: an alias table (Walker 1974,
 * built as by Vose 1991), whose columns are equally likely and hold at most two lights each.
 */
struct pen_light_choice {
	uint32_t count;
	float *keep;	 /* chance to keep the column's own light */
	uint32_t *other; /* the column's second light */
	float *chance;	 /* of each light, over all columns */
};

/* powers: count > 0 finite numbers >= 0; all zero means equal chances. PEN_ENOMEM. */
int pen_light_choice_init(struct pen_light_choice *choice, const double *powers, uint32_t count,
	struct pen_error *err);
void pen_light_choice_finish(struct pen_light_choice *choice);

/* The light for (u, v) in [0,1); its probability is choice->chance[light]. */
static inline uint32_t pen_light_choose(const struct pen_light_choice *choice, float u, float v)
{
	const uint32_t column = (uint32_t)(u * (float)choice->count);

	return v < choice->keep[column] ? column : choice->other[column];
}

#endif
