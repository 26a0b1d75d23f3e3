/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_DESC_H
#define PEN_SCENE_DESC_H

#include "core/base/arena.h"
#include "core/base/digest.h"
#include "core/base/rect.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * A scene as plain data: what a valid scene text says, with every default filled in and every
 * name resolved to an index. Made by pen_scene_parse; pen_scene_expand then puts what its glTF
 * assets hold in the place of the glTF objects; never changed afterwards. All memory is the
 * scene's arena, but for what is said to lie in an asset. Right-handed, Y up; lengths in world
 * units, angles in degrees, times in seconds, linear Rec. 709 RGB, radiance in W/(sr m^2),
 * quaternions x y z w (normalised here).
 */

#define PEN_NO_INDEX UINT32_MAX

/* A file that the scene refers to; one entry for each place that does. */
struct pen_asset_desc {
	struct pen_sha256 sha256;
	const char *pointer; /* JSON pointer of that place */
};

/* The bytes of an asset. */
struct pen_blob {
	const void *bytes;
	size_t size;
};

/* An encoded image: a whole asset, or a piece of a glTF's. */
struct pen_picture_desc {
	const char *pointer; /* JSON pointer of the texture, background or glTF object it is of */
	const char *place;   /* within a glTF, for people: "image 3 \"bark\""; "" otherwise */
	uint32_t asset;
	size_t offset, size; /* within the asset; size 0: all of it */
	const void *bytes; /* NULL, or where its size bytes are if they stand in no asset as such */
};

enum pen_wrap { PEN_WRAP_REPEAT, PEN_WRAP_MIRROR, PEN_WRAP_CLAMP };

struct pen_texture_desc {
	const char *name; /* of the text; NULL: of a glTF */
	uint32_t picture;
	bool is_srgb; /* colours are sRGB-encoded; alpha never is */
	enum pen_wrap wrap_u, wrap_v;
	bool is_encoded; /* sRGB values are interpolated, and not the light they stand for */
	bool is_nearest; /* texels are not interpolated where they are larger than pixels */
};

/* A moving value: of translation and scale 3 numbers a key, of rotation 4, of weights any number.
 */
enum pen_interpolation {
	PEN_INTERPOLATION_STEP,
	PEN_INTERPOLATION_LINEAR,
	PEN_INTERPOLATION_CUBIC
};

struct pen_track {
	enum pen_interpolation interpolation;
	uint32_t key_count;  /* 0: the value stands still */
	const float *times;  /* seconds, strictly rising */
	const float *values; /* cubic: in-tangent, value and out-tangent of each key, as in glTF */
};

/* World = translate * rotate * scale * own coordinates. */
struct pen_pose {
	double translate[3], rotate[4], scale[3];
};

/*
 * A frame of reference: parent's coordinates = pose * own coordinates. A node with a matrix has no
 * tracks. Each stands behind its parent.
 */
struct pen_node_desc {
	uint32_t parent; /* PEN_NO_INDEX: the world */
	bool has_matrix;
	double matrix[3][4];
	struct pen_pose pose; /* the values of channels without keys */
	struct pen_track translation, rotation, scale;
};

/* Own coordinates of a skinned mesh reach the world by way of its joints alone. */
struct pen_skin_desc {
	uint32_t joint_count;
	const uint32_t *joints;		    /* nodes */
	const double (*inverse_bind)[3][4]; /* one a joint */
};

enum pen_aov {
	PEN_AOV_ALBEDO = 1 << 0,
	PEN_AOV_NORMAL = 1 << 1,
	PEN_AOV_DEPTH = 1 << 2,
	PEN_AOV_SAMPLES = 1 << 3
};

enum pen_filter_type {
	PEN_FILTER_BOX,
	PEN_FILTER_TRIANGLE,
	PEN_FILTER_GAUSSIAN, /* sigma = width / 6 */
	PEN_FILTER_BLACKMAN_HARRIS,
	PEN_FILTER_MITCHELL, /* B = C = 1/3 */
	PEN_FILTER_COUNT
};

struct pen_image_desc {
	uint32_t width, height; /* pixels */
	enum pen_filter_type filter;
	double filter_width; /* full support, pixels */
	struct pen_rect crop;
	double exposure; /* stops, for PNG and JPEG */
	uint32_t aovs;	 /* enum pen_aov */
};

enum pen_focal_surface { PEN_FOCAL_PLANE, PEN_FOCAL_SPHERE };

struct pen_camera_key {
	double time;
	double position[3], look_at[3], up[3];
};

