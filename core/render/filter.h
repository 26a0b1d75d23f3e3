/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_FILTER_H
#define PEN_RENDER_FILTER_H

#include "core/render/filter_table.h"
#include "core/scene/desc.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * The pixel filter, by importance (Ernst, Stamminger, Greiner 2006, "Filter importance sampling"):
 * a sample belongs to one pixel alone and lies about its centre with the filter's own density.
 * The filter is separable and even; |f| of one half axis is inverted by a table over the square
 * root of the mass that lies further out, in which even the tails are smooth.
 */
struct pen_filter {
	float offset[PEN_FILTER_CELLS + 2]; /* pixels; a guard behind the last */
	float radius;			    /* half the support, pixels */
	float norm;			    /* makes the integral of f over the half axis 1 */
	bool has_negative;		    /* mitchell: weights are f / density, else 1 */
};

void pen_filter_init(struct pen_filter *filter, const struct pen_image_desc *desc);

/*
 * n samples from (u, v) in [0,1): offsets from the pixel's centre in pixels, and weights of mean 1
 * by which a sample's radiance is multiplied.
 */
void pen_filter_sample(const struct pen_filter *filter, uint32_t n, const float *u, const float *v,
	float *ret_dx, float *ret_dy, float *ret_weight);

#endif
