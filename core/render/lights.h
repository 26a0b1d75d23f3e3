/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_LIGHTS_H
#define PEN_RENDER_LIGHTS_H

#include "core/render/emitters.h"
#include "core/render/light_choice.h"
#include "core/render/light_tree.h"
#include "core/render/scene.h"

/*
 * All lights of a frame. Up to PEN_LIGHTS_SAMPLED_MAX of the scene's own, and of panels as many as
 * then are no more either, are sampled each at every hit. More of them, and what else surfaces
 * emit, are chosen from: by the tree, or, of directional lights, which no tree can hold, by their
 * strength alone.
 */
struct pen_lights {
	struct pen_light *items; /* the scene's own, then the panels */
	uint32_t own_count, count;
	uint32_t sampled_count;	      /* the first so many are not chosen from */
	struct pen_emitters emitters; /* as lights they are numbered after the others */
	bool chooses;		      /* there is something to choose from */
	struct pen_light_tree tree;
	uint32_t *far; /* the directional lights */
	uint32_t far_count;
	struct pen_light_choice far_choice;
	float far_chance; /* that one of them is chosen */
};

/*
 * Of a scene whose geometry, materials and trees are there. PEN_ELIMIT says that there are too many
 * emitters; PEN_ENOMEM.
 */
int pen_lights_create(const struct pen_render_scene *scene, struct pen_lights **ret_lights,
	struct pen_error *err);
void pen_lights_destroy(struct pen_lights *lights);

/* Whether all frames have the same: nothing that shines is of a node or among the shapes from
 * shape_first on. */
bool pen_lights_rest(
	const struct pen_lights *lights, const struct pen_scene *desc, uint32_t shape_first);

/* A light for each of sixteen points; see pen_light_tree_choose. */
void pen_lights_choose(const struct pen_lights *lights, const struct pen_light_receivers *receivers,
	const float u[PEN_LANES], const float v[PEN_LANES], uint32_t ret_light[PEN_LANES],
	float ret_chance[PEN_LANES]);

/* The chance with which a light is sampled for a point: 1 when it is not chosen from. */
float pen_lights_chance(
	const struct pen_lights *lights, struct pen_vec3 p, struct pen_vec3 normal, uint32_t light);

#endif
