/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/format.h"

#include "core/scene/asset.h"
#include "core/scene/check.h"
#include "core/scene/row.h"

#include <string.h>

static const struct pen_range pen_range_pixels = {1, PEN_IMAGE_SIDE_MAX};
static const struct pen_range pen_range_support = {0.01, PEN_FILTER_WIDTH_MAX};
static const struct pen_range pen_range_stops = {-64, 64};
static const struct pen_range pen_range_field_of_view = {0.01, 179};
static const struct pen_range pen_range_blades = {0, PEN_BLADES_MAX};
static const struct pen_range pen_range_depth = {1, PEN_DEPTH_MAX};
static const struct pen_range pen_range_whitted_depth = {1, PEN_WHITTED_DEPTH_MAX};
static const struct pen_range pen_range_sample_count = {1, PEN_SAMPLES_MAX};
static const struct pen_range pen_range_seed = {0, UINT32_MAX};
static const struct pen_range pen_range_distance = {0, 2}; /* black to white is sqrt(3) */
static const struct pen_range pen_range_error = {1e-6, 1};
static const struct pen_range pen_range_confidence = {0.5, 0.999999};
static const struct pen_range pen_range_pattern = {1, PEN_PATTERN_MAX};
static const struct pen_range pen_range_frame = {0, PEN_FRAME_NUMBER_MAX};
static const struct pen_range pen_range_rate = {PEN_FRAME_RATE_MIN, PEN_FRAME_RATE_MAX};

/* Image */

static const struct pen_field box_fields[] = {
	{NUMBER("width", image_desc, filter_width, support, "1")},
	{0},
};
static const struct pen_field triangle_filter_fields[] = {
	{NUMBER("width", image_desc, filter_width, support, "2")},
	{0},
};
static const struct pen_field gaussian_fields[] = {
	{NUMBER("width", image_desc, filter_width, support, "3")},
	{0},
};
static const struct pen_field mitchell_fields[] = {
	{NUMBER("width", image_desc, filter_width, support, "4")},
	{0},
};
static const struct pen_table box_table = {box_fields, NULL};
static const struct pen_table triangle_filter_table = {triangle_filter_fields, NULL};
static const struct pen_table gaussian_table = {gaussian_fields, NULL};
static const struct pen_table mitchell_table = {mitchell_fields, NULL};
static const struct pen_variant filter_types[] = {
	{"box", PEN_FILTER_BOX, &box_table},
	{"triangle", PEN_FILTER_TRIANGLE, &triangle_filter_table},
	{"gaussian", PEN_FILTER_GAUSSIAN, &gaussian_table},
	{"blackman-harris", PEN_FILTER_BLACKMAN_HARRIS, &gaussian_table},
	{"mitchell", PEN_FILTER_MITCHELL, &mitchell_table},
	{0},
};
static const struct pen_variants filter = {
	"type", "gaussian", OF(image_desc, filter), filter_types};

static void read_crop(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	static const struct pen_range edge = {0, PEN_IMAGE_SIDE_MAX};
	struct pen_rect *crop = desc;
	uint32_t *edges[] = {&crop->x0, &crop->y0, &crop->x1, &crop->y1};

	if (!json_is_array(value) || json_array_size(value) != 4) {
		pen_reader_refuse(reader, at, "must be an array of 4 whole numbers");
		return;
	}
	for (size_t i = 0; i < 4; i++) {
		struct pen_place element = pen_place_element(at, i);

		(void)pen_integer_read(reader, &element, json_array_get(value, i), edge, edges[i]);
	}
}

static const char *const aov_names[] = {"albedo", "normal", "depth", "samples"};

/* The layer of a name, or 0. */
static uint32_t find_aov(const json_t *value)
{
	for (size_t i = 0; json_is_string(value) && i < sizeof aov_names / sizeof *aov_names; i++)
		if (strcmp(aov_names[i], json_string_value(value)) == 0)
			return 1u << i;
	return 0;
}

/* Their order means nothing: the tree gets them in ours. */
static void sort_aovs(struct pen_reader *reader, json_t *array, uint32_t aovs)
{
	json_array_clear(array);
	for (size_t i = 0; i < sizeof aov_names / sizeof *aov_names; i++)
		if (aovs >> i & 1 && json_array_append_new(array, json_string(aov_names[i])) < 0)
			reader->out_of_memory = true;
}

