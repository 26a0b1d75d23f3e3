/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/format.h"

#include "core/scene/check.h"
#include "core/scene/row.h"

static const struct pen_range pen_range_half_turn = {0, 180};
static const struct pen_range pen_range_cone = {0.01, 180};

static void read_corners(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	double(*vertices)[3] = desc;

	if (!json_is_array(value) || json_array_size(value) != 3) {
		pen_reader_refuse(reader, at, "must be an array of 3 points");
		return;
	}
	for (size_t i = 0; i < 3; i++) {
		struct pen_place element = pen_place_element(at, i);

		(void)pen_vector_read(reader, &element, json_array_get(value, i), 3,
			pen_range_world, vertices[i]);
	}
}

/* clang-format off */
#define AREA_ROWS \
	{VECTOR3("radiance", light_desc, color, magnitude, "[1, 1, 1]")}, \
	{BOOLEAN("visible", light_desc, visible, "true")}
/* clang-format on */

static const struct pen_field rectangle_fields[] = {
	AREA_ROWS,
	{VECTOR3("corner", light_desc, u.rectangle.corner, world, "[0, 0, 0]")},
	{VECTOR3("edge_u", light_desc, u.rectangle.edge_u, world, "[1, 0, 0]")},
	{VECTOR3("edge_v", light_desc, u.rectangle.edge_v, world, "[0, 0, 1]")},
	{0},
};
static const struct pen_field triangle_fields[] = {
	AREA_ROWS,
	{READ("vertices", OF(light_desc, u.triangle.vertices), read_corners,
		"[[0, 0, 0], [1, 0, 0], [0, 0, 1]]")},
	{0},
};
static const struct pen_field disk_fields[] = {
	AREA_ROWS,
	{VECTOR3("center", light_desc, u.disk.center, world, "[0, 0, 0]")},
	{VECTOR3("normal", light_desc, u.disk.normal, world, "[0, -1, 0]")},
	{NUMBER("radius", light_desc, u.disk.radius, positive, "1")},
	{0},
};
static const struct pen_field ball_fields[] = {
	AREA_ROWS,
	{VECTOR3("center", light_desc, u.sphere.center, world, "[0, 0, 0]")},
	{NUMBER("radius", light_desc, u.sphere.radius, positive, "1")},
	{0},
};
static const struct pen_field point_fields[] = {
	{VECTOR3("intensity", light_desc, color, magnitude, "[1, 1, 1]")},
	{VECTOR3("position", light_desc, u.point.position, world, "[0, 0, 0]")},
	{0},
};
static const struct pen_field spot_fields[] = {
	{VECTOR3("intensity", light_desc, color, magnitude, "[1, 1, 1]")},
	{VECTOR3("position", light_desc, u.spot.position, world, "[0, 0, 0]")},
	{VECTOR3("direction", light_desc, u.spot.direction, world, "[0, -1, 0]")},
	{NUMBER("cone_angle", light_desc, u.spot.cone_angle, cone, "30")},
	{NUMBER("blend", light_desc, u.spot.blend, unit, "0")},
	{0},
};
static const struct pen_field directional_fields[] = {
	{VECTOR3("irradiance", light_desc, color, magnitude, "[1, 1, 1]")},
	{VECTOR3("direction", light_desc, u.directional.direction, world, "[0, -1, 0]")},
	{NUMBER("angle", light_desc, u.directional.angle, half_turn, "0")},
	{0},
};
static const struct pen_table rectangle_table = {rectangle_fields, pen_check_rectangle};
static const struct pen_table triangle_table = {triangle_fields, pen_check_triangle};
static const struct pen_table disk_table = {disk_fields, pen_check_disk};
static const struct pen_table ball_table = {ball_fields, NULL};
static const struct pen_table point_table = {point_fields, NULL};
static const struct pen_table spot_table = {spot_fields, pen_check_spot};
static const struct pen_table directional_table = {directional_fields, pen_check_directional};
static const struct pen_variant light_types[] = {
	{"rectangle", PEN_LIGHT_RECTANGLE, &rectangle_table},
	{"triangle", PEN_LIGHT_TRIANGLE, &triangle_table},
	{"disk", PEN_LIGHT_DISK, &disk_table},
	{"sphere", PEN_LIGHT_SPHERE, &ball_table},
	{"point", PEN_LIGHT_POINT, &point_table},
	{"spot", PEN_LIGHT_SPOT, &spot_table},
	{"directional", PEN_LIGHT_DIRECTIONAL, &directional_table},
	{0},
};
static const struct pen_variants light = {"type", PEN_REQUIRED, OF(light_desc, type), light_types};
static const struct pen_light_desc blank = {.node = PEN_NO_INDEX};
const struct pen_list pen_format_lights = {sizeof(struct pen_light_desc), PEN_LIGHTS_MAX,
	OF(scene, light_count), NULL, &light, &blank};
