/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/lights.h"

#include "core/render/light_place.h"

#include <math.h>
#include <stdlib.h>

static float luminance(struct pen_vec3 color)
{
	return 0.2126f * color.x + 0.7152f * color.y + 0.0722f * color.z;
}

static void set_box(struct pen_light_hull *hull, struct pen_vec3 p, struct pen_vec3 reach)
{
	const float at[3] = {p.x, p.y, p.z}, by[3] = {reach.x, reach.y, reach.z};

	for (int k = 0; k < 3; k++) {
		hull->lower[k] = at[k] - by[k];
		hull->upper[k] = at[k] + by[k];
	}
}

/* The corners of a rectangle or, three of them, of a triangle. */
static void set_corners(struct pen_light_hull *hull, const struct pen_light *light, bool has_four)
{
	const struct pen_vec3 u = pen_scale(light->edge_u, has_four ? light->length_u : 1.0f);
	const struct pen_vec3 v = pen_scale(light->edge_v, has_four ? light->length_v : 1.0f);
	const struct pen_vec3 steps[3] = {u, v, pen_add(u, v)};

	set_box(hull, light->origin, pen_vec3(0.0f, 0.0f, 0.0f));
	for (int i = 0; i < (has_four ? 3 : 2); i++) {
		const struct pen_vec3 p = pen_add(light->origin, steps[i]);
		const float at[3] = {p.x, p.y, p.z};

		for (int k = 0; k < 3; k++) {
			hull->lower[k] = fminf(hull->lower[k], at[k]);
			hull->upper[k] = fmaxf(hull->upper[k], at[k]);
		}
	}
}

static struct pen_vec3 disk_reach(const struct pen_light *light)
{
	const struct pen_vec3 n = light->axis;

	return pen_scale(
		pen_vec3(pen_sqrt_clamped(1.0f - n.x * n.x), pen_sqrt_clamped(1.0f - n.y * n.y),
			pen_sqrt_clamped(1.0f - n.z * n.z)),
		light->radius);
}

/* Of any light but a directional one. */
static struct pen_light_hull hull_of(const struct pen_light *light, uint32_t number)
{
	const float radius = light->radius;
	const float bright = luminance(light->color);
	struct pen_light_hull hull = {
		.axis = light->axis,
		.cos_axis = 1.0f,
		.strength = bright * light->area,
		.light = number,
		.two_sided = light->back < 0.0f,
	};

	switch (light->type) {
	case PEN_LIGHT_RECTANGLE: set_corners(&hull, light, true); return hull;
	case PEN_LIGHT_TRIANGLE: set_corners(&hull, light, false); return hull;
	case PEN_LIGHT_DISK: set_box(&hull, light->origin, disk_reach(light)); return hull;
	case PEN_LIGHT_SPOT:
		set_box(&hull, light->origin, pen_vec3(0.0f, 0.0f, 0.0f));
		hull.cos_reach = light->spot_cos;
		hull.strength = bright;
		return hull;
	case PEN_LIGHT_SPHERE:
		set_box(&hull, light->origin, pen_vec3(radius, radius, radius));
		hull.strength = bright * 0.25f * light->area;
		break;
	case PEN_LIGHT_POINT:
	case PEN_LIGHT_DIRECTIONAL:
		set_box(&hull, light->origin, pen_vec3(0.0f, 0.0f, 0.0f));
		hull.strength = bright;
		break;
	}
	hull.axis = pen_vec3(0.0f, 0.0f, 1.0f);
	hull.cos_axis = -1.0f;
	return hull;
}

static int create_items(
	struct pen_lights *lights, const struct pen_render_scene *scene, struct pen_error *err)
{
	const struct pen_scene *desc = scene->desc;

	lights->items = calloc(desc->light_count + 1ul, sizeof *lights->items);
	if (!lights->items)
		return pen_error_memory(err);
	lights->own_count = lights->count = desc->light_count;
	for (uint32_t i = 0; i < desc->light_count; i++) {
		const struct pen_light_desc placed = pen_light_place(
			desc, &desc->lights[i], pen_shutter_of(desc, scene->frame).open);

		pen_light_init(&lights->items[i], &placed);
	}
	return 0;
}

/* Adds what the tree is to hold of the scene's own lights and of panels to the emitters' hulls. */
static uint32_t add_hulls(
	const struct pen_lights *lights, struct pen_light_hull *hulls, uint32_t count)
{
	for (uint32_t i = lights->sampled_count; i < lights->count; i++) {
		const struct pen_light_hull hull = hull_of(&lights->items[i], i);

		if (lights->items[i].type != PEN_LIGHT_DIRECTIONAL && hull.strength > 0.0f)
			hulls[count++] = hull;
	}
	return count;
}

