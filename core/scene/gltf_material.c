/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_material.h"

#include "core/scene/gltf_accessor.h"
#include "core/scene/input.h"

#include <math.h>
#include <string.h>

/* What glTF numbers its samplers' choices by; every other wrap repeats. */
enum { WRAP_CLAMP = 33071, WRAP_MIRROR = 33648, FILTER_NEAREST = 9728 };

/* An error within a picture or texture is still shown at the material that uses it. */
static uint32_t add_picture(struct pen_gltf_reading *r, int index)
{
	const struct pen_gltf_image *image;
	struct pen_picture_desc picture = {.pointer = r->pointer, .asset = r->asset->index};
	struct pen_gltf_bytes bytes;
	char place[sizeof r->place];
	const size_t part = r->part;

	if (index < 0 || (size_t)index >= r->model->image_count) {
		pen_gltf_refuse(r, "there is no image %d", index);
		return PEN_NO_INDEX;
	}
	image = &r->model->images[index];
	memcpy(place, r->place, sizeof place);
	pen_gltf_at(r, "image", (size_t)index, image->name);
	picture.place = pen_gltf_text(r, r->place);
	bytes = (struct pen_gltf_bytes){image->bytes, image->size, SIZE_MAX};
	if (image->view >= 0 && !pen_gltf_view_find(r, image->view, &bytes))
		bytes.size = 0;
	else if (bytes.size == 0)
		pen_gltf_refuse(r, "it holds no bytes");
	memcpy(r->place, place, sizeof place);
	r->part = part;
	if (bytes.size == 0)
		return PEN_NO_INDEX;
	picture.size = bytes.size;
	if (bytes.offset != SIZE_MAX) {
		picture.offset = bytes.offset;
	} else {
		void *copy = pen_gltf_alloc(r, bytes.size, 1);

		if (copy)
			memcpy(copy, bytes.bytes, bytes.size);
		picture.bytes = copy;
	}
	return pen_gltf_add(r, &r->pictures, &picture, sizeof picture, PEN_GLTF_TEXTURES_MAX);
}

static enum pen_wrap wrap_of(int wrap)
{
	return wrap == WRAP_CLAMP    ? PEN_WRAP_CLAMP
	       : wrap == WRAP_MIRROR ? PEN_WRAP_MIRROR
				     : PEN_WRAP_REPEAT;
}

/* The exporter of Blender 2.8 and 2.9 has versions 1, that of Blender 3 has 3. */
static bool is_of_blender_3(const struct pen_gltf_reading *r)
{
	static const char exporter[] = "Khronos glTF Blender I/O v";
	const size_t length = sizeof exporter - 1;
	const char *text = r->model->generator;

	return strncmp(text, exporter, length) == 0 &&
	       (text[length] == '1' || text[length] == '3') && text[length + 1] == '.';
}

static uint32_t find_texture(struct pen_gltf_reading *r, int index, bool is_srgb)
{
	const struct pen_gltf_texture *from;
	struct pen_texture_desc texture = {.is_srgb = is_srgb};
	uint32_t *known, *picture;

	if ((size_t)index >= r->model->texture_count) {
		pen_gltf_refuse(r, "there is no texture %d", index);
		return PEN_NO_INDEX;
	}
	from = &r->model->textures[index];
	known = &r->asset->textures[2 * (size_t)index + is_srgb];
	if (*known != PEN_NO_INDEX)
		return *known;
	if (from->image < 0) {
		pen_gltf_warn(r, "texture %d has no image that is read", index);
		return PEN_NO_INDEX;
	}
	if ((size_t)from->image < r->model->image_count) {
		picture = &r->asset->pictures[from->image];
		if (*picture == PEN_NO_INDEX)
			*picture = add_picture(r, from->image);
		texture.picture = *picture;
	} else {
		texture.picture = add_picture(r, from->image);
	}
	if (texture.picture == PEN_NO_INDEX)
		return PEN_NO_INDEX;
	texture.wrap_u = wrap_of(from->wrap_s);
	texture.wrap_v = wrap_of(from->wrap_t);
	texture.is_encoded = is_srgb && is_of_blender_3(r);
	texture.is_nearest = from->mag_filter == FILTER_NEAREST;
	*known = pen_gltf_add(r, &r->textures, &texture, sizeof texture, PEN_GLTF_TEXTURES_MAX);
	return *known;
}

/* KHR_texture_transform: translation * rotation * scale. */
static bool set_transform(
	struct pen_gltf_reading *r, const struct pen_gltf_texture_use *use, double ret_uv[2][3])
{
	double uv[2][3];

