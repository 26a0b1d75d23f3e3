/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_GEOMETRY_H
#define PEN_RENDER_GEOMETRY_H

#include "core/base/error.h"
#include "core/render/motion.h"
#include "core/scene/desc.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * What rays can hit, as plain arrays that both Embree and the shading read: the objects that are
 * to be seen, and the visible lights. What stands still, and spheres that only travel, are in
 * world coordinates; everything else is a model placed by a transform.
 */

enum pen_model_type { PEN_MODEL_TRIANGLES, PEN_MODEL_SPHERES, PEN_MODEL_DISK };

struct pen_sphere {
	float x, y, z, radius;
};

/* A run of primitives of one type in the pools. */
struct pen_model {
	enum pen_model_type type;
	uint32_t first, count;	/* triangles, spheres of a step, disks */
	uint32_t vertex_first;	/* of triangles: those of a step follow those of the step before */
	uint32_t vertex_count;	/* of a step */
	uint32_t step_count;	/* of vertices or spheres; 1 = rigid */
	uint32_t normal_offset; /* from a step's vertex to its normal, modulo 2^32; PEN_NO_INDEX:
				   flat */
	/* Likewise to what else there may be; PEN_NO_INDEX: nothing. */
	uint32_t uv_offsets[2], color_offset, tangent_offset;
};

/* One entry for each geometry of the top Embree scene, in the order of its ids. */
struct pen_shape {
	uint32_t model;
	uint32_t surface;
	bool lets_pass; /* rays may find nothing there: see core/render/sieve.h */
	uint32_t placement_first, placement_count; /* steps; 0: the model is in world coordinates */
	float world[3][4];			   /* of a placement that stands still */
};

/* Embree reads both members as aligned vectors of four. */
struct pen_disk {
	_Alignas(16) struct pen_sphere bounds;
	_Alignas(16) float normal[3]; /* unit */
};

struct pen_geometry {
	float *vertices;   /* 3 each, world or own coordinates */
	float *normals;	   /* 3 each, unit, of meshes that have them */
	float *uvs;	   /* 2 each, of both sets */
	float *colors;	   /* 4 each, linear */
	float *tangents;   /* 4 each: unit, and the sign of normal x tangent */
	uint32_t *indices; /* 3 a triangle, counted from the first vertex of the pool */
	struct pen_sphere *spheres;
	struct pen_disk *disks;
	struct pen_placement *placements;
	struct pen_model *models;
	struct pen_shape *shapes;
	uint32_t model_count, shape_count;
};

/*
 * Lays out a scene as a frame shows it. Surfaces are numbered: first the scene's materials, then
 * its lights. PEN_EINVALID names an object whose placement is singular at some time of the open
 * shutter or leaves PEN_COORDINATE_MAX; PEN_ELIMIT, PEN_ENOMEM.
 */
int pen_geometry_init(struct pen_geometry *geometry, const struct pen_scene *scene, uint32_t frame,
	struct pen_error *err);
void pen_geometry_finish(struct pen_geometry *geometry);

/*
 * In an animation the frames share what is the same at all times: what rests, and the rigid models
 * of what moves. Which part a thing belongs to is the scene's to say, not the frame's: so what
 * moves is a placed model in every frame, also where it stands still for a while.
 */
enum pen_geometry_part { PEN_GEOMETRY_ALL, PEN_GEOMETRY_SHARED, PEN_GEOMETRY_FRAME };

struct pen_layout;

/* Adds a part of the scene to a layout. Errors as above. */
int pen_geometry_add(struct pen_layout *l, enum pen_geometry_part part);

#endif
