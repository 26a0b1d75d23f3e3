/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_GLTF_MODEL_H
#define PEN_SCENE_GLTF_MODEL_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 * The text of a glTF 2.0 asset as plain data, read by tinygltf behind a C face: no exception passes
 * it, no file is opened, no image decoded. Nothing here is checked but its JSON type: indices may
 * point anywhere (negative: absent), numbers may be anything. Names are never NULL.
 */

struct pen_gltf_bytes {
	const void *bytes;
	size_t size;
	size_t offset; /* within the asset, of a GLB's own buffer; else SIZE_MAX */
};

struct pen_gltf_view {
	int buffer;
	size_t offset, size, stride;
};

/* Component types and modes are numbered as in glTF. */
struct pen_gltf_accessor {
	int view; /* negative: zeros */
	size_t offset, count;
	int component;
	uint32_t width; /* components an element: 1 to 4, 9, 16 */
	bool is_matrix, normalized;
	bool is_sparse;
	int sparse_count;
	int index_view, index_offset, index_component;
	int value_view, value_offset;
};

struct pen_gltf_attribute {
	const char *name;
	int accessor;
};

struct pen_gltf_attributes {
	const struct pen_gltf_attribute *items;
	size_t count;
};

struct pen_gltf_primitive {
	struct pen_gltf_attributes attributes;
	const struct pen_gltf_attributes *targets;
	size_t target_count;
	int indices, material, mode;
};

struct pen_gltf_numbers {
	const double *items;
	size_t count;
};

struct pen_gltf_indices {
	const int *items;
	size_t count;
};

struct pen_gltf_mesh {
	const char *name;
	const struct pen_gltf_primitive *primitives;
	size_t primitive_count;
	struct pen_gltf_numbers weights;
};

struct pen_gltf_node {
	const char *name;
	int mesh, skin, camera, light;
	struct pen_gltf_indices children;
	struct pen_gltf_numbers matrix, translation, rotation, scale, weights;
};

struct pen_gltf_camera {
	const char *name;
	bool is_orthographic;
	double yfov, ymag; /* radians; half the height */
};

struct pen_gltf_light {
	const char *name, *type;
	struct pen_gltf_numbers color;
	double intensity;
	double inner_cone, outer_cone; /* radians from the axis */
};

struct pen_gltf_skin {
	const char *name;
	int inverse_bind;
	struct pen_gltf_indices joints;
};

struct pen_gltf_sampler {
	int input, output;
	const char *interpolation;
};

struct pen_gltf_channel {
	int sampler, node;
	const char *path;
};

struct pen_gltf_animation {
	const char *name;
	const struct pen_gltf_sampler *samplers;
	size_t sampler_count;
	const struct pen_gltf_channel *channels;
	size_t channel_count;
};

struct pen_gltf_image {
	const char *name;
	int view;	   /* negative: bytes */
	const void *bytes; /* of a data URI */
	size_t size;
};

struct pen_gltf_texture {
	int image;
	int wrap_s, wrap_t, mag_filter; /* as in glTF */
};

/* A material's use of a texture, with KHR_texture_transform. */
struct pen_gltf_texture_use {
	int texture; /* negative: none */
	int uv_set;
	double offset[2], rotation, scale[2];
};

struct pen_gltf_material {
	const char *name, *alpha_mode;
	struct pen_gltf_numbers base_color, emissive;
	double metallic, roughness, alpha_cutoff;
	double normal_scale, clearcoat_normal_scale;
	double ior, transmission, clearcoat, clearcoat_roughness, emissive_strength;
	double specular, specular_color[3];
	bool is_double_sided, is_unlit;
	struct pen_gltf_texture_use base_color_texture, metallic_roughness_texture, normal_texture,
		emissive_texture, transmission_texture, clearcoat_texture,
		clearcoat_roughness_texture, clearcoat_normal_texture, specular_texture,
		specular_color_texture;
};

struct pen_gltf_model {
	const struct pen_gltf_bytes *buffers;
	const struct pen_gltf_view *views;
	const struct pen_gltf_accessor *accessors;
	const struct pen_gltf_mesh *meshes;
	const struct pen_gltf_node *nodes;
	const struct pen_gltf_indices *scenes; /* root nodes */
	const struct pen_gltf_camera *cameras;
	const struct pen_gltf_light *lights;
	const struct pen_gltf_skin *skins;
	const struct pen_gltf_animation *animations;
	const struct pen_gltf_image *images;
	const struct pen_gltf_texture *textures;
	const struct pen_gltf_material *materials;
	const char *const *used, *const *required; /* extensions */
	size_t buffer_count, view_count, accessor_count, mesh_count, node_count, scene_count,
		camera_count, light_count, skin_count, animation_count, image_count, texture_count,
		material_count, used_count, required_count;
	int default_scene;
	const char *generator; /* the program that wrote the file; may be empty */
};

/* Whether an extension is supported: one that is required and is not is refused. */
bool pen_gltf_knows(const char *extension);

struct pen_gltf; /* owns what a model points to */

/*
 * Reads a GLB, or a .gltf whose buffers and images are data URIs. PEN_EINVALID, with a text for
 * people: not glTF 2.0, not whole, or it names files beside it (and those it names);
 * PEN_ELIMIT: larger than core/base/limits.h allows; PEN_ENOMEM. bytes must outlive it.
 */
int pen_gltf_create(
	const void *bytes, size_t size, struct pen_gltf **ret_gltf, struct pen_error *err);
void pen_gltf_destroy(struct pen_gltf *gltf);

const struct pen_gltf_model *pen_gltf_content(const struct pen_gltf *gltf);

#endif
