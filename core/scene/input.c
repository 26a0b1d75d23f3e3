/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/input.h"

#include "core/scene/row.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* clang-format off */
#define NO_INPUT {.texture = PEN_NO_INDEX, .uv = {{1, 0, 0}, {0, 1, 0}}}
/* clang-format on */

const struct pen_material_desc pen_blank_material = {
	.ior = 1.5,
	.opacity = 1,
	.alpha_cutoff = 0.5,
	.normal_scale = 1,
	.clearcoat_normal_scale = 1,
	.inputs = {NO_INPUT, NO_INPUT, NO_INPUT, NO_INPUT, NO_INPUT, NO_INPUT, NO_INPUT, NO_INPUT,
		NO_INPUT},
};

/* What a texture reference says, before it is put into the material. */
struct reference {
	double factor[3];
	uint32_t channel, uv_set;
	double offset[2], rotation, scale[2];
};

enum value { VALUE_NUMBER, VALUE_REFLECTANCE, VALUE_RADIANCE, VALUE_NORMAL };

struct property {
	const char *key;
	enum pen_input input;
	enum value value;
	size_t offset;	     /* in the material, of one number or three */
	const char *channel; /* the default of a number's, as in glTF */
};

#define PROPERTY(key, input, value, member, channel)                                               \
	{                                                                                          \
		key, PEN_INPUT_##input, VALUE_##value, OF(material_desc, member), channel          \
	}

static const struct property properties[] = {
	PROPERTY("color", COLOR, REFLECTANCE, color, NULL),
	PROPERTY("base_color", COLOR, REFLECTANCE, color, NULL),
	PROPERTY("metallic", METALLIC, NUMBER, metallic, "b"),
	PROPERTY("roughness", ROUGHNESS, NUMBER, roughness, "g"),
	PROPERTY("normal", NORMAL, NORMAL, normal_scale, NULL),
	PROPERTY("emission", EMISSION, RADIANCE, emission, NULL),
	PROPERTY("transmission", TRANSMISSION, NUMBER, transmission, "r"),
	PROPERTY("clearcoat", CLEARCOAT, NUMBER, clearcoat, "r"),
	PROPERTY("clearcoat_roughness", CLEARCOAT_ROUGHNESS, NUMBER, clearcoat_roughness, "g"),
	PROPERTY("clearcoat_normal", CLEARCOAT_NORMAL, NORMAL, clearcoat_normal_scale, NULL),
};

enum { PROPERTIES = sizeof properties / sizeof *properties };

/* Where a texture lies on the surface. */

#define OF_REFERENCE(member) offsetof(struct reference, member)

static void read_pair(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	(void)pen_vector_read(reader, at, value, 2, pen_range_scale, desc);
}

static const struct pen_field transform_fields[] = {
	{READ("offset", OF_REFERENCE(offset), read_pair, "[0, 0]")},
	{ROW("rotation", NUMBER, OF_REFERENCE(rotation), "0"), .range = &pen_range_turn},
	{READ("scale", OF_REFERENCE(scale), read_pair, "[1, 1]")},
	{0},
};
static const struct pen_table transform_table = {transform_fields, NULL};

static const struct pen_range pen_range_uv_set = {0, 1};
static const struct pen_variant channels[] = {
	{"r", 0, NULL},
	{"g", 1, NULL},
	{"b", 2, NULL},
	{"a", 3, NULL},
	{0},
};

/* Names are resolved when all textures are known. */
static void read_texture_name(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	(void)desc;
	if (!json_is_string(value))
		pen_reader_refuse(reader, at, "must be a string");
}

/* clang-format off */
#define REFERENCE_ROWS \
	{READ("texture", 0, read_texture_name, PEN_REQUIRED)}, \
	{ROW("uv_set", INTEGER, OF_REFERENCE(uv_set), "0"), .range = &pen_range_uv_set}, \
	{TABLE("transform", 0, transform_table, "{}")}
/* clang-format on */

static const struct pen_field number_fields[] = {
	REFERENCE_ROWS,
	{ROW("factor", NUMBER, OF_REFERENCE(factor), "1"), .range = &pen_range_unit},
	{ROW("channel", CHOICE, OF_REFERENCE(channel), PEN_ABSENT), .choices = channels},
	{0},
};
static const struct pen_field reflectance_fields[] = {
	REFERENCE_ROWS,
	{ROW("factor", VECTOR3, OF_REFERENCE(factor), "[1, 1, 1]"), .range = &pen_range_unit},
	{0},
};
static const struct pen_field radiance_fields[] = {
	REFERENCE_ROWS,
	{ROW("factor", VECTOR3, OF_REFERENCE(factor), "[1, 1, 1]"), .range = &pen_range_magnitude},
	{0},
};
static const struct pen_field normal_fields[] = {
	REFERENCE_ROWS,
	{ROW("scale", NUMBER, OF_REFERENCE(factor), "1"), .range = &pen_range_scale},
	{0},
};
static const struct pen_table tables[] = {
	[VALUE_NUMBER] = {number_fields, NULL},
	[VALUE_REFLECTANCE] = {reflectance_fields, NULL},
	[VALUE_RADIANCE] = {radiance_fields, NULL},
	[VALUE_NORMAL] = {normal_fields, NULL},
};

