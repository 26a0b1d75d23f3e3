/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_IMAGE_TONEMAP_H
#define PEN_IMAGE_TONEMAP_H

#include <stddef.h>
#include <stdint.h>

/*
 * Linear light to 8-bit sRGB (IEC 61966-2-1): times 2^exposure, clamped to 0..1, transfer curve,
 * rounded to the nearest code. NaN is black.
 */
struct pen_tonemap {
	float scale;
	float limits[256];    /* code k ends below limits[k]; the last is infinite */
	uint8_t starts[4096]; /* the code at which the search for a value of this cell begins */
};

/* Linear light, 0..1, of an encoded value in 0..1. */
double pen_srgb_decode(double encoded);

void pen_tonemap_init(struct pen_tonemap *tonemap, double exposure);

/* No light: the nearest code of a value clamped to 0..1. */
void pen_tonemap_init_plain(struct pen_tonemap *tonemap);

uint8_t pen_tonemap_value(const struct pen_tonemap *tonemap, float linear);

/* count pixels of R, G, B, A; ret_pixels gets channels (3 or 4) bytes each, the fourth 255 where A
 * > 0. */
void pen_tonemap_row(const struct pen_tonemap *tonemap, const float *rgba, size_t count,
	unsigned channels, uint8_t *ret_pixels);

#endif
