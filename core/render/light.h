/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_LIGHT_H
#define PEN_RENDER_LIGHT_H

#include "core/render/vec.h"
#include "core/scene/desc.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * A light, made ready for sampling. What it sends towards a point is color * strength, where color
 * is its radiance, intensity or irradiance and strength a number.
 */
struct pen_light {
	enum pen_light_type type;
	bool delta; /* one direction only, which no lobe finds: point, spot, directional of angle 0
		     */
	struct pen_vec3 color;
	struct pen_vec3 origin; /* corner, first vertex, centre or position */
	/* Unit: normal of the emitting side, axis of a spot, where a directional light comes from.
	 */
	struct pen_vec3 axis;
	/* Rectangle: unit; triangle: to its other vertices; disk: two radii; directional: a frame.
	 */
	struct pen_vec3 edge_u, edge_v;
	float length_u, length_v; /* of a rectangle's edges */
	float back;		  /* of a rectangle: -1 where its back shines too, else 1 */
	float radius;
	float area;
	float spot_cos;	      /* of half the cone */
	float spot_inv_blend; /* 1 / (blend * (1 - spot_cos)) */
	float cone;	      /* directional: 1 - cos of half its angle */
	float cone_pdf;	      /* its density by solid angle; 1 for a delta */
	float cone_strength;  /* directional: radiance of an irradiance of 1 */
};

void pen_light_init(struct pen_light *light, const struct pen_light_desc *desc);

/* A triangle of the world for pen_light_sample_one and pen_light_pdf; it has no color. */
void pen_light_set_triangle(struct pen_light *light, struct pen_vec3 corner, struct pen_vec3 edge_u,
	struct pen_vec3 edge_v);
void pen_light_set_sphere(struct pen_light *light, struct pen_vec3 center, float radius);

/*
 * What a light sends to a point, in one direction. With nothing between, its contribution to
 * outgoing light is color * strength / pdf * bsdf * cos. strength is 0 where the light does not
 * shine on the point; then the rest is finite but means nothing.
 */
struct pen_light_sample {
	struct pen_vec3 direction; /* to the light, unit */
	float distance;		   /* INFINITY for a directional light */
	float strength;
	float pdf; /* of the direction, by solid angle; 1 for a delta light; never 0 */
};

/*
 * Rectangles are sampled by solid angle (Urena et al. 2013), and so are triangles (Arvo 1995);
 * where that loses its precision or its use they are sampled by area, as are disks. Spheres are
 * sampled by their cone and directional lights by theirs. A spot fades with the cosine: with t =
 * (cos - cos(cone_angle / 2)) / (blend (1 - cos(cone_angle / 2))), clamped to [0, 1], its strength
 * is t^2 (3 - 2 t) / distance^2.
 */
struct pen_light_sample pen_light_sample_one(
	const struct pen_light *light, struct pen_vec3 p, float u, float v);

/* Structure of arrays, each of n floats. */
struct pen_light_points {
	const float *x, *y, *z;
};
struct pen_light_samples {
	float *direction_x, *direction_y, *direction_z;
	float *distance, *strength, *pdf;
};

/* The same light for n points, with (u, v) in [0,1). */
void pen_light_sample(const struct pen_light *light, uint32_t n,
	const struct pen_light_points *points, const float *u, const float *v,
	const struct pen_light_samples *ret_samples);

/* A triangle for each of n points: a corner, and the edges that begin there. */
struct pen_light_triangles {
	const float *corner_x, *corner_y, *corner_z;
	const float *edge_ux, *edge_uy, *edge_uz;
	const float *edge_vx, *edge_vy, *edge_vz;
};

void pen_light_sample_triangles(uint32_t n, const struct pen_light_triangles *triangles,
	const struct pen_light_points *points, const float *u, const float *v,
	const struct pen_light_samples *ret_samples);

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

#endif
