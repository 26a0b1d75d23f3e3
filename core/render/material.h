/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_MATERIAL_H
#define PEN_RENDER_MATERIAL_H

#include "core/render/pictures.h"
#include "core/render/texture.h"
#include "core/scene/desc.h"

#include <stdbool.h>
#include <stdint.h>

/* A material whose inputs are found for each hit by itself: see core/render/detail.h. */
struct pen_material {
	bool is_principled, is_additive, is_unlit;
	float color[3], opacity;
	float roughness, ior, f0;
	float metallic, transmission;
	float clearcoat, clearcoat_roughness;
	float emission[3];
	float normal_scale, clearcoat_normal_scale;
	enum pen_alpha_mode alpha_mode;
	float alpha_cutoff;
	bool is_one_sided;
	bool has_textures;
	struct pen_texture inputs[PEN_INPUT_COUNT];
};

/* pictures may be NULL for a material without textures. */
void pen_material_init(struct pen_material *material, const struct pen_scene *scene, uint32_t index,
	const struct pen_pictures *pictures);

#endif
