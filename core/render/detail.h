/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_DETAIL_H
#define PEN_RENDER_DETAIL_H

#include "core/render/path.h"
#include "core/render/point.h"
#include "core/render/principled.h"

/*
 * What points of a packet need beyond their surface's constants: textures, vertex colours, normal
 * maps, and all that principled is made of. For packets with PEN_KIND_DETAILED; other lanes stay
 * as they are.
 */
void pen_detail_find(
	const struct pen_pass *pass, const struct pen_paths *paths, struct pen_points *points);

/*
 * The opacity of a material at a hit of a shape: its own, its texture's at the finest level, and
 * the vertex colours'. u and v are the hit's barycentric coordinates; normal is the hit's geometric
 * normal in the coordinates of the shape's model, which need not be unit, for spheres.
 */
float pen_detail_opacity(const struct pen_render_scene *scene, uint32_t shape, uint32_t primitive,
	float u, float v, struct pen_vec3 normal);

/*
 * What the surface sends out at a place of a primitive into a direction whose cosine with its
 * geometric normal is given, as add_glow of core/render/direct.c sees it, but at the texture's
 * finest level, and times the chance that the surface is there. Arguments as above.
 */
struct pen_vec3 pen_detail_emission(const struct pen_render_scene *scene, uint32_t shape,
	uint32_t primitive, float u, float v, struct pen_vec3 normal, float cosine);

/*
 * How likely a diffuse lobe may be at most: the others, which see less light but sharper, get the
 * rest. distribution ends a path by it, path follows it.
 */
static inline float pen_diffuse_chance_max(enum pen_integrator_type type)
{
	return type == PEN_INTEGRATOR_PATH ? 0.75f : 0.5f;
}

/* A lane's principled surface. */
PEN_LANE struct pen_principled pen_detail_principled(const struct pen_points *points, int lane)
{
	return (struct pen_principled){
		.color = {points->red[lane], points->green[lane], points->blue[lane]},
		.alpha = points->alpha[lane],
		.eta = points->eta[lane],
		.f0 = points->f0[lane],
		.metallic = points->metallic[lane],
		.transmission = points->transmission[lane],
		.is_solid = points->solid[lane] != 0,
		.is_additive = points->additive[lane] != 0,
		.albedo = points->albedo[lane],
		.coat = points->coat[lane],
		.coat_alpha = points->coat_alpha[lane],
		.coat_normal = {points->coat_x[lane], points->coat_y[lane], points->coat_z[lane]},
		.smooth_normal = {points->smooth_x[lane], points->smooth_y[lane],
			points->smooth_z[lane]},
	};
}

#endif
