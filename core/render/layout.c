/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/layout.h"

#include "core/base/limits.h"

#include <stdlib.h>
#include <string.h>

static void list_pools(struct pen_layout *l, struct pen_buf *ret_pools[PEN_LAYOUT_POOLS])
{
	struct pen_buf *const pools[PEN_LAYOUT_POOLS] = {&l->vertices, &l->normals, &l->uvs,
		&l->colors, &l->tangents, &l->indices, &l->spheres, &l->disks, &l->placements,
		&l->models, &l->shapes};

	for (int i = 0; i < PEN_LAYOUT_POOLS; i++)
		ret_pools[i] = pools[i];
}

int pen_layout_init(
	struct pen_layout *l, const struct pen_scene *scene, uint32_t frame, struct pen_error *err)
{
	const size_t objects = scene->object_count + 1ul;
	struct pen_buf *pools[PEN_LAYOUT_POOLS];

	*l = (struct pen_layout){
		.scene = scene,
		.shutter = pen_shutter_of(scene, frame),
		.own_models = malloc(objects * sizeof *l->own_models),
		.boxes = calloc(objects, sizeof *l->boxes),
		.err = err,
	};
	list_pools(l, pools);
	for (int i = 0; i < PEN_LAYOUT_POOLS; i++)
		pen_buf_init(pools[i], PEN_GEOMETRY_BYTES_MAX);
	if (!l->own_models || !l->boxes)
		return pen_error_memory(err);
	memset(l->own_models, 0xff, objects * sizeof *l->own_models);
	return 0;
}

void pen_layout_finish(struct pen_layout *l)
{
	struct pen_buf *pools[PEN_LAYOUT_POOLS];

	list_pools(l, pools);
	for (int i = 0; i < PEN_LAYOUT_POOLS; i++)
		pen_buf_finish(pools[i]);
	free(l->own_models);
	free(l->boxes);
	l->own_models = NULL;
	l->boxes = NULL;
}

struct pen_geometry pen_layout_view(const struct pen_layout *l)
{
	return (struct pen_geometry){
		.vertices = (float *)(void *)l->vertices.data,
		.normals = (float *)(void *)l->normals.data,
		.uvs = (float *)(void *)l->uvs.data,
		.colors = (float *)(void *)l->colors.data,
		.tangents = (float *)(void *)l->tangents.data,
		.indices = (uint32_t *)(void *)l->indices.data,
		.spheres = (struct pen_sphere *)(void *)l->spheres.data,
		.disks = (struct pen_disk *)(void *)l->disks.data,
		.placements = (struct pen_placement *)(void *)l->placements.data,
		.models = (struct pen_model *)(void *)l->models.data,
		.shapes = (struct pen_shape *)(void *)l->shapes.data,
		.model_count = pen_layout_count(&l->models, sizeof(struct pen_model)),
		.shape_count = pen_layout_count(&l->shapes, sizeof(struct pen_shape)),
	};
}

void pen_layout_take(struct pen_layout *l, struct pen_geometry *ret_geometry)
{
	struct pen_buf *pools[PEN_LAYOUT_POOLS];

	*ret_geometry = pen_layout_view(l);
	list_pools(l, pools);
	for (int i = 0; i < PEN_LAYOUT_POOLS; i++)
		(void)pen_buf_take(pools[i]);
}

struct pen_layout_mark pen_layout_mark(struct pen_layout *l)
{
	struct pen_buf *pools[PEN_LAYOUT_POOLS];
	struct pen_layout_mark mark;

	list_pools(l, pools);
	for (int i = 0; i < PEN_LAYOUT_POOLS; i++)
		mark.sizes[i] = pools[i]->size;
	return mark;
}

void pen_layout_rewind(struct pen_layout *l, const struct pen_layout_mark *mark)
{
	struct pen_buf *pools[PEN_LAYOUT_POOLS];

	list_pools(l, pools);
	for (int i = 0; i < PEN_LAYOUT_POOLS; i++)
		pools[i]->size = mark->sizes[i];
	pen_layout_forget_models(l, pen_layout_count(&l->models, sizeof(struct pen_model)));
}

void pen_layout_forget_models(struct pen_layout *l, uint32_t first)
{
	for (uint32_t i = 0; i < l->scene->object_count; i++)
		if (l->own_models[i] >= first)
			l->own_models[i] = PEN_NO_INDEX;
}

size_t pen_layout_bytes(struct pen_layout *l)
{
	const struct pen_layout_mark mark = pen_layout_mark(l);
	size_t bytes = 0;

	for (int i = 0; i < PEN_LAYOUT_POOLS; i++)
		bytes += mark.sizes[i];
	return bytes;
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

/* Transparent, or seen from its front only; what light is to go into has a back all the same. */
static bool lets_pass(const struct pen_scene *scene, uint32_t surface)
{
	const struct pen_material_desc *material = &scene->materials[surface];

	return surface < scene->material_count && material->type == PEN_MATERIAL_PRINCIPLED &&
	       (material->alpha_mode != PEN_ALPHA_OPAQUE ||
		       (material->is_one_sided && !(material->transmission > 0.0)));
}

int pen_layout_add_shape(struct pen_layout *l, const struct pen_shape *shape)
{
	struct pen_shape *to = pen_layout_extend(l, &l->shapes, 1, sizeof *to);

	if (!to)
		return PEN_ELIMIT;
	*to = *shape;
	to->lets_pass = lets_pass(l->scene, shape->surface);
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
