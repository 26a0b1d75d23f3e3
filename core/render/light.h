/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_LIGHT_H
#define PEN_RENDER_LIGHT_H

#include "core/base/error.h"
#include "core/render/vec.h"
#include "core/render/warp.h"
#include "core/scene/desc.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * A light, made ready for sampling. What it sends towards a point is color * strength, where color
 * is its radiance, intensity or irradiance and strength a number.
 */
struct pen_light {
	enum pen_light_type type;
	bool delta; /* no lobe can hit it: point, spot, directional of angle 0 */
	struct pen_vec3 color;
	struct pen_vec3 origin; /* corner, first vertex, centre or position */
	struct pen_vec3 axis;	/* unit: normal of the emitting side, axis of a spot, or where a
				   directional light comes from */
	struct pen_vec3 edge_u,
		edge_v; /* rectangle: unit; triangle: to the other vertices; disk: its basis */
	float length_u, length_v; /* of a rectangle's edges */
	float radius;
	float area;
	float spot_cos;		/* of half the cone */
	float spot_inv_blend;	/* 1 / (blend * (1 - spot_cos)) */
	float cone;		/* directional: 1 - cos of half its angle */
	float cone_strength;	/* directional: radiance of an irradiance of 1 */
	struct pen_basis basis; /* directional: around axis */
};

void pen_light_init(struct pen_light *light, const struct pen_light_desc *desc);

/*
 * The power that a scene within a sphere of scene_radius gets, up to a factor common to all
 * lights: what lights are chosen by.
 */
double pen_light_power(const struct pen_light_desc *desc, double scene_radius);

/*
 * One sample of what a light sends to a point. Without a hit of anything between, its
 * contribution to outgoing light is color * strength / pdf * bsdf * cos. strength is 0 where the
 * light does not shine on the point (then the rest is finite, but means nothing).
 */
struct pen_light_sample {
	struct pen_vec3 direction; /* to the light, unit */
	float distance;		   /* INFINITY for a directional light */
	float strength;
	float pdf; /* of the direction, by solid angle; 1 for a delta light; never 0 */
};

/*
 * n samples of one light at the points p with (u, v) in [0,1), all arrays of n floats.
 * Rectangles by solid angle (Urena et al. 2013), triangles by solid angle (Arvo 1995) between
 * PEN_TRIANGLE_SOLID_ANGLE_MIN and _MAX, spheres by their cone, disks by area.
 */
struct pen_light_points {
	const float *x, *y, *z;
};
struct pen_light_samples {
	float *direction_x, *direction_y, *direction_z;
	float *distance, *strength, *pdf;
};
void pen_light_sample(const struct pen_light *light, uint32_t n, const struct pen_light_points *p,
	const float *u, const float *v, const struct pen_light_samples *ret_samples);

/* The same for one point. */
struct pen_light_sample pen_light_sample_one(
	const struct pen_light *light, struct pen_vec3 p, float u, float v);

/*
 * The solid-angle density with which pen_light_sample gives a direction from p that hits the light
 * at the distance; 0 for the types that are no geometry. For a ray that did hit it.
 */
float pen_light_pdf(const struct pen_light *light, struct pen_vec3 p, struct pen_vec3 direction,
	float distance);

/* Whether light leaves a hit point against the ray's direction: the emitting side. */
bool pen_light_emits(const struct pen_light *light, struct pen_vec3 hit, struct pen_vec3 direction);

/* Whitted's shadow ray: the light's centre with its whole power estimated there; pdf is 1. */
struct pen_light_sample pen_light_centre(const struct pen_light *light, struct pen_vec3 p);

/* One of many lights, with a probability in proportion to its power (alias table). */
struct pen_light_choice {
	uint32_t count;
	float *keep;	 /* chance to keep the column's own light */
	uint32_t *other; /* the column's second light */
	float *chance;	 /* of each light */
};

/* powers: count > 0 numbers >= 0; all zero means equal chances. PEN_ENOMEM. */
int pen_light_choice_init(struct pen_light_choice *choice, const double *powers, uint32_t count,
	struct pen_error *err);
void pen_light_choice_finish(struct pen_light_choice *choice);

/* The light for (u, v) in [0,1); its probability is choice->chance[light]. */
static inline uint32_t pen_light_choose(const struct pen_light_choice *choice, float u, float v)
{
	const uint32_t light = (uint32_t)(u * (float)choice->count);

	return v < choice->keep[light] ? light : choice->other[light];
}

#endif