/*
 * How often a directional light is chosen: by what these give against an estimate of what the
 * others give among themselves, which any frame finds the same.
 */
static float far_chance_of(const struct pen_light_tree *tree, double irradiance)
{
	const double near = (double)tree->strength / fmax((double)tree->radius2, 1e-30);

	if (tree->node_count == 0)
		return 1.0f;
	return (float)fmin(fmax(irradiance / (irradiance + near), 0.1), 0.9);
}

static int create_far(struct pen_lights *lights, struct pen_error *err)
{
	double *strengths = calloc(lights->own_count + 1ul, sizeof *strengths);
	double sum = 0.0;
	int r = 0;

	lights->far = calloc(lights->own_count + 1ul, sizeof *lights->far);
	if (!strengths || !lights->far) {
		free(strengths);
		return pen_error_memory(err);
	}
	for (uint32_t i = 0; i < lights->own_count; i++) {
		const double strength = (double)luminance(lights->items[i].color);

		if (lights->items[i].type != PEN_LIGHT_DIRECTIONAL || !(strength > 0.0))
			continue;
		lights->far[lights->far_count] = i;
		strengths[lights->far_count++] = strength;
		sum += strength;
	}
	if (lights->far_count > 0) {
		lights->far_chance = far_chance_of(&lights->tree, sum);
		r = pen_light_choice_init(&lights->far_choice, strengths, lights->far_count, err);
	}
	free(strengths);
	return r;
}

static int add_panels(
	struct pen_lights *lights, const struct pen_panels *panels, struct pen_error *err)
{
	const uint32_t count = lights->own_count + panels->count;
	struct pen_light *items = realloc(lights->items, (count + 1ul) * sizeof *items);

	if (!items)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < panels->count; i++)
		items[lights->own_count + i] = panels->items[i];
	lights->items = items;
	lights->count = count;
	return 0;
}

static uint32_t count_sampled(const struct pen_lights *lights)
{
	if (lights->count <= PEN_LIGHTS_SAMPLED_MAX)
		return lights->count;
	return lights->own_count <= PEN_LIGHTS_SAMPLED_MAX ? lights->own_count : 0;
}

static int create_choice(
	struct pen_lights *lights, const struct pen_render_scene *scene, struct pen_error *err)
{
	struct pen_panels panels = {.count = 0};
	struct pen_light_hull *hulls = NULL;
	uint32_t count = 0;
	int r = pen_emitters_init(
		&lights->emitters, scene, lights->own_count, &panels, &hulls, err);

	if (r == 0)
		r = add_panels(lights, &panels, err);
	pen_panels_finish(&panels);
	if (r == 0) {
		lights->sampled_count = count_sampled(lights);
		count = add_hulls(lights, hulls, lights->emitters.count);
		r = pen_light_tree_init(
			&lights->tree, hulls, count, lights->count + lights->emitters.count, err);
	}
	free(hulls);
	if (r == 0 && lights->sampled_count < lights->own_count)
		r = create_far(lights, err);
	lights->chooses = count > 0 || lights->far_count > 0;
	return r;
}

int pen_lights_create(
	const struct pen_render_scene *scene, struct pen_lights **ret_lights, struct pen_error *err)
{
	struct pen_lights *lights = calloc(1, sizeof *lights);
	int r;

	if (!lights)
		return pen_error_memory(err);
	r = create_items(lights, scene, err);
	if (r == 0 && scene->desc->integrator.type == PEN_INTEGRATOR_WHITTED)
		lights->sampled_count = lights->count;
	else if (r == 0)
		r = create_choice(lights, scene, err);
	if (r < 0)
		pen_lights_destroy(lights);
	else
		*ret_lights = lights;
	return r;
}

void pen_lights_destroy(struct pen_lights *lights)
{
	if (!lights)
		return;
	pen_light_choice_finish(&lights->far_choice);
	free(lights->far);
	pen_light_tree_finish(&lights->tree);
	pen_emitters_finish(&lights->emitters);
	free(lights->items);
	free(lights);
}

bool pen_lights_rest(
	const struct pen_lights *lights, const struct pen_scene *desc, uint32_t shape_first)
{
	for (uint32_t i = 0; i < desc->light_count; i++)
		if (desc->lights[i].node != PEN_NO_INDEX)
			return false;
	for (uint32_t i = shape_first; i < lights->emitters.shape_count; i++)
		if (lights->emitters.firsts[i] != PEN_NO_INDEX)
			return false;
	return true;
}
