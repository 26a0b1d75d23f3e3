/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SCENE_H
#define PEN_RENDER_SCENE_H

#include "core/render/albedo.h"
#include "core/render/camera.h"
#include "core/render/filter.h"
#include "core/render/geometry.h"
#include "core/render/kernel.h"
#include "core/render/light.h"
#include "core/render/material.h"
#include "core/render/render.h"
#include "core/render/trace.h"

#include <stdbool.h>
#include <stdint.h>

/* What happens to a path at a hit. Bits, so that a packet's kinds are one number. */
enum pen_kind {
	PEN_KIND_NOTHING = 1 << 0,
	PEN_KIND_LIGHT = 1 << 1,
	PEN_KIND_MATTE = 1 << 2,
	PEN_KIND_MIRROR = 1 << 3, /* glossy of roughness 0 */
	PEN_KIND_GLOSSY = 1 << 4,
	PEN_KIND_CLEAR = 1 << 5, /* glass of roughness 0 */
	PEN_KIND_FROSTED = 1 << 6,
	PEN_KIND_PRINCIPLED = 1 << 7,
	PEN_KIND_UNLIT = 1 << 8, /* glows and ends the path */
	/* Beside one of the above, in kinds alone. */
	PEN_KIND_DETAILED = 1 << 16, /* to be completed by pen_detail_find */
	PEN_KIND_GLOWING = 1 << 17   /* may send out light of its own */
};

/* Materials, then lights, then what rays hit that hit nothing. */
struct pen_surface {
	uint32_t kind;
	uint32_t light; /* index, of a light */
	float red, green, blue;
	float alpha, ior;
	uint32_t kinds; /* kind and what comes with it */
};

/* How the hit point is found. Bits, as above. */
enum pen_route {
	PEN_ROUTE_NONE = 1 << 0,
	PEN_ROUTE_TRIANGLE = 1 << 1,  /* in world coordinates, at rest */
	PEN_ROUTE_SPHERE = 1 << 2,    /* the same */
	PEN_ROUTE_TRAVELLER = 1 << 3, /* a sphere in world coordinates, but for its time */
	PEN_ROUTE_SLOW = 1 << 4	      /* anything, by way of its shape */
};

/* What a lane needs of the shape it hit; the last entry stands for no hit. */
struct pen_target {
	uint32_t route;
	uint32_t surface;
	uint32_t first;		/* in the pool of triangles or spheres */
	uint32_t normal_offset; /* see struct pen_model */
};

struct pen_lights;

/* A scene as one frame shows it. */
struct pen_render_scene {
	const struct pen_scene *desc;
	const struct pen_pictures *pictures; /* NULL: none */
	uint32_t frame;
	bool is_of_shot; /* whose pools the geometry is in */
	const struct pen_kernel *kernel;
	struct pen_geometry geometry;
	struct pen_trace *trace;
	struct pen_target *targets; /* one a shape, and one more */
	struct pen_surface *surfaces;
	struct pen_material *materials; /* in the order of the first surfaces */
	bool *solids;			/* of each shape: closed, so that light may go into it */
	struct pen_albedo *albedo;	/* NULL without principled materials */
	bool has_textures;
	float sample_share; /* of a pixel's or a lobe's width that a sample stands for */
	struct pen_camera camera;
	struct pen_filter filter;
	struct pen_lights *lights;
	bool has_shared_lights;			   /* they are the shot's */
	struct pen_vec3 background;		   /* where there is no environment */
	const struct pen_environment *environment; /* or NULL */
	bool has_cones;				   /* paths know what a sample sees */
};

/*
 * A frame of a shot: geometry is a view of the shot's pools, and its shapes from shape_first on
 * are the frame's, those before base's. Both must outlive the result. lights are those of the
 * shot's frames that do not change, or NULL until one has made them; the caller destroys them.
 */
int pen_render_scene_create_on(const struct pen_scene *desc, const struct pen_pictures *pictures,
	uint32_t frame, enum pen_isa isa, const struct pen_geometry *geometry,
	struct pen_trace *base, uint32_t shape_first, struct pen_lights **lights,
	struct pen_render_scene **ret_scene, struct pen_error *err);

/* Of its desc the camera, but for the shutter, the image and the sampling have changed. */
int pen_render_scene_look(struct pen_render_scene *scene, struct pen_error *err);

/* The kernel of an instruction set; PEN_EUNSUPPORTED when this processor does not run it. */
int pen_render_kernel(
	enum pen_isa isa, const struct pen_kernel **ret_kernel, struct pen_error *err);

/* All lights are sampled at a hit up to this number of them. */
enum { PEN_LIGHTS_SAMPLED_MAX = 8 };

#endif