	pen_input_place(use->offset, use->rotation * (180.0 / M_PI), use->scale, uv);
	for (int i = 0; i < 6; i++) {
		if (fabs(uv[i / 3][i % 3]) <= PEN_SCALE_MAX)
			continue;
		pen_gltf_refuse(r, "its texture transform is not finite, or too large");
		return false;
	}
	memcpy(ret_uv, uv, sizeof uv);
	return true;
}

static void set_input(struct pen_gltf_reading *r, struct pen_material_desc *material,
	enum pen_input input, const struct pen_gltf_texture_use *use, uint32_t channel)
{
	const bool is_srgb = input == PEN_INPUT_COLOR || input == PEN_INPUT_EMISSION;
	struct pen_input_desc *to = &material->inputs[input];

	to->channel = channel;
	if (use->texture < 0)
		return;
	if (use->uv_set < 0 || use->uv_set > 1) {
		pen_gltf_warn(r, "only TEXCOORD_0 and TEXCOORD_1 are read: texture %d is left out",
			use->texture);
		return;
	}
	to->uv_set = (uint32_t)use->uv_set;
	if (set_transform(r, use, to->uv))
		to->texture = find_texture(r, use->texture, is_srgb);
}

static void set_inputs(struct pen_gltf_reading *r, const struct pen_gltf_material *from,
	struct pen_material_desc *to)
{
	set_input(r, to, PEN_INPUT_COLOR, &from->base_color_texture, 0);
	set_input(r, to, PEN_INPUT_METALLIC, &from->metallic_roughness_texture, 2);
	set_input(r, to, PEN_INPUT_ROUGHNESS, &from->metallic_roughness_texture, 1);
	set_input(r, to, PEN_INPUT_NORMAL, &from->normal_texture, 0);
	set_input(r, to, PEN_INPUT_EMISSION, &from->emissive_texture, 0);
	set_input(r, to, PEN_INPUT_TRANSMISSION, &from->transmission_texture, 0);
	set_input(r, to, PEN_INPUT_CLEARCOAT, &from->clearcoat_texture, 0);
	set_input(r, to, PEN_INPUT_CLEARCOAT_ROUGHNESS, &from->clearcoat_roughness_texture, 1);
	set_input(r, to, PEN_INPUT_CLEARCOAT_NORMAL, &from->clearcoat_normal_texture, 0);
}

static double checked(
	struct pen_gltf_reading *r, const char *what, double value, double least, double most)
{
	if (value >= least && value <= most)
		return value;
	pen_gltf_refuse(r, "%s must be from %g to %g", what, least, most);
	return least;
}

/*
 * KHR_materials_specular as an index that returns as much light head-on. Where light goes through,
 * the index has its own to do; colours count by their mean.
 */
static double index_of(struct pen_gltf_reading *r, const struct pen_gltf_material *from, double ior)
{
	const double f = (ior - 1.0) / (ior + 1.0);
	const double factor = checked(r, "specularFactor", from->specular, 0.0, 1.0);
	const double *color = from->specular_color;
	double returned = 0.0, root;

	for (size_t i = 0; i < 3; i++) {
		const double part =
			checked(r, "specularColorFactor", color[i], 0.0, PEN_COORDINATE_MAX);

		returned += factor * fmin(f * f * part, 1.0) / 3.0;
	}
	if (from->specular_texture.texture >= 0 || from->specular_color_texture.texture >= 0)
		pen_gltf_warn(r, "the textures of KHR_materials_specular are left out");
	if (fabs(returned - f * f) < 1e-9)
		return ior;
	if (from->transmission > 0.0) {
		pen_gltf_warn(r, "KHR_materials_specular is left out where light goes through");
		return ior;
	}
	if (color[0] != color[1] || color[1] != color[2])
		pen_gltf_warn(r, "the color of KHR_materials_specular counts by its mean");
	root = sqrt(returned);
	return fmin((1.0 + root) / fmax(1.0 - root, 1e-6), 1000.0);
}

static void set_numbers(struct pen_gltf_reading *r, const struct pen_gltf_material *from,
	struct pen_material_desc *to)
{
	const double strength =
		checked(r, "emissiveStrength", from->emissive_strength, 0.0, PEN_COORDINATE_MAX);

