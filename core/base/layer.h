/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_LAYER_H
#define PEN_BASE_LAYER_H

#include <stdbool.h>
#include <stdint.h>

/* What an image shows of each pixel. The colour is always there, the others as the scene asks. */
enum pen_layer {
	PEN_LAYER_COLOR,   /* linear red, green, blue, and alpha: 1 where rendered */
	PEN_LAYER_ALBEDO,  /* red, green, blue of first hits, black where nothing is; mean */
	PEN_LAYER_NORMAL,  /* of first hits, world space, 0 where nothing is; mean */
	PEN_LAYER_DEPTH,   /* of first hits along the view axis, mean over them; +inf without any */
	PEN_LAYER_SAMPLES, /* how many went into the pixel */
};

enum { PEN_LAYERS = PEN_LAYER_SAMPLES + 1, PEN_LAYER_CHANNELS_MAX = 4 + 3 + 3 + 1 + 1 };

/* "color", "albedo", "normal", "depth", "samples". */
const char *pen_layer_name(enum pen_layer layer);

/* How many values a pixel of it has. */
uint32_t pen_layer_channels(enum pen_layer layer);

bool pen_layer_parse(const char *text, enum pen_layer *ret_layer);

#endif
