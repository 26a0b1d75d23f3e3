/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/format.h"

#include "core/scene/asset.h"
#include "core/scene/input.h"
#include "core/scene/row.h"

#include <stdlib.h>
#include <string.h>

static const struct pen_range pen_range_refraction = {0.1, 10};

/* Textures */

static void read_color_space(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	const char *name = json_string_value(value);
	bool *is_srgb = desc;

	if (name && (strcmp(name, "srgb") == 0 || strcmp(name, "linear") == 0))
		*is_srgb = name[0] == 's';
	else
		pen_reader_refuse(reader, at, "must be one of srgb, linear");
}

static const struct pen_variant wraps[] = {
	{"repeat", PEN_WRAP_REPEAT, NULL},
	{"mirror", PEN_WRAP_MIRROR, NULL},
	{"clamp", PEN_WRAP_CLAMP, NULL},
	{0},
};
static const struct pen_field texture_fields[] = {
	{READ("image", OF(texture_desc, picture), pen_picture_read, PEN_REQUIRED)},
	{READ("color_space", OF(texture_desc, is_srgb), read_color_space, "\"srgb\"")},
	{CHOICE("wrap_u", texture_desc, wrap_u, wraps, "\"repeat\"")},
	{CHOICE("wrap_v", texture_desc, wrap_v, wraps, "\"repeat\"")},
	{0},
};
static const struct pen_table texture_table = {texture_fields, NULL};

static int by_texture_name(const void *a, const void *b)
{
	return strcmp(((const struct pen_texture_desc *)a)->name,
		((const struct pen_texture_desc *)b)->name);
}

/* Textures and materials stand sorted by name, so that the order of the text does not matter. */
void pen_format_read_textures(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	struct pen_scene *scene = desc;
	struct pen_texture_desc *textures;
	size_t count = json_object_size(value), i = 0;
	const char *name;
	json_t *element;

	if (!json_is_object(value) || count > PEN_TEXTURES_MAX) {
		pen_reader_refuse(
			reader, at, "must be an object of at most %u textures", PEN_TEXTURES_MAX);
		return;
	}
	textures = pen_reader_alloc(reader, count, sizeof *textures);
	if (!textures)
		return;
	json_object_foreach (value, name, element) {
		struct pen_place place = {at, name, i};

		textures[i].name = pen_reader_text(reader, name);
		textures[i].picture = PEN_NO_INDEX;
		if (!textures[i].name)
			return;
		pen_table_read(reader, &place, element, &texture_table, &textures[i]);
		i++;
	}
	qsort(textures, count, sizeof *textures, by_texture_name);
	scene->textures = textures;
	scene->texture_count = (uint32_t)count;
}

/* Materials */

static const struct pen_field matte_fields[] = {
	{READ("color", 0, pen_input_read, "[0.5, 0.5, 0.5]")},
	{0},
};
static const struct pen_field glossy_fields[] = {
	{READ("color", 0, pen_input_read, "[0.8, 0.8, 0.8]")},
	{NUMBER("roughness", material_desc, roughness, unit, "0.25")},
	{0},
};
static const struct pen_field glass_fields[] = {
	{VECTOR3("color", material_desc, color, unit, "[1, 1, 1]")},
	{NUMBER("ior", material_desc, ior, refraction, "1.5")},
	{NUMBER("roughness", material_desc, roughness, unit, "0")},
	{0},
};

static const struct pen_variant alpha_modes[] = {
	{"opaque", PEN_ALPHA_OPAQUE, NULL},
	{"mask", PEN_ALPHA_MASK, NULL},
	{"blend", PEN_ALPHA_BLEND, NULL},
	{0},
};

/* It multiplies the emission when all else is there. */
static void read_strength(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	double strength;

	(void)desc;
	(void)pen_number_read(reader, at, value, pen_range_magnitude, &strength);
}

static void read_double_sided(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	bool *is_one_sided = desc;

	if (json_is_boolean(value))
		*is_one_sided = json_is_false(value);
	else
		pen_reader_refuse(reader, at, "must be true or false");
}