/*
 * What the text says of the camera itself: it goes before what a glTF camera says. When it says
 * nothing, or the focus alone, and names no camera either, the first glTF camera is meant.
 */
enum pen_camera_given {
	PEN_CAMERA_POSITION = 1 << 0,
	PEN_CAMERA_LOOK_AT = 1 << 1,
	PEN_CAMERA_UP = 1 << 2,
	PEN_CAMERA_FOV = 1 << 3,
	PEN_CAMERA_FOCUS = 1 << 4,
	PEN_CAMERA_KEYS = 1 << 5
};

struct pen_camera_desc {
	const char *from; /* a glTF camera's name, or NULL; pen_scene_expand looks it up */
	uint32_t given;	  /* enum pen_camera_given */
	/* Of a glTF camera: position and axes (it looks along -Z, up is Y) are those of a node. */
	uint32_t node;		   /* PEN_NO_INDEX: those below */
	double orthographic_width; /* > 0: parallel rays; what the image's width shows */
	double position[3], look_at[3], up[3];
	double horizontal_fov;
	double aperture_radius; /* 0 = pinhole */
	double focus_distance;
	enum pen_focal_surface focal_surface;
	uint32_t blades; /* 0 = round, else >= 3 */
	double blade_rotation;
	double shutter_open, shutter_close; /* relative to the frame's time; equal = an instant */
	struct pen_camera_key *keys;	    /* strictly rising times; each key complete */
	uint32_t key_count;		    /* 0 = position, look_at and up above hold always */
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

enum pen_sampling_mode {
	PEN_SAMPLING_UNIFORM,
	PEN_SAMPLING_EDGE,
	PEN_SAMPLING_ADAPTIVE,
	PEN_SAMPLING_INTERLEAVED
};

struct pen_sampling_desc {
	enum pen_sampling_mode mode;
	double threshold;	  /* edge */
	double error, confidence; /* adaptive */
	uint32_t min_samples;	  /* adaptive */
	uint32_t pattern;	  /* interleaved: side of the block of pixels */
	uint32_t samples;	  /* per pixel; of adaptive and edge: at most */
	enum pen_sequence sequence;
	uint32_t seed;
};

enum pen_material_type {
	PEN_MATERIAL_MATTE,
	PEN_MATERIAL_GLOSSY,
	PEN_MATERIAL_GLASS,
	PEN_MATERIAL_PRINCIPLED /* glTF 2.0's metallic-roughness model with its extensions */
};

/* What a texture can give; it multiplies the number or colour beside it. */
enum pen_input {
	PEN_INPUT_COLOR, /* with alpha */
	PEN_INPUT_METALLIC,
	PEN_INPUT_ROUGHNESS,
	PEN_INPUT_NORMAL, /* tangent space, as in glTF */
	PEN_INPUT_EMISSION,
	PEN_INPUT_TRANSMISSION,
	PEN_INPUT_CLEARCOAT,
	PEN_INPUT_CLEARCOAT_ROUGHNESS,
	PEN_INPUT_CLEARCOAT_NORMAL,
	PEN_INPUT_COUNT
};

struct pen_input_desc {
	uint32_t texture; /* PEN_NO_INDEX: none */
	uint32_t channel; /* 0..3 = r g b a, of a number */
	uint32_t uv_set;  /* 0 or 1 */
	double uv[2][3];  /* texture's from the mesh's uv, as KHR_texture_transform says */
};

/* What becomes of a surface whose alpha is below 1. */
enum pen_alpha_mode {
	PEN_ALPHA_OPAQUE, /* alpha counts for nothing */
	PEN_ALPHA_MASK,	  /* nothing is there where alpha < alpha_cutoff */
	PEN_ALPHA_BLEND	  /* alpha is the chance that anything is there */
};

struct pen_material_desc {
	const char *name;
	enum pen_material_type type;
	double color[3];  /* principled: base colour */
	double roughness; /* alpha = roughness^2; 0 = perfectly smooth */
	double ior;	  /* glass, principled */
	/* principled */
	double metallic, transmission;
	double clearcoat, clearcoat_roughness;
	double emission[3]; /* radiance, emissive strength included */
	double opacity;	    /* alpha of the base colour */
	enum pen_alpha_mode alpha_mode;
	double alpha_cutoff;
	double normal_scale, clearcoat_normal_scale;
	bool is_one_sided; /* seen and lit from its front only: glTF's, unless doubleSided */
	bool is_additive;  /* principled as Blender 3 has it, see core/render/principled.h */
	bool is_unlit;	   /* shows its colour as it is, and neither casts nor takes light */
	struct pen_input_desc inputs[PEN_INPUT_COUNT];
};

struct pen_pose_key {
	double time;
	struct pen_pose pose; /* channels a key leaves out are identity here: see pen_object_desc */
};

struct pen_mesh_key {
	double time;
	float *vertices; /* 3 * vertex_count */
};

/* Morph targets and skin of a mesh: v = skin(vertices + sum of weight * morph). */
struct pen_deform_desc {
	uint32_t morph_count;
	const float *morph_vertices; /* 3 * vertex_count each */
	const float *morph_normals;  /* the same, or NULL */
	const double *morph_weights; /* that hold without a track */
	struct pen_track weights;    /* morph_count numbers a key */
	uint32_t skin;		     /* PEN_NO_INDEX: none */
	uint32_t influence_count;    /* joints a vertex */
	const uint16_t *joints;	     /* influence_count a vertex, of the skin */
	const float *influences;     /* their weights, of sum 1 */
};

enum pen_object_type {
	PEN_OBJECT_SPHERE,
	PEN_OBJECT_MESH,
	PEN_OBJECT_INSTANCE,
	PEN_OBJECT_GLTF /* never after pen_scene_expand; an instance of one is a copy of its nodes
			 */
};

/*
 * World = transform * pose(t) * own coordinates, where pose(t) interpolates keys (position and
 * scale linearly, rotation by shortest-arc slerp; held before the first and after the last) and is
 * the identity without keys; or, of what comes from a glTF, the world from its node's coordinates
 * (the glTF object's own transform and keys are nodes then), or from its skin. An instance replaces
 * the transform and keys of the object it is of by its own (the original's own are part of "own
 * coordinates" only for its geometry, not its placement) and uses its own material where it has
 * one.
 */
struct pen_object_desc {
	enum pen_object_type type;
	const char *name;  /* NULL without one */
	uint32_t material; /* index; PEN_NO_INDEX: an instance that keeps the original's */
	bool visible;	   /* false: renders only through its instances */
	struct pen_pose transform;
	struct pen_pose_key *keys; /* strictly rising times */
	uint32_t key_count;
	uint32_t node; /* then transform and keys count for nothing; PEN_NO_INDEX: they do */
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
			float *uvs_1;	   /* the second set, likewise */
			float *colors; /* 4 * vertex_count, linear, multiply the material's; or NULL
					*/
			float *tangents; /* 4 * vertex_count, as in glTF, or NULL: from the uvs */
			uint32_t vertex_count, triangle_count;
			struct pen_mesh_key
				*keys; /* deformation; then vertices = keys[0].vertices */
			uint32_t key_count;
			const struct pen_deform_desc *deform; /* NULL without; then no keys */
		} mesh;
		struct {
			uint32_t asset;
		} gltf;
		struct {
			uint32_t of; /* index of a sphere, mesh or (before pen_scene_expand) glTF */
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
	uint32_t node;	 /* whose coordinates it is in when the shutter opens; PEN_NO_INDEX: the
			    world's */
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

struct pen_background_desc {
	double color[3];
	uint32_t picture; /* latitude-longitude; PEN_NO_INDEX: the color is all there is */
	double intensity; /* multiplies the picture */
	double rotation;  /* degrees about Y, counter-clockwise seen from above */
};

/* Frame n's time is (n - 1) / fps; without an animation there is frame 1 alone, at time 0. */
struct pen_frames_desc {
	uint32_t first, last;
	double fps;
};

struct pen_scene {
	struct pen_arena arena;
	struct pen_image_desc image;
	struct pen_camera_desc camera;
	struct pen_integrator_desc integrator;
	struct pen_sampling_desc sampling;
	struct pen_background_desc background;
	struct pen_frames_desc frames;
	struct pen_asset_desc *assets;
	uint32_t asset_count;
	struct pen_picture_desc *pictures;
	uint32_t picture_count;
	struct pen_texture_desc *textures;
	uint32_t texture_count;
	struct pen_material_desc *materials;
	uint32_t material_count;
	struct pen_object_desc *objects;
	uint32_t object_count;
	struct pen_light_desc *lights;
	uint32_t light_count;
	struct pen_node_desc *nodes;
	uint32_t node_count;
	struct pen_skin_desc *skins;
	uint32_t skin_count;
	const char **warnings; /* for people: what of its assets is left out */
	uint32_t warning_count;
};

#endif
