/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/layer.h"

#include <string.h>

static const struct {
	const char *name;
	uint32_t channels;
} layers[PEN_LAYERS] = {
	[PEN_LAYER_COLOR] = {"color", 4},
	[PEN_LAYER_ALBEDO] = {"albedo", 3},
	[PEN_LAYER_NORMAL] = {"normal", 3},
	[PEN_LAYER_DEPTH] = {"depth", 1},
	[PEN_LAYER_SAMPLES] = {"samples", 1},
};

const char *pen_layer_name(enum pen_layer layer)
{
	return layers[layer].name;
}

uint32_t pen_layer_channels(enum pen_layer layer)
{
	return layers[layer].channels;
}

bool pen_layer_parse(const char *text, enum pen_layer *ret_layer)
{
	for (unsigned i = 0; i < PEN_LAYERS; i++) {
		if (strcmp(text, layers[i].name) == 0) {
			*ret_layer = (enum pen_layer)i;
			return true;
		}
	}
	return false;
}