static const struct pen_field principled_fields[] = {
	{READ("base_color", 0, pen_input_read, "[1, 1, 1]")},
	{READ("metallic", 0, pen_input_read, "0")},
	{READ("roughness", 0, pen_input_read, "0.5")},
	{NUMBER("ior", material_desc, ior, refraction, "1.5")},
	{READ("transmission", 0, pen_input_read, "0")},
	{READ("clearcoat", 0, pen_input_read, "0")},
	{READ("clearcoat_roughness", 0, pen_input_read, "0")},
	{READ("emission", 0, pen_input_read, "[0, 0, 0]")},
	{READ("emission_strength", 0, read_strength, "1")},
	{NUMBER("opacity", material_desc, opacity, unit, "1")},
	{CHOICE("alpha_mode", material_desc, alpha_mode, alpha_modes, PEN_ABSENT)},
	{NUMBER("alpha_cutoff", material_desc, alpha_cutoff, unit, "0.5")},
	{READ("normal", 0, pen_input_read, PEN_ABSENT)},
	{READ("clearcoat_normal", 0, pen_input_read, PEN_ABSENT)},
	{READ("double_sided", OF(material_desc, is_one_sided), read_double_sided, "true")},
	{BOOLEAN("unlit", material_desc, is_unlit, "false")},
	{0},
};

/* What is not quite there blends, unless the text says otherwise. */
static void complete_alpha_mode(
	struct pen_reader *reader, json_t *material, struct pen_material_desc *d)
{
	const bool blends = d->opacity < 1;

	if (json_object_get(material, "alpha_mode"))
		return;
	d->alpha_mode = blends ? PEN_ALPHA_BLEND : PEN_ALPHA_OPAQUE;
	pen_reader_fill(reader, material, "alpha_mode", json_string(blends ? "blend" : "opaque"));
}

static void check_principled(
	struct pen_reader *reader, const struct pen_place *at, json_t *material, void *desc)
{
	const double strength = json_number_value(json_object_get(material, "emission_strength"));
	struct pen_place place = pen_place_member(at, material, "emission_strength");
	struct pen_material_desc *d = desc;
	bool is_bounded = true;

	complete_alpha_mode(reader, material, d);
	for (size_t i = 0; i < 3; i++) {
		d->emission[i] *= strength;
		is_bounded &= d->emission[i] <= pen_range_magnitude.max;
	}
	if (!is_bounded)
		pen_reader_refuse(reader, &place, "must be less: the emission times it passes %g",
			pen_range_magnitude.max);
}

static const struct pen_table matte_table = {matte_fields, NULL};
static const struct pen_table glossy_table = {glossy_fields, NULL};
static const struct pen_table glass_table = {glass_fields, NULL};
static const struct pen_table principled_table = {principled_fields, check_principled};
static const struct pen_variant material_types[] = {
	{"matte", PEN_MATERIAL_MATTE, &matte_table},
	{"glossy", PEN_MATERIAL_GLOSSY, &glossy_table},
	{"glass", PEN_MATERIAL_GLASS, &glass_table},
	{"principled", PEN_MATERIAL_PRINCIPLED, &principled_table},
	{0},
};
static const struct pen_variants material = {
	"type", PEN_REQUIRED, OF(material_desc, type), material_types};

static int by_material_name(const void *a, const void *b)
{
	return strcmp(((const struct pen_material_desc *)a)->name,
		((const struct pen_material_desc *)b)->name);
}

void pen_format_read_materials(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	struct pen_scene *scene = desc;
	struct pen_material_desc *materials;
	size_t count = json_object_size(value), i = 0;
	const char *name;
	json_t *element;

	if (!json_is_object(value)) {
		pen_reader_refuse(reader, at, "must be an object");
		return;
	}
	/* One more than there are: the one of objects without a material. */
	materials = pen_reader_alloc(reader, count + 1, sizeof *materials);
	if (!materials)
		return;
	json_object_foreach (value, name, element) {
		struct pen_place place = {at, name, i};

		materials[i] = pen_blank_material;
		materials[i].name = pen_reader_text(reader, name);
		if (!materials[i].name)
			return;
		pen_variant_read(reader, &place, element, &material, &materials[i]);
		i++;
	}
	qsort(materials, count, sizeof *materials, by_material_name);
	scene->materials = materials;
	scene->material_count = (uint32_t)count;
}