static void read_aovs(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	const size_t found = reader->found;
	uint32_t *aovs = desc;

	if (!json_is_array(value)) {
		pen_reader_refuse(reader, at, "must be an array");
		return;
	}
	for (size_t i = 0; i < json_array_size(value); i++) {
		struct pen_place element = pen_place_element(at, i);
		const uint32_t aov = find_aov(json_array_get(value, i));

		if (aov == 0)
			pen_reader_refuse(
				reader, &element, "must be one of albedo, normal, depth, samples");
		else if (*aovs & aov)
			pen_reader_refuse(reader, &element, "stands here already");
		*aovs |= aov;
	}
	if (reader->found == found)
		sort_aovs(reader, value, *aovs);
}

static const struct pen_field image_fields[] = {
	{INTEGER("width", image_desc, width, pixels, PEN_REQUIRED)},
	{INTEGER("height", image_desc, height, pixels, PEN_REQUIRED)},
	{VARIANT("filter", 0, filter, "{}")},
	{READ("crop", OF(image_desc, crop), read_crop, PEN_ABSENT)},
	{NUMBER("exposure", image_desc, exposure, stops, "0")},
	{READ("aovs", OF(image_desc, aovs), read_aovs, "[]")},
	{0},
};
static const struct pen_table image_table = {image_fields, pen_check_image};

/* Camera */

static const struct pen_field shutter_fields[] = {
	{NUMBER("open", camera_desc, shutter_open, instant, "0")},
	{NUMBER("close", camera_desc, shutter_close, instant, "0")},
	{0},
};
static const struct pen_table shutter_table = {shutter_fields, pen_check_shutter};

static const struct pen_field camera_key_fields[] = {
	{NUMBER("time", camera_key, time, instant, PEN_REQUIRED)},
	{VECTOR3("position", camera_key, position, world, PEN_ABSENT)},
	{VECTOR3("look_at", camera_key, look_at, world, PEN_ABSENT)},
	{VECTOR3("up", camera_key, up, world, PEN_ABSENT)},
	{0},
};
static const struct pen_table camera_key_table = {camera_key_fields, NULL};
static const struct pen_list camera_keys = {sizeof(struct pen_camera_key), PEN_KEYFRAMES_MAX,
	OF(camera_desc, key_count), &camera_key_table, NULL, NULL};

static const struct pen_variant focal_surfaces[] = {
	{"plane", PEN_FOCAL_PLANE, NULL},
	{"sphere", PEN_FOCAL_SPHERE, NULL},
	{0},
};

static const struct pen_field camera_fields[] = {
	{TEXT("from", camera_desc, from, PEN_ABSENT)},
	{VECTOR3("position", camera_desc, position, world, PEN_ABSENT)},
	{VECTOR3("look_at", camera_desc, look_at, world, PEN_ABSENT)},
	{VECTOR3("up", camera_desc, up, world, PEN_ABSENT)},
	{NUMBER("horizontal_fov", camera_desc, horizontal_fov, field_of_view, PEN_ABSENT)},
	{NUMBER("aperture_radius", camera_desc, aperture_radius, magnitude, "0")},
	{NUMBER("focus_distance", camera_desc, focus_distance, positive, PEN_ABSENT)},
	{CHOICE("focal_surface", camera_desc, focal_surface, focal_surfaces, "\"plane\"")},
	{INTEGER("blades", camera_desc, blades, blades, "0")},
	{NUMBER("blade_rotation", camera_desc, blade_rotation, turn, "0")},
	{TABLE("shutter", 0, shutter_table, PEN_ABSENT)},
	{LIST("keyframes", camera_desc, keys, camera_keys, "[]")},
	{0},
};
static const struct pen_table camera_table = {camera_fields, pen_check_camera};

/* Integrator, sampling, background, frames */

static const struct pen_field integrator_fields[] = {
	{INTEGER("max_depth", integrator_desc, max_depth, depth, "6")},
	{0},
};
static const struct pen_field whitted_fields[] = {
	{INTEGER("max_depth", integrator_desc, max_depth, whitted_depth, "6")},
	{0},
};
static const struct pen_table integrator_table = {integrator_fields, NULL};
static const struct pen_table whitted_table = {whitted_fields, NULL};
static const struct pen_variant integrator_types[] = {
	{"distribution", PEN_INTEGRATOR_DISTRIBUTION, &integrator_table},
	{"whitted", PEN_INTEGRATOR_WHITTED, &whitted_table},
	{"path", PEN_INTEGRATOR_PATH, &integrator_table},
	{0},
};
static const struct pen_variants integrator = {
	"type", "distribution", OF(integrator_desc, type), integrator_types};