	for (size_t i = 0; i < 3; i++) {
		to->color[i] = checked(r, "baseColorFactor", from->base_color.items[i], 0.0, 1.0);
		to->emission[i] = strength * checked(r, "emissiveFactor", from->emissive.items[i],
						     0.0, PEN_COORDINATE_MAX);
	}
	to->opacity = checked(r, "baseColorFactor", from->base_color.items[3], 0.0, 1.0);
	to->metallic = checked(r, "metallicFactor", from->metallic, 0.0, 1.0);
	to->roughness = checked(r, "roughnessFactor", from->roughness, 0.0, 1.0);
	/* An ior of 0 asks for a Fresnel term of 1: as good as infinite. */
	to->ior = from->ior == 0.0 ? 1000.0 : checked(r, "ior", from->ior, 1.0, 1000.0);
	to->ior = index_of(r, from, to->ior);
	to->transmission = checked(r, "transmissionFactor", from->transmission, 0.0, 1.0);
	to->clearcoat = checked(r, "clearcoatFactor", from->clearcoat, 0.0, 1.0);
	to->clearcoat_roughness =
		checked(r, "clearcoatRoughnessFactor", from->clearcoat_roughness, 0.0, 1.0);
	to->alpha_cutoff = checked(r, "alphaCutoff", from->alpha_cutoff, 0.0, PEN_SCALE_MAX);
	to->normal_scale = checked(r, "scale", from->normal_scale, -PEN_SCALE_MAX, PEN_SCALE_MAX);
	to->clearcoat_normal_scale =
		checked(r, "scale", from->clearcoat_normal_scale, -PEN_SCALE_MAX, PEN_SCALE_MAX);
}

static enum pen_alpha_mode alpha_mode_of(
	struct pen_gltf_reading *r, const struct pen_gltf_material *from)
{
	if (strcmp(from->alpha_mode, "MASK") == 0)
		return PEN_ALPHA_MASK;
	if (strcmp(from->alpha_mode, "BLEND") == 0)
		return PEN_ALPHA_BLEND;
	if (strcmp(from->alpha_mode, "OPAQUE") != 0)
		pen_gltf_refuse(r, "alphaMode must be OPAQUE, MASK or BLEND");
	return PEN_ALPHA_OPAQUE;
}

static uint32_t add_material(struct pen_gltf_reading *r, const struct pen_gltf_material *from)
{
	struct pen_material_desc to = pen_blank_material;

	if (from->base_color.count != 4 || from->emissive.count != 3) {
		pen_gltf_refuse(r, "baseColorFactor has 4 numbers, and emissiveFactor 3");
		return PEN_NO_INDEX;
	}
	to.name = pen_gltf_text(r, from->name);
	to.type = PEN_MATERIAL_PRINCIPLED;
	to.is_one_sided = !from->is_double_sided;
	to.is_unlit = from->is_unlit;
	to.is_additive = is_of_blender_3(r);
	set_numbers(r, from, &to);
	to.alpha_mode = alpha_mode_of(r, from);
	set_inputs(r, from, &to);
	return pen_gltf_add(r, &r->materials, &to, sizeof to, PEN_MATERIALS_MAX);
}

static uint32_t add_default_material(struct pen_gltf_reading *r)
{
	struct pen_material_desc to = pen_blank_material;

	if (is_of_blender_3(r)) {
		to.name = "Blender's default material";
		to.type = PEN_MATERIAL_MATTE;
		to.color[0] = to.color[1] = to.color[2] = 0.8;
		return pen_gltf_add(r, &r->materials, &to, sizeof to, PEN_MATERIALS_MAX);
	}
	to.name = "glTF's default material";
	to.type = PEN_MATERIAL_PRINCIPLED;
	to.color[0] = to.color[1] = to.color[2] = 1.0;
	to.metallic = to.roughness = 1.0;
	to.is_one_sided = true;
	return pen_gltf_add(r, &r->materials, &to, sizeof to, PEN_MATERIALS_MAX);
}

uint32_t pen_gltf_material(struct pen_gltf_reading *r, int index)
{
	const size_t count = r->model->material_count;
	uint32_t *known;
	char place[sizeof r->place];
	const size_t part = r->part;

	if (index >= 0 && (size_t)index >= count) {
		pen_gltf_refuse(r, "there is no material %d", index);
		return PEN_NO_INDEX;
	}
	known = &r->asset->materials[index < 0 ? count : (size_t)index];
	if (*known != PEN_NO_INDEX)
		return *known;
	memcpy(place, r->place, sizeof place);
	if (index >= 0) {
		pen_gltf_at(r, "material", (size_t)index, r->model->materials[index].name);
		*known = add_material(r, &r->model->materials[index]);
	} else {
		*known = add_default_material(r);
	}
	memcpy(r->place, place, sizeof place);
	r->part = part;
	return *known;
}
