/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/surfaces.h"

#include "core/render/bsdf.h"
#include "core/render/closed.h"

#include <math.h>
#include <stdlib.h>

/* No sample stands for less than this share of a pixel: more would only cost. */
#define SAMPLE_SHARE_MIN 0.125f

static uint32_t kind_of(const struct pen_material_desc *material, bool is_whitted)
{
	const float alpha = is_whitted ? 0.0f : (float)(material->roughness * material->roughness);
	const bool varies = material->inputs[PEN_INPUT_ROUGHNESS].texture != PEN_NO_INDEX;

	switch (material->type) {
	case PEN_MATERIAL_MATTE: return PEN_KIND_MATTE;
	case PEN_MATERIAL_GLOSSY:
		return is_whitted || (alpha < PEN_ALPHA_MIN && !varies) ? PEN_KIND_MIRROR
									: PEN_KIND_GLOSSY;
	case PEN_MATERIAL_GLASS:
		return pen_glass_is_smooth(alpha, (float)material->ior) ? PEN_KIND_CLEAR
									: PEN_KIND_FROSTED;
	case PEN_MATERIAL_PRINCIPLED: break;
	}
	return material->is_unlit ? PEN_KIND_UNLIT : PEN_KIND_PRINCIPLED;
}

static bool glows(const struct pen_material_desc *material)
{
	const double *e = material->emission;

	return material->type == PEN_MATERIAL_PRINCIPLED &&
	       (material->is_unlit || e[0] > 0.0 || e[1] > 0.0 || e[2] > 0.0);
}

static struct pen_surface surface_of(
	const struct pen_render_scene *scene, uint32_t index, bool has_colors)
{
	const struct pen_scene *desc = scene->desc;
	const struct pen_material_desc *material = &desc->materials[index];
	const uint32_t kind = kind_of(material, desc->integrator.type == PEN_INTEGRATOR_WHITTED);
	const bool is_detailed = material->type == PEN_MATERIAL_PRINCIPLED || has_colors ||
				 scene->materials[index].has_textures;

	return (struct pen_surface){
		.kind = kind,
		.kinds = kind | (is_detailed ? PEN_KIND_DETAILED : 0u) |
			 (glows(material) ? PEN_KIND_GLOWING : 0u),
		.red = (float)material->color[0],
		.green = (float)material->color[1],
		.blue = (float)material->color[2],
		.alpha = (float)(material->roughness * material->roughness),
		.ior = (float)material->ior,
	};
}

/* Notes the materials of objects whose vertices have colours of their own. */
static void find_colored(const struct pen_scene *desc, bool *colored)
{
	for (uint32_t i = 0; i < desc->object_count; i++) {
		const struct pen_object_desc *object = &desc->objects[i];
		const struct pen_object_desc *of = object->type == PEN_OBJECT_INSTANCE
							   ? &desc->objects[object->u.instance.of]
							   : object;
		const uint32_t material =
			object->material != PEN_NO_INDEX ? object->material : of->material;

		if (of->type == PEN_OBJECT_MESH && of->u.mesh.colors &&
			material < desc->material_count)
			colored[material] = true;
	}
}

void pen_surfaces_set_share(struct pen_render_scene *scene)
{
	const float samples = (float)scene->desc->sampling.samples;

	scene->sample_share = fmaxf(1.0f / sqrtf(samples), SAMPLE_SHARE_MIN);
}

static int create_materials(struct pen_render_scene *scene, struct pen_error *err)
{
	const struct pen_scene *desc = scene->desc;
	bool has_principled = false;

	scene->materials = calloc(desc->material_count + 1ul, sizeof *scene->materials);
	if (!scene->materials)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < desc->material_count; i++) {
		pen_material_init(&scene->materials[i], desc, i, scene->pictures);
		scene->has_textures |= scene->materials[i].has_textures;
		has_principled |= scene->materials[i].is_principled;
	}
	pen_surfaces_set_share(scene);
	if (!has_principled)
		return 0;
	scene->albedo = malloc(sizeof *scene->albedo);
	if (!scene->albedo)
		return pen_error_memory(err);
	pen_albedo_init(scene->albedo);
	return 0;
}

static int create_surfaces(struct pen_render_scene *scene, struct pen_error *err)
{
	const struct pen_scene *desc = scene->desc;
	struct pen_surface *to = calloc(desc->material_count + desc->light_count + 1ul, sizeof *to);
	bool *colored = calloc(desc->material_count + 1ul, sizeof *colored);

	scene->surfaces = to;
	if (!to || !colored) {
		free(colored);
		return pen_error_memory(err);
	}
	find_colored(desc, colored);
	for (uint32_t i = 0; i < desc->material_count; i++)
		*to++ = surface_of(scene, i, colored[i]);
	for (uint32_t i = 0; i < desc->light_count; i++)
		*to++ = (struct pen_surface){
			.kind = PEN_KIND_LIGHT, .kinds = PEN_KIND_LIGHT, .light = i};
	to->kind = to->kinds = PEN_KIND_NOTHING;
	free(colored);
	return 0;
}

/* An index of refraction of 1 bends nothing: such a body is as good as thin. */
static bool may_be_solid(const struct pen_render_scene *scene, uint32_t surface)
{
	const struct pen_material *material = &scene->materials[surface];

	return surface < scene->desc->material_count && material->is_principled &&
	       material->transmission > 0.0f && fabsf(material->ior - 1.0f) > 1e-3f;
}

static int create_solids(struct pen_render_scene *scene, struct pen_error *err)
{
	const struct pen_geometry *geometry = &scene->geometry;
	int r = 0;

	scene->solids = calloc(geometry->shape_count + 1ul, sizeof *scene->solids);
	if (!scene->solids)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < geometry->shape_count && r == 0; i++) {
		const struct pen_shape *shape = &geometry->shapes[i];

		if (may_be_solid(scene, shape->surface))
			r = pen_closed(
				geometry, &geometry->models[shape->model], &scene->solids[i], err);
	}
	return r;
}

int pen_surfaces_create(struct pen_render_scene *scene, struct pen_error *err)
{
	int r = create_materials(scene, err);

	if (r == 0)
		r = create_surfaces(scene, err);
	if (r == 0)
		r = create_solids(scene, err);
	return r;
}

void pen_surfaces_destroy(struct pen_render_scene *scene)
{
	free(scene->solids);
	free(scene->surfaces);
	free(scene->materials);
	free(scene->albedo);
}