static const struct pen_variant sequences[] = {
	{"sobol", PEN_SEQUENCE_SOBOL, NULL},
	{"jittered", PEN_SEQUENCE_JITTERED, NULL},
	{"random", PEN_SEQUENCE_RANDOM, NULL},
	{0},
};
/* clang-format off */
#define SAMPLING_ROWS \
	{INTEGER("samples", sampling_desc, samples, sample_count, "64")}, \
	{CHOICE("sequence", sampling_desc, sequence, sequences, "\"sobol\"")}, \
	{INTEGER("seed", sampling_desc, seed, seed, "0")}
/* clang-format on */

static const struct pen_field uniform_fields[] = {
	SAMPLING_ROWS,
	{0},
};
static const struct pen_field edge_fields[] = {
	SAMPLING_ROWS,
	{NUMBER("threshold", sampling_desc, threshold, distance, "0.1")},
	{0},
};
static const struct pen_field adaptive_fields[] = {
	SAMPLING_ROWS,
	{NUMBER("error", sampling_desc, error, error, "0.01")},
	{NUMBER("confidence", sampling_desc, confidence, confidence, "0.95")},
	{INTEGER("min_samples", sampling_desc, min_samples, sample_count, PEN_ABSENT)},
	{0},
};
static const struct pen_field interleaved_fields[] = {
	SAMPLING_ROWS,
	{INTEGER("pattern", sampling_desc, pattern, pattern, "3")},
	{0},
};
static const struct pen_table uniform_table = {uniform_fields, NULL};
static const struct pen_table edge_table = {edge_fields, NULL};
static const struct pen_table adaptive_table = {adaptive_fields, pen_check_adaptive};
static const struct pen_table interleaved_table = {interleaved_fields, NULL};
static const struct pen_variant sampling_modes[] = {
	{"uniform", PEN_SAMPLING_UNIFORM, &uniform_table},
	{"edge", PEN_SAMPLING_EDGE, &edge_table},
	{"adaptive", PEN_SAMPLING_ADAPTIVE, &adaptive_table},
	{"interleaved", PEN_SAMPLING_INTERLEAVED, &interleaved_table},
	{0},
};
static const struct pen_variants sampling = {
	"mode", "uniform", OF(sampling_desc, mode), sampling_modes};

static const struct pen_field background_fields[] = {
	{VECTOR3("color", background_desc, color, magnitude, PEN_ABSENT)},
	{READ("image", OF(background_desc, picture), pen_picture_read, PEN_ABSENT)},
	{NUMBER("intensity", background_desc, intensity, magnitude, PEN_ABSENT)},
	{NUMBER("rotation", background_desc, rotation, turn, PEN_ABSENT)},
	{0},
};
static const struct pen_table background_table = {background_fields, pen_check_background};

static const struct pen_field frames_fields[] = {
	{INTEGER("first", frames_desc, first, frame, "1")},
	{INTEGER("last", frames_desc, last, frame, PEN_REQUIRED)},
	{NUMBER("fps", frames_desc, fps, rate, "24")},
	{0},
};
static const struct pen_table frames_table = {frames_fields, pen_check_frames};

/* The scene */

static void read_version(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	static const struct pen_range only = {1, 1};
	uint32_t version;

	(void)desc;
	(void)pen_integer_read(reader, at, value, only, &version);
}

static const struct pen_field scene_fields[] = {
	{READ("version", 0, read_version, PEN_REQUIRED)},
	{TABLE("image", OF(scene, image), image_table, PEN_REQUIRED)},
	{TABLE("camera", OF(scene, camera), camera_table, "{}")},
	{VARIANT("integrator", OF(scene, integrator), integrator, "{}")},
	{VARIANT("sampling", OF(scene, sampling), sampling, "{}")},
	{TABLE("background", OF(scene, background), background_table, "{}")},
	{READ("textures", 0, pen_format_read_textures, "{}")},
	{READ("materials", 0, pen_format_read_materials, "{}")},
	{LIST("objects", scene, objects, pen_format_objects, "[]")},
	{LIST("lights", scene, lights, pen_format_lights, "[]")},
	{TABLE("frames", OF(scene, frames), frames_table, PEN_ABSENT)},
	{0},
};
const struct pen_table pen_format_scene = {scene_fields, NULL};
