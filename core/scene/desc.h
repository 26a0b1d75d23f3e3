/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_DESC_H
#define PEN_SCENE_DESC_H

#include "core/base/arena.h"
#include "core/base/rect.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * A scene as plain data: what a valid scene text says, with every default filled in and every
 * name resolved to an index. Made by pen_scene_parse, never changed afterwards; all memory is the
 * scene's arena. Right-handed, Y up; lengths in world units, angles in degrees, times in seconds,
 * linear Rec. 709 RGB, radiance in W/(sr m^2), quaternions x y z w (normalised here).
 */

enum pen_filter_type {
	PEN_FILTER_BOX,
	PEN_FILTER_TRIANGLE,
	PEN_FILTER_GAUSSIAN, /* sigma = width / 6 */
	PEN_FILTER_BLACKMAN_HARRIS,
	PEN_FILTER_MITCHELL /* B = C = 1/3 */
};

struct pen_image_desc {
	uint32_t width, height; /* pixels */
	enum pen_filter_type filter;
	double filter_width; /* full support, pixels */
	struct pen_rect crop;
	double exposure; /* stops, for PNG and JPEG */
};

enum pen_focal_surface { PEN_FOCAL_PLANE, PEN_FOCAL_SPHERE };

struct pen_camera_key {
	double time;
	double position[3], look_at[3], up[3];
};

struct pen_camera_desc {
	double position[3], look_at[3], up[3];
	double horizontal_fov;
	double aperture_radius; /* 0 = pinhole */
	double focus_distance;
	enum pen_focal_surface focal_surface;
	uint32_t blades; /* 0 = round, else >= 3 */
	double blade_rotation;
	double shutter_open,
		shutter_close;	     /* absolute here: frame time added; equal = an instant */
	struct pen_camera_key *keys; /* strictly rising times; each key complete */
	uint32_t key_count;	     /* 0 = position, look_at and up above hold always */
};

enum pen_integrator_type {
	PEN_INTEGRATOR_DISTRIBUTION,
	PEN_INTEGRATOR_WHITTED,
	PEN_INTEGRATOR_PATH
};

struct pen_integrator_desc {
	enum pen_integrator_type type;
	uint32_t max_depth; /* surfaces that pass a path on to another, >= 1; the last one that it
			       meets gathers direct light */
};

enum pen_sequence { PEN_SEQUENCE_SOBOL, PEN_SEQUENCE_JITTERED, PEN_SEQUENCE_RANDOM };

struct pen_sampling_desc {
	uint32_t samples; /* per pixel */
	enum pen_sequence sequence;
	uint32_t seed;
};

enum pen_material_type { PEN_MATERIAL_MATTE, PEN_MATERIAL_GLOSSY, PEN_MATERIAL_GLASS };

struct pen_material_desc {
	const char *name;
	enum pen_material_type type;
	double color[3];
	double roughness; /* alpha = roughness^2; 0 = perfectly smooth */
	double ior;	  /* glass */
};

/* World = translate * rotate * scale * own coordinates. */
struct pen_pose {
	double translate[3], rotate[4], scale[3];
};

struct pen_pose_key {
	double time;
	struct pen_pose pose; /* channels a key leaves out are identity here: see pen_object_desc */
};

struct pen_mesh_key {
	double time;
	float *vertices; /* 3 * vertex_count */
};

enum pen_object_type { PEN_OBJECT_SPHERE, PEN_OBJECT_MESH, PEN_OBJECT_INSTANCE };

#define PEN_NO_INDEX UINT32_MAX

/*
 * World = transform * pose(t) * own coordinates, where pose(t) interpolates keys (position and
 * scale linearly, rotation by shortest-arc slerp; held before the first and after the last) and is
 * the identity without keys. An instance replaces the transform and keys of the object it is of
 * by its own (the original's own are part of "own coordinates" only for its geometry, not its
 * placement) and uses its own material where it has one.
 */
struct pen_object_desc {
	enum pen_object_type type;
	const char *name;  /* NULL without one */
	uint32_t material; /* index; PEN_NO_INDEX: an instance that keeps the original's */
	bool visible;	   /* false: renders only through its instances */
	struct pen_pose transform;
	struct pen_pose_key *keys; /* strictly rising times */
	uint32_t key_count;
	union {
		struct {
			double center[3];
			double radius;
		} sphere;
		struct {
			float *vertices;   /* 3 * vertex_count */
			uint32_t *indices; /* 3 * triangle_count, each < vertex_count */
			float *normals;	   /* 3 * vertex_count, or NULL: flat */
			float *uvs;	   /* 2 * vertex_count, or NULL */
			uint32_t vertex_count, triangle_count;
			struct pen_mesh_key
				*keys; /* deformation; then vertices = keys[0].vertices */
			uint32_t key_count;
		} mesh;
		struct {
			uint32_t of; /* index of a sphere or mesh object */
		} instance;
	} u;
};

enum pen_light_type {
	PEN_LIGHT_RECTANGLE,
	PEN_LIGHT_TRIANGLE,
	PEN_LIGHT_DISK,
	PEN_LIGHT_SPHERE,
	PEN_LIGHT_POINT,
	PEN_LIGHT_SPOT,
	PEN_LIGHT_DIRECTIONAL
};

struct pen_light_desc {
	enum pen_light_type type;
	bool visible; /* false: neither seen nor blocking; always false for the last three types */
	double color[3]; /* radiance; intensity of point and spot; irradiance of directional */
	union {
		struct {
			double corner[3], edge_u[3], edge_v[3]; /* edges perpendicular */
		} rectangle;
		struct {
			double vertices[3][3];
		} triangle;
		struct {
			double center[3], normal[3]; /* unit normal */
			double radius;
		} disk;
		struct {
			double center[3];
			double radius;
		} sphere;
		struct {
			double position[3];
		} point;
		struct {
			double position[3], direction[3]; /* unit */
			double cone_angle;		  /* full angle of the cone */
			double blend; /* 0..1: share of the cone that fades out */
		} spot;
		struct {
			double direction[3]; /* unit, the way the light travels */
			double angle;	     /* angular diameter; 0 = a delta */
		} directional;
	} u;
};

struct pen_scene {
	struct pen_arena arena;
	struct pen_image_desc image;
	struct pen_camera_desc camera;
	struct pen_integrator_desc integrator;
	struct pen_sampling_desc sampling;
	double background[3];
	struct pen_material_desc *materials;
	uint32_t material_count;
	struct pen_object_desc *objects;
	uint32_t object_count;
	struct pen_light_desc *lights;
	uint32_t light_count;
};

#endif
