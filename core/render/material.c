/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/material.h"

static void init_input(struct pen_texture *to, const struct pen_input_desc *from,
	const struct pen_scene *scene, const struct pen_pictures *pictures)
{
	const struct pen_texture_desc *texture;

	if (!pictures || from->texture >= scene->texture_count)
		return;
	texture = &scene->textures[from->texture];
	to->mipmap = pen_pictures_texture(pictures, from->texture);
	to->wrap_u = texture->wrap_u;
	to->wrap_v = texture->wrap_v;
	to->is_nearest = texture->is_nearest;
	to->is_encoded = texture->is_encoded;
	to->channel = from->channel;
	to->uv_set = from->uv_set;
	for (int i = 0; i < 2; i++)
		for (int j = 0; j < 3; j++)
			to->uv[i][j] = (float)from->uv[i][j];
}

static void load3(float to[3], const double from[3])
{
	for (int i = 0; i < 3; i++)
		to[i] = (float)from[i];
}

void pen_material_init(struct pen_material *material, const struct pen_scene *scene, uint32_t index,
	const struct pen_pictures *pictures)
{
	const struct pen_material_desc *desc = &scene->materials[index];
	const double f = (desc->ior - 1.0) / (desc->ior + 1.0);

	*material = (struct pen_material){
		.is_principled = desc->type == PEN_MATERIAL_PRINCIPLED,
		.is_additive = desc->is_additive,
		.is_unlit = desc->type == PEN_MATERIAL_PRINCIPLED && desc->is_unlit,
		.opacity = (float)desc->opacity,
		.roughness = (float)desc->roughness,
		.ior = (float)desc->ior,
		.f0 = (float)(f * f),
		.metallic = (float)desc->metallic,
		.transmission = (float)desc->transmission,
		.clearcoat = (float)desc->clearcoat,
		.clearcoat_roughness = (float)desc->clearcoat_roughness,
		.normal_scale = (float)desc->normal_scale,
		.clearcoat_normal_scale = (float)desc->clearcoat_normal_scale,
		.alpha_mode = desc->alpha_mode,
		.alpha_cutoff = (float)desc->alpha_cutoff,
		.is_one_sided = desc->is_one_sided && !(desc->transmission > 0.0),
	};
	load3(material->color, desc->color);
	load3(material->emission, desc->emission);
	for (int i = 0; i < PEN_INPUT_COUNT; i++) {
		init_input(&material->inputs[i], &desc->inputs[i], scene, pictures);
		material->has_textures |= material->inputs[i].mipmap != NULL;
	}
}
