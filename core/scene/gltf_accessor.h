/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_ACCESSOR_H
#define PEN_SCENE_GLTF_ACCESSOR_H

#include "core/scene/gltf_reading.h"

/*
 * Reading accessors: nothing that an asset tells of its bytes is believed. Whatever lies outside
 * its view, its view outside its buffer, or is not finite, is refused at the reading's place.
 */

/* Of no fixed number of elements, or of no fixed width. */
#define PEN_GLTF_ANY SIZE_MAX

/*
 * The numbers of an accessor, width of them an element, as floats: of any component type,
 * normalised where the accessor says so. count: how many elements there must be. NULL after an
 * offence. The array may be shared with other readers.
 */
const float *pen_gltf_accessor_floats(
	struct pen_gltf_reading *r, int index, uint32_t width, size_t count, uint32_t *ret_count);

/* The same of unsigned integers. The array is the caller's. */
uint32_t *pen_gltf_accessor_integers(
	struct pen_gltf_reading *r, int index, uint32_t width, size_t count, uint32_t *ret_count);

/* How many components an element of an accessor has; 0: no such accessor. */
uint32_t pen_gltf_accessor_width(const struct pen_gltf_reading *r, int index);

/* The bytes of a buffer view; false after an offence. */
bool pen_gltf_view_find(struct pen_gltf_reading *r, int index, struct pen_gltf_bytes *ret_bytes);

#endif
