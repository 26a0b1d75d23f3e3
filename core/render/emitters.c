/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/emitters.h"

#include "core/base/limits.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Texels that a triangle's box may cover along an axis, of the level that is asked. */
enum { TEXELS_MAX = 6 };

static float luminance(float red, float green, float blue)
{
	return 0.2126f * red + 0.7152f * green + 0.0722f * blue;
}

static bool emits(const struct pen_material *material)
{
	const float *e = material->emission;

	return material->is_principled && !material->is_unlit &&
	       (e[0] > 0.0f || e[1] > 0.0f || e[2] > 0.0f);
}

/* Whether a shape's primitives are emitters, if nothing else makes them black. */
static bool shape_emits(const struct pen_render_scene *scene, const struct pen_shape *shape)
{
	const struct pen_model *model = &scene->geometry.models[shape->model];

	if (shape->surface >= scene->desc->material_count)
		return false;
	return emits(&scene->materials[shape->surface]) &&
	       (model->type == PEN_MODEL_TRIANGLES ||
		       (model->type == PEN_MODEL_SPHERES && shape->placement_count == 0));
}

/* A texel's place brought into the level. */
static uint32_t fold(int64_t at, uint32_t size, enum pen_wrap wrap)
{
	const int64_t n = (int64_t)size;
	int64_t k;

	switch (wrap) {
	case PEN_WRAP_REPEAT: return (uint32_t)(((at % n) + n) % n);
	case PEN_WRAP_MIRROR:
		k = ((at % (2 * n)) + 2 * n) % (2 * n);
		return (uint32_t)(k < n ? k : 2 * n - 1 - k);
	default: return (uint32_t)(at < 0 ? 0 : at >= n ? n - 1 : at);
	}
}

/* A box of texture coordinates. */
struct window {
	float lower[2], upper[2];
};

/* The texels that interpolation within a window may read, along an axis. */
static int64_t first_texel(const struct window *window, int axis, uint32_t size)
{
	return (int64_t)floorf(window->lower[axis] * (float)size - 0.5f);
}

static int64_t texel_count(const struct window *window, int axis, uint32_t size)
{
	return (int64_t)floorf(window->upper[axis] * (float)size + 0.5f) -
	       first_texel(window, axis, size) + 1;
}

/*
 * The mean color of the texels that a window touches, of the finest level that has few of them:
 * 0 only where all that interpolation can find there is.
 */
static struct pen_vec3 mean_within(const struct pen_texture *texture, const struct window *window)
{
	const struct pen_mipmap *mipmap = texture->mipmap;
	const struct pen_mip_level *level = mipmap->levels;
	const struct pen_mip_level *last = level + mipmap->level_count - 1;
	struct pen_vec3 sum = {0.0f, 0.0f, 0.0f};
	int64_t x0, y0, columns, rows;

	while (level < last && (texel_count(window, 0, level->width) > TEXELS_MAX ||
				       texel_count(window, 1, level->height) > TEXELS_MAX))
		level++;
	x0 = first_texel(window, 0, level->width);
	y0 = first_texel(window, 1, level->height);
	columns = level < last ? texel_count(window, 0, level->width) : 1;
	rows = level < last ? texel_count(window, 1, level->height) : 1;
	for (int64_t i = 0; i < columns * rows; i++) {
		const struct pen_texel texel = pen_mipmap_fetch(mipmap, level,
			fold(x0 + i % columns, level->width, texture->wrap_u),
			fold(y0 + i / columns, level->height, texture->wrap_v));

		sum = pen_add(sum, pen_vec3(texel.red, texel.green, texel.blue));
	}
	return pen_scale(sum, 1.0f / (float)(columns * rows));
}

/* Where a triangle is in a texture; false where it is nowhere or is no number. */
static bool find_window(const struct pen_geometry *geometry, const struct pen_model *model,
	const struct pen_texture *texture, uint32_t primitive, struct window *ret)
{
	const uint32_t offset = model->uv_offsets[texture->uv_set & 1];
	const uint32_t *index = geometry->indices + 3 * (size_t)(model->first + primitive);

	for (uint32_t k = 0; k < 3; k++) {
		const float *uv =
			offset != PEN_NO_INDEX
				? geometry->uvs + 2 * (size_t)(uint32_t)(index[k] + offset)
				: (const float[2]){0.0f, 0.0f};

		for (int i = 0; i < 2; i++) {
			const float *m = texture->uv[i];
			const float at = m[0] * uv[0] + m[1] * uv[1] + m[2];

			if (!(fabsf(at) < 1e6f))
				return false;
			ret->lower[i] = k == 0 ? at : fminf(ret->lower[i], at);
			ret->upper[i] = k == 0 ? at : fmaxf(ret->upper[i], at);
		}
	}
	return true;
}

