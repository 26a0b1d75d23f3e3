/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_POINT_H
#define PEN_RENDER_POINT_H

#include "core/render/scene.h"
#include "core/render/trace.h"

/* Where sixteen rays hit, and what is there. */
struct pen_points {
	_Alignas(64) float x[PEN_LANES];
	float y[PEN_LANES];
	float z[PEN_LANES];
	float facing_x[PEN_LANES]; /* unit geometric normal on the side that the ray came from */
	float facing_y[PEN_LANES];
	float facing_z[PEN_LANES];
	float normal_x[PEN_LANES]; /* unit shading normal on the same side */
	float normal_y[PEN_LANES];
	float normal_z[PEN_LANES];
	float error[PEN_LANES]; /* how far the point may lie off the surface, generously */
	float red[PEN_LANES];	/* the material's color */
	float green[PEN_LANES];
	float blue[PEN_LANES];
	float alpha[PEN_LANES];
	float eta[PEN_LANES];	      /* of what is behind the surface over what is before it */
	uint32_t kind[PEN_LANES];     /* enum pen_kind */
	uint32_t light[PEN_LANES];    /* of a light: its index */
	uint32_t backside[PEN_LANES]; /* all ones where the ray came from behind the surface */
	uint32_t kinds; /* of all lanes together, with PEN_KIND_DETAILED and PEN_KIND_GLOWING */
	/* The rest is there where pen_detail_find put it: light that the surface sends out, */
	_Alignas(64) float glow_red[PEN_LANES];
	float glow_green[PEN_LANES];
	float glow_blue[PEN_LANES];
	/* and what principled is made of, see core/render/principled.h. */
	float f0[PEN_LANES];
	float metallic[PEN_LANES];
	float transmission[PEN_LANES];
	float albedo[PEN_LANES];
	float coat[PEN_LANES];
	float coat_alpha[PEN_LANES];
	float coat_x[PEN_LANES];
	float coat_y[PEN_LANES];
	float coat_z[PEN_LANES];
	float smooth_x[PEN_LANES]; /* the normal before a normal map bent it */
	float smooth_y[PEN_LANES];
	float smooth_z[PEN_LANES];
	uint32_t solid[PEN_LANES];
	uint32_t additive[PEN_LANES];
};

/*
 * Finds the points of a packet's hits more exactly than origin + distance * direction: triangles
 * by barycentric coordinates, spheres by projection onto them, both at the ray's time.
 */
void pen_points_find(const struct pen_render_scene *scene, const struct pen_packet *packet,
	struct pen_points *ret_points);

/* The normal of a lane's surface if only light from before it counts, else the zero vector. */
static inline struct pen_vec3 pen_points_receiver(const struct pen_points *points, int lane)
{
	const uint32_t kind = points->kind[lane];
	const bool is_opaque =
		(kind & (PEN_KIND_MATTE | PEN_KIND_GLOSSY)) != 0 ||
		(kind == PEN_KIND_PRINCIPLED && !(points->transmission[lane] > 0.0f));

	return is_opaque ? pen_vec3(points->normal_x[lane], points->normal_y[lane],
				   points->normal_z[lane])
			 : pen_vec3(0.0f, 0.0f, 0.0f);
}

/* A lane's point, lifted off the surface to the side that a direction leaves by. */
static inline struct pen_vec3 pen_points_leave(
	const struct pen_points *points, int lane, struct pen_vec3 direction)
{
	const struct pen_vec3 p = {points->x[lane], points->y[lane], points->z[lane]};
	const struct pen_vec3 n = {
		points->facing_x[lane], points->facing_y[lane], points->facing_z[lane]};
	const float side = pen_dot(direction, n) < 0.0f ? -1.0f : 1.0f;

	return pen_madd(p, side * points->error[lane], n);
}

#endif