/* Sine of 0 to 45 degrees and, an eighth of a turn on, cosine: Taylor's, below half an ulp. */
static double sine(double x)
{
	double term = x, sum = x;

	for (int n = 3; n <= 17; n += 2) {
		term *= -x * x / ((n - 1) * n);
		sum += term;
	}
	return sum;
}

static double cosine(double x)
{
	double term = 1, sum = 1;

	for (int n = 2; n <= 18; n += 2) {
		term *= -x * x / ((n - 1) * n);
		sum += term;
	}
	return sum;
}

/* Not libm's, whose last digits differ between machines; exact at quarter turns. */
static void turn(double degrees, double *ret_sine, double *ret_cosine)
{
	const double quarters = rint(degrees / 90);
	const double x = (degrees - 90 * quarters) * 0.017453292519943295;
	const double s = sine(x), c = cosine(x);
	const int quarter = (int)(quarters - 4 * floor(quarters / 4));

	*ret_sine = quarter == 0 ? s : quarter == 1 ? c : quarter == 2 ? -s : -c;
	*ret_cosine = quarter == 0 ? c : quarter == 1 ? -s : quarter == 2 ? -c : s;
}

void pen_input_place(
	const double offset[2], double degrees, const double scale[2], double ret_uv[2][3])
{
	double s, c;

	turn(degrees, &s, &c);
	ret_uv[0][0] = c * scale[0];
	ret_uv[0][1] = s * scale[1];
	ret_uv[0][2] = offset[0];
	ret_uv[1][0] = -s * scale[0];
	ret_uv[1][1] = c * scale[1];
	ret_uv[1][2] = offset[1];
}

/* Reading */

static const struct property *find_property(const char *key)
{
	const struct property *found = properties;

	while (strcmp(found->key, key) != 0)
		found++;
	return found;
}

static void read_reference(struct pen_reader *reader, const struct pen_place *at, json_t *value,
	const struct property *property, struct pen_material_desc *material)
{
	const bool is_single = property->value == VALUE_NUMBER || property->value == VALUE_NORMAL;
	struct pen_input_desc *input = &material->inputs[property->input];
	struct reference reference = {0};

	if (property->channel && !json_object_get(value, "channel"))
		pen_reader_fill(reader, value, "channel", json_string(property->channel));
	pen_table_read(reader, at, value, &tables[property->value], &reference);
	memcpy((char *)material + property->offset, reference.factor,
		(is_single ? 1 : 3) * sizeof(double));
	input->channel = reference.channel;
	input->uv_set = reference.uv_set;
	pen_input_place(reference.offset, reference.rotation, reference.scale, input->uv);
}

void pen_input_read(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	const struct property *property = find_property(at->key);
	double *number = (double *)(void *)((char *)desc + property->offset);

	if (json_is_object(value)) {
		read_reference(reader, at, value, property, desc);
		return;
	}
	switch (property->value) {
	case VALUE_NUMBER: (void)pen_number_read(reader, at, value, pen_range_unit, number); break;
	case VALUE_REFLECTANCE:
		(void)pen_vector_read(reader, at, value, 3, pen_range_unit, number);
		break;
	case VALUE_RADIANCE:
		(void)pen_vector_read(reader, at, value, 3, pen_range_magnitude, number);
		break;
	case VALUE_NORMAL:
		pen_reader_refuse(reader, at, "must be an object that names a texture");
		break;
	}
}

static int compare_name(const void *name, const void *texture)
{
	return strcmp(name, ((const struct pen_texture_desc *)texture)->name);
}

void pen_input_resolve(struct pen_reader *reader, const struct pen_place *at, json_t *material,
	struct pen_material_desc *desc)
{
	const struct pen_scene *scene = reader->scene;

	for (size_t i = 0; i < PROPERTIES; i++) {
		json_t *reference = json_object_get(material, properties[i].key);
		const char *name = json_string_value(json_object_get(reference, "texture"));
		const struct pen_texture_desc *found = NULL;
		struct pen_place outer, place;

		if (!name)
			continue;
		if (scene->texture_count > 0)
			found = bsearch(name, scene->textures, scene->texture_count, sizeof *found,
				compare_name);
		if (found) {
			desc->inputs[properties[i].input].texture =
				(uint32_t)(found - scene->textures);
			continue;
		}
		outer = pen_place_member(at, material, properties[i].key);
		place = pen_place_member(&outer, reference, "texture");
		pen_reader_refuse(reader, &place, "names no texture of this scene");
	}
}