/* About the mean radiance that a primitive sends out; 0 only where it is black. */
static float mean_radiance(
	const struct pen_render_scene *scene, const struct pen_shape *shape, uint32_t primitive)
{
	const struct pen_material *material = &scene->materials[shape->surface];
	const struct pen_texture *texture = &material->inputs[PEN_INPUT_EMISSION];
	const struct pen_model *model = &scene->geometry.models[shape->model];
	const float *e = material->emission;
	struct window window = {{0.0f, 0.0f}, {1.0f, 1.0f}};
	struct pen_vec3 mean;

	if (!texture->mipmap)
		return luminance(e[0], e[1], e[2]);
	if (model->type == PEN_MODEL_TRIANGLES &&
		!find_window(&scene->geometry, model, texture, primitive, &window))
		window = (struct window){{0.0f, 0.0f}, {1.0f, 1.0f}};
	mean = mean_within(texture, &window);
	return luminance(e[0] * mean.x, e[1] * mean.y, e[2] * mean.z);
}

static void grow(struct pen_light_hull *hull, struct pen_vec3 p, float by)
{
	const float at[3] = {p.x, p.y, p.z};

	for (int k = 0; k < 3; k++) {
		hull->lower[k] = fminf(hull->lower[k], at[k] - by);
		hull->upper[k] = fmaxf(hull->upper[k], at[k] + by);
	}
}

static void grow_by_light(struct pen_light_hull *hull, const struct pen_light *light)
{
	if (light->type == PEN_LIGHT_SPHERE) {
		grow(hull, light->origin, light->radius);
		return;
	}
	grow(hull, light->origin, 0.0f);
	grow(hull, pen_add(light->origin, light->edge_u), 0.0f);
	grow(hull, pen_add(light->origin, light->edge_v), 0.0f);
}

static void grow_over_times(const struct pen_render_scene *scene, const struct pen_emitter *emitter,
	uint32_t segments, struct pen_light_hull *hull)
{
	for (uint32_t i = 1; i <= segments; i++) {
		struct pen_light light;

		pen_emitter_place(scene, emitter, (float)i / (float)segments, &light);
		grow_by_light(hull, &light);
	}
}

/*
 * Bounds at all times: those of the steps of its vertices, of the steps of its placement and times
 * halfway between these, and a tenth more for what turns, by less than 90 degrees a step.
 */
static void bound_motion(const struct pen_render_scene *scene, const struct pen_emitter *emitter,
	struct pen_light_hull *hull)
{
	const struct pen_shape *shape = &scene->geometry.shapes[emitter->shape];
	float longest = 0.0f;

	grow_over_times(scene, emitter, scene->geometry.models[shape->model].step_count - 1, hull);
	if (shape->placement_count > 1)
		grow_over_times(scene, emitter, 2 * (shape->placement_count - 1), hull);
	for (int k = 0; k < 3; k++)
		longest = fmaxf(longest, hull->upper[k] - hull->lower[k]);
	for (int k = 0; k < 3; k++) {
		hull->lower[k] -= 0.1f * longest;
		hull->upper[k] += 0.1f * longest;
	}
}

/* False for what has no area. */
static bool find_hull(const struct pen_render_scene *scene, const struct pen_emitter *emitter,
	struct pen_light_hull *ret)
{
	const struct pen_shape *shape = &scene->geometry.shapes[emitter->shape];
	const struct pen_model *model = &scene->geometry.models[shape->model];
	const bool moves = shape->placement_count > 1 || model->step_count > 1;
	const bool is_sphere = model->type == PEN_MODEL_SPHERES;
	struct pen_light light;
	float area;

	pen_emitter_place(scene, emitter, 0.0f, &light);
	area = is_sphere ? PEN_PI * light.radius * light.radius : light.area;
	*ret = (struct pen_light_hull){
		.lower = {light.origin.x, light.origin.y, light.origin.z},
		.upper = {light.origin.x, light.origin.y, light.origin.z},
		.axis = light.axis,
		.cos_axis = 1.0f,
		.strength = area * mean_radiance(scene, shape, emitter->primitive),
		.two_sided = !scene->materials[shape->surface].is_one_sided,
	};
	grow_by_light(ret, &light);
	if (moves)
		bound_motion(scene, emitter, ret);
	if (moves || is_sphere) {
		ret->axis = pen_vec3(0.0f, 0.0f, 1.0f);
		ret->cos_axis = -1.0f;
		ret->two_sided = false;
	}
	return ret->strength > 0.0f && isfinite(ret->strength);
}

