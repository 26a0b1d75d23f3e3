/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_FILM_H
#define PEN_BASE_FILM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * What is kept of each pixel, in tiles on the wire and in framebuffers: floats, all of them sums
 * over the samples so far, so that rounds are merged by addition. Red, green, blue and the count
 * of samples always; the planes below as the scene asks for them, in this order.
 */
enum pen_plane {
	PEN_PLANE_ALBEDO = 1 << 0, /* 3: red, green, blue of first hits */
	PEN_PLANE_NORMAL = 1 << 1, /* 3: of first hits, world space */
	PEN_PLANE_DEPTH = 1 << 2,  /* 2: along the view axis, over hits; the count of hits */
	PEN_PLANE_MOMENTS = 1 << 3 /* 3: of each whole aligned block of sixteen samples, the square
				      of half the difference between its halves' means, compressed
				      by v / (1 + v): sums are of the variance of a block's mean */
};

enum { PEN_CHANNEL_COUNT = 3, PEN_CHANNELS_MIN = 4, PEN_CHANNELS_MAX = 16 };

struct pen_film {
	uint32_t channels;			 /* of a pixel */
	uint32_t albedo, normal, depth, moments; /* first channel of each plane; 0: not there */
};

/* The film with these planes (enum pen_plane). */
static inline struct pen_film pen_film_of(uint32_t planes)
{
	struct pen_film film = {PEN_CHANNELS_MIN, 0, 0, 0, 0};

	if (planes & PEN_PLANE_ALBEDO) {
		film.albedo = film.channels;
		film.channels += 3;
	}
	if (planes & PEN_PLANE_NORMAL) {
		film.normal = film.channels;
		film.channels += 3;
	}
	if (planes & PEN_PLANE_DEPTH) {
		film.depth = film.channels;
		film.channels += 2;
	}
	if (planes & PEN_PLANE_MOMENTS) {
		film.moments = film.channels;
		film.channels += 3;
	}
	return film;
}

/* None of the values is infinite or not a number. */
bool pen_film_is_finite(const float *values, size_t count);

/* Adds count values to as many sums, which lie elsewhere. */
void pen_film_add(const float *values, size_t count, float *sums);

#endif
