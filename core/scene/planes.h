/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_PLANES_H
#define PEN_SCENE_PLANES_H

#include "core/base/film.h"
#include "core/base/layer.h"
#include "core/base/tile.h"
#include "core/scene/desc.h"

#include <assert.h>

/* The film's planes (enum pen_plane) for these layers (enum pen_aov), sampled in this way. */
static inline uint32_t pen_planes_of(uint32_t aovs, enum pen_sampling_mode mode)
{
	uint32_t planes = 0;

	if (aovs & PEN_AOV_ALBEDO)
		planes |= PEN_PLANE_ALBEDO;
	if (aovs & PEN_AOV_NORMAL)
		planes |= PEN_PLANE_NORMAL;
	if (aovs & PEN_AOV_DEPTH)
		planes |= PEN_PLANE_DEPTH;
	if (mode == PEN_SAMPLING_ADAPTIVE)
		planes |= PEN_PLANE_MOMENTS;
	return planes;
}

/* The layers (1 << enum pen_layer) of an image with these (enum pen_aov): the colour, and those. */
static inline uint32_t pen_layers_of(uint32_t aovs)
{
	static_assert(PEN_AOV_ALBEDO << 1 == 1 << PEN_LAYER_ALBEDO &&
			      PEN_AOV_NORMAL << 1 == 1 << PEN_LAYER_NORMAL &&
			      PEN_AOV_DEPTH << 1 == 1 << PEN_LAYER_DEPTH &&
			      PEN_AOV_SAMPLES << 1 == 1 << PEN_LAYER_SAMPLES,
		"in one order");
	return 1u << PEN_LAYER_COLOR | aovs << 1;
}

/* The rounds of an image that is sampled in this way. */
static inline struct pen_rounds pen_sampling_rounds(const struct pen_sampling_desc *sampling)
{
	enum pen_rounds_kind kind = PEN_ROUNDS_UNIFORM;

	if (sampling->mode == PEN_SAMPLING_ADAPTIVE)
		kind = PEN_ROUNDS_ADAPTIVE;
	if (sampling->mode == PEN_SAMPLING_EDGE)
		kind = PEN_ROUNDS_EDGE;
	return pen_rounds_of(kind, sampling->samples, sampling->min_samples);
}

/* The film of a scene's image. */
static inline struct pen_film pen_scene_film(const struct pen_scene *scene)
{
	return pen_film_of(pen_planes_of(scene->image.aovs, scene->sampling.mode));
}

#endif