/* No primitive has a number yet: PEN_NO_INDEX is all ones. */
static int allocate(
	struct pen_emitters *emitters, const struct pen_render_scene *scene, struct pen_error *err)
{
	const struct pen_geometry *geometry = &scene->geometry;
	uint64_t primitives = 0;

	emitters->shape_count = geometry->shape_count;
	emitters->firsts = malloc((geometry->shape_count + 1ul) * sizeof *emitters->firsts);
	if (!emitters->firsts)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < geometry->shape_count; i++) {
		const struct pen_shape *shape = &geometry->shapes[i];

		emitters->firsts[i] = PEN_NO_INDEX;
		if (!shape_emits(scene, shape))
			continue;
		emitters->firsts[i] = (uint32_t)primitives;
		primitives += geometry->models[shape->model].count;
		if (primitives > PEN_EMITTER_CANDIDATES_MAX)
			return pen_error_set(err, PEN_ELIMIT,
				"surfaces with emission have more than %u primitives",
				PEN_EMITTER_CANDIDATES_MAX);
	}
	emitters->numbers = malloc((primitives + 1) * sizeof *emitters->numbers);
	if (!emitters->numbers)
		return pen_error_memory(err);
	memset(emitters->numbers, 0xff, primitives * sizeof *emitters->numbers);
	return 0;
}

/* Makes room for one more, and for the caller's hulls. */
static int extend(struct pen_emitters *emitters, uint32_t before, uint32_t *capacity,
	struct pen_light_hull **hulls, struct pen_error *err)
{
	const uint32_t wanted = *capacity < 1024 ? 1024 : 2 * *capacity;
	struct pen_emitter *items;
	struct pen_light_hull *more;

	if (emitters->count >= PEN_EMITTERS_MAX)
		return pen_error_set(err, PEN_ELIMIT,
			"surfaces with emission have more than %u primitives that are not black",
			PEN_EMITTERS_MAX);
	if (emitters->count < *capacity)
		return 0;
	items = realloc(emitters->items, wanted * sizeof *items);
	if (items)
		emitters->items = items;
	more = realloc(*hulls, ((size_t)before + wanted) * sizeof *more);
	if (more)
		*hulls = more;
	*capacity = wanted;
	return items && more ? 0 : pen_error_memory(err);
}

static int add_shape(struct pen_emitters *emitters, const struct pen_render_scene *scene,
	uint32_t shape, uint32_t before, uint32_t *capacity, struct pen_light_hull **hulls,
	struct pen_error *err)
{
	const uint32_t count = scene->geometry.models[scene->geometry.shapes[shape].model].count;
	uint32_t *numbers = emitters->numbers + emitters->firsts[shape];
	int r = 0;

	for (uint32_t i = 0; i < count && r == 0; i++) {
		const struct pen_emitter emitter = {shape, i};
		struct pen_light_hull hull;

		if (numbers[i] != PEN_NO_INDEX || !find_hull(scene, &emitter, &hull))
			continue;
		r = extend(emitters, before, capacity, hulls, err);
		if (r < 0)
			break;
		hull.light = before + emitters->count;
		(*hulls)[emitters->count] = hull;
		numbers[i] = hull.light;
		emitters->items[emitters->count++] = emitter;
	}
	return r;
}

int pen_emitters_init(struct pen_emitters *emitters, const struct pen_render_scene *scene,
	uint32_t before, struct pen_panels *panels, struct pen_light_hull **ret_hulls,
	struct pen_error *err)
{
	struct pen_light_hull *hulls = NULL;
	uint32_t capacity = 0;
	int r;

	*emitters = (struct pen_emitters){.count = 0};
	r = allocate(emitters, scene, err);
	for (uint32_t i = 0; r == 0 && i < emitters->shape_count; i++)
		if (emitters->firsts[i] != PEN_NO_INDEX)
			r = pen_panels_find(panels, scene, i, before,
				emitters->numbers + emitters->firsts[i], err);
	before += panels->count;
	if (r == 0) {
		hulls = malloc((before + 1ul) * sizeof *hulls);
		r = hulls ? 0 : pen_error_memory(err);
	}
	for (uint32_t i = 0; r == 0 && i < emitters->shape_count; i++)
		if (emitters->firsts[i] != PEN_NO_INDEX)
			r = add_shape(emitters, scene, i, before, &capacity, &hulls, err);
	if (r < 0) {
		free(hulls);
		pen_emitters_finish(emitters);
	} else {
		*ret_hulls = hulls;
	}
	return r;
}

void pen_emitters_finish(struct pen_emitters *emitters)
{
	free(emitters->items);
	free(emitters->firsts);
	free(emitters->numbers);
	*emitters = (struct pen_emitters){.count = 0};
}
