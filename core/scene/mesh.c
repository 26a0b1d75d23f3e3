/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/mesh.h"

#include "core/scene/check.h"

static const struct pen_range coordinates = {-PEN_COORDINATE_MAX, PEN_COORDINATE_MAX};

/* Points of so many coordinates each; NULL for none, and after an offence. */
static float *read_points(struct pen_reader *reader, const struct pen_place *at,
	const json_t *value, size_t dimensions)
{
	size_t count = json_array_size(value), found = reader->found;
	double point[3];
	float *points;

	if (!json_is_array(value)) {
		pen_reader_refuse(
			reader, at, "must be an array of arrays of %zu numbers", dimensions);
		return NULL;
	}
	points = pen_reader_alloc(reader, count, dimensions * sizeof *points);
	for (size_t i = 0; points && i < count; i++) {
		struct pen_place element = pen_place_element(at, i);

		if (!pen_vector_read(reader, &element, json_array_get(value, i), dimensions,
			    coordinates, point))
			continue;
		for (size_t j = 0; j < dimensions; j++)
			points[i * dimensions + j] = (float)point[j];
	}
	return count > 0 && reader->found == found ? points : NULL;
}

/* As read_points; the vertices of one mesh are equally many wherever they stand. */
static float *read_vertices(struct pen_reader *reader, const struct pen_place *at,
	const json_t *value, struct pen_object_desc *mesh)
{
	float *vertices = read_points(reader, at, value, 3);
	uint32_t count = (uint32_t)json_array_size(value);

	if (json_is_array(value) && count == 0)
		pen_reader_refuse(reader, at, "must not be empty");
	else if (vertices && mesh->u.mesh.vertex_count > 0 && count != mesh->u.mesh.vertex_count)
		pen_reader_refuse(reader, at, "must hold %u vertices, as elsewhere in this mesh",
			mesh->u.mesh.vertex_count);
	else if (vertices)
		mesh->u.mesh.vertex_count = count;
	return vertices;
}

void pen_mesh_read_vertices(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object)
{
	struct pen_object_desc *mesh = object;

	mesh->u.mesh.vertices = read_vertices(reader, at, value, mesh);
}

/* One element of vertices_at while it is read. */
struct mesh_key_reading {
	struct pen_mesh_key key;
	struct pen_object_desc *mesh;
};

static void read_key_vertices(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	struct mesh_key_reading *reading = desc;

	reading->key.vertices = read_vertices(reader, at, value, reading->mesh);
}

static const struct pen_range instants = {-PEN_TIME_MAX, PEN_TIME_MAX};
static const struct pen_field mesh_key_fields[] = {
	{.key = "time",
		.kind = PEN_KIND_NUMBER,
		.offset = offsetof(struct mesh_key_reading, key.time),
		.range = &instants,
		.fallback = PEN_REQUIRED},
	{.key = "vertices",
		.kind = PEN_KIND_READ,
		.fallback = PEN_REQUIRED,
		.read = read_key_vertices},
	{0},
};
static const struct pen_table mesh_key_table = {mesh_key_fields, NULL};

void pen_mesh_read_keys(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object)
{
	struct pen_object_desc *mesh = object;
	struct mesh_key_reading reading = {.mesh = mesh};
	size_t count = json_array_size(value), found = reader->found;
	struct pen_mesh_key *keys;

	if (!json_is_array(value) || count > PEN_KEYFRAMES_MAX) {
		pen_reader_refuse(
			reader, at, "must be an array of at most %u objects", PEN_KEYFRAMES_MAX);
		return;
	}
	keys = pen_reader_alloc(reader, count, sizeof *keys);
	for (size_t i = 0; keys && i < count; i++) {
		struct pen_place element = pen_place_element(at, i);

		pen_table_read(
			reader, &element, json_array_get(value, i), &mesh_key_table, &reading);
		keys[i] = reading.key;
	}
	if (!keys || count == 0 || reader->found != found)
		return;
	mesh->u.mesh.keys = keys;
	mesh->u.mesh.key_count = (uint32_t)count;
	pen_check_times(reader, at, value, keys, sizeof *keys);
}

void pen_mesh_read_indices(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object)
{
	struct pen_object_desc *mesh = object;
	size_t count = json_array_size(value);
	uint32_t *indices;

	if (!json_is_array(value) || count == 0 || count % 3 != 0) {
		pen_reader_refuse(
			reader, at, "must be an array of vertex numbers, three for each triangle");
		return;
	}
	indices = pen_reader_alloc(reader, count, sizeof *indices);
	for (size_t i = 0; indices && i < count; i++) {
		struct pen_place element = pen_place_element(at, i);

		(void)pen_integer_read(reader, &element, json_array_get(value, i),
			(struct pen_range){0, PEN_SCENE_NODES_MAX}, &indices[i]);
	}
	mesh->u.mesh.indices = indices;
	mesh->u.mesh.triangle_count = (uint32_t)(count / 3);
}

void pen_mesh_read_normals(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object)
{
	struct pen_object_desc *mesh = object;
	float *normals = read_points(reader, at, value, 3);

	for (size_t i = 0; normals && i < json_array_size(value); i++) {
		const float *n = &normals[3 * i];
		struct pen_place element = pen_place_element(at, i);

		if (n[0] == 0 && n[1] == 0 && n[2] == 0)
			pen_reader_refuse(reader, &element, "must not be zero");
	}
	mesh->u.mesh.normals = normals;
}

void pen_mesh_read_uvs(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *object)
{
	struct pen_object_desc *mesh = object;

	mesh->u.mesh.uvs = read_points(reader, at, value, 2);
}

/* An array that belongs to the vertices has as many elements, or none. */
static void check_count(struct pen_reader *reader, const struct pen_place *at, json_t *mesh,
	const char *key, uint32_t vertex_count)
{
	size_t count = json_array_size(json_object_get(mesh, key));
	struct pen_place place;

	if (count == 0 || count == vertex_count)
		return;
	place = pen_place_member(at, mesh, key);
	pen_reader_refuse(
		reader, &place, "must have one element for each of the %u vertices", vertex_count);
}

static void check_indices(struct pen_reader *reader, const struct pen_place *at, json_t *mesh,
	const struct pen_object_desc *desc)
{
	struct pen_place indices = pen_place_member(at, mesh, "indices");

	for (size_t i = 0; i < 3 * (size_t)desc->u.mesh.triangle_count; i++) {
		struct pen_place element = pen_place_element(&indices, i);

		if (desc->u.mesh.indices[i] >= desc->u.mesh.vertex_count)
			pen_reader_refuse(reader, &element,
				"must be less than the number of vertices, %u",
				desc->u.mesh.vertex_count);
	}
}

void pen_mesh_check(
	struct pen_reader *reader, const struct pen_place *at, json_t *mesh, void *object)
{
	struct pen_object_desc *desc = object;
	struct pen_place vertices = pen_place_member(at, mesh, "vertices");

	if (desc->u.mesh.key_count > 0)
		desc->u.mesh.vertices = desc->u.mesh.keys[0].vertices;
	if (!desc->u.mesh.vertices) {
		pen_reader_refuse(reader, &vertices, "is missing, and so is vertices_at");
		return;
	}
	check_indices(reader, at, mesh, desc);
	check_count(reader, at, mesh, "normals", desc->u.mesh.vertex_count);
	check_count(reader, at, mesh, "uvs", desc->u.mesh.vertex_count);
	pen_check_object(reader, at, mesh, object);
}
