/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/layout.h"

#include "core/base/limits.h"

#define POOL_COUNT 11

static void list_pools(struct pen_layout *l, struct pen_buf *ret_pools[POOL_COUNT])
{
	struct pen_buf *const pools[POOL_COUNT] = {&l->vertices, &l->normals, &l->uvs, &l->colors,
		&l->tangents, &l->indices, &l->spheres, &l->disks, &l->placements, &l->models,
		&l->shapes};

	for (int i = 0; i < POOL_COUNT; i++)
		ret_pools[i] = pools[i];
}

void pen_layout_init(struct pen_layout *l, const struct pen_scene *scene, struct pen_error *err)
{
	struct pen_buf *pools[POOL_COUNT];

	*l = (struct pen_layout){
		.scene = scene,
		.shutter = {scene->camera.shutter_open, scene->camera.shutter_close},
		.err = err,
	};
	list_pools(l, pools);
	for (int i = 0; i < POOL_COUNT; i++)
		pen_buf_init(pools[i], PEN_GEOMETRY_BYTES_MAX);
}

void pen_layout_finish(struct pen_layout *l)
{
	struct pen_buf *pools[POOL_COUNT];

	list_pools(l, pools);
	for (int i = 0; i < POOL_COUNT; i++)
		pen_buf_finish(pools[i]);
}

void pen_layout_take(struct pen_layout *l, struct pen_geometry *ret_geometry)
{
	*ret_geometry = (struct pen_geometry){
		.model_count = pen_layout_count(&l->models, sizeof(struct pen_model)),
		.shape_count = pen_layout_count(&l->shapes, sizeof(struct pen_shape)),
	};
	ret_geometry->vertices = (float *)(void *)pen_buf_take(&l->vertices);
	ret_geometry->normals = (float *)(void *)pen_buf_take(&l->normals);
	ret_geometry->uvs = (float *)(void *)pen_buf_take(&l->uvs);
	ret_geometry->colors = (float *)(void *)pen_buf_take(&l->colors);
	ret_geometry->tangents = (float *)(void *)pen_buf_take(&l->tangents);
	ret_geometry->indices = (uint32_t *)(void *)pen_buf_take(&l->indices);
	ret_geometry->spheres = (struct pen_sphere *)(void *)pen_buf_take(&l->spheres);
	ret_geometry->disks = (struct pen_disk *)(void *)pen_buf_take(&l->disks);
	ret_geometry->placements = (struct pen_placement *)(void *)pen_buf_take(&l->placements);
	ret_geometry->models = (struct pen_model *)(void *)pen_buf_take(&l->models);
	ret_geometry->shapes = (struct pen_shape *)(void *)pen_buf_take(&l->shapes);
}

static void refuse(const struct pen_layout *l)
{
	(void)pen_error_set(
		l->err, PEN_ELIMIT, "the scene's geometry is too large for this machine");
}

uint32_t pen_layout_count(const struct pen_buf *pool, size_t size)
{
	return (uint32_t)(pool->size / size);
}

void *pen_layout_extend(struct pen_layout *l, struct pen_buf *pool, size_t count, size_t size)
{
	void *items = NULL;
	size_t bytes;

	if (!__builtin_mul_overflow(count, size, &bytes))
		items = pen_buf_reserve(pool, bytes);
	if (!items) {
		refuse(l);
		return NULL;
	}
	pool->size += bytes;
	return items;
}

int pen_layout_add_model(struct pen_layout *l, const struct pen_model *model, uint32_t *ret_model)
{
	struct pen_model *to = pen_layout_extend(l, &l->models, 1, sizeof *to);

	if (!to)
		return PEN_ELIMIT;
	*to = *model;
	*ret_model = pen_layout_count(&l->models, sizeof *to) - 1;
	return 0;
}

int pen_layout_add_shape(struct pen_layout *l, const struct pen_shape *shape)
{
	struct pen_shape *to = pen_layout_extend(l, &l->shapes, 1, sizeof *to);

	if (!to)
		return PEN_ELIMIT;
	*to = *shape;
	return 0;
}

int pen_layout_add_sphere(struct pen_layout *l, const double center[3], double radius)
{
	struct pen_sphere *sphere = pen_layout_extend(l, &l->spheres, 1, sizeof *sphere);

	if (!sphere)
		return PEN_ELIMIT;
	*sphere = (struct pen_sphere){
		(float)center[0], (float)center[1], (float)center[2], (float)radius};
	return 0;
}

int pen_layout_add_indices(struct pen_layout *l, const uint32_t *indices, uint32_t triangles,
	uint32_t vertex_first, bool mirrored)
{
	uint32_t *to = pen_layout_extend(l, &l->indices, triangles, 3 * sizeof *to);

	if (!to)
		return PEN_ELIMIT;
	for (uint32_t i = 0; i < triangles; i++, to += 3, indices += 3) {
		to[0] = vertex_first + indices[0];
		to[1] = vertex_first + indices[mirrored ? 2 : 1];
		to[2] = vertex_first + indices[mirrored ? 1 : 2];
	}
	return 0;
}
