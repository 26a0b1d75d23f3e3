/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/check.h"

#include <math.h>
#include <string.h>

/* Below this a sine or cosine is taken for zero: directions in a line, edges at a right angle. */
#define ANGLE_EPSILON 1e-6

/* Vectors and quaternions that are shorter count as zero: their squares lose their digits. */
#define LENGTH_MIN 1e-15

static double dot(const double *a, const double *b)
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double length(const double *a)
{
	return sqrt(dot(a, a));
}

static void subtract(const double *a, const double *b, double *ret_difference)
{
	for (size_t i = 0; i < 3; i++)
		ret_difference[i] = a[i] - b[i];
}

static void cross(const double *a, const double *b, double *ret_product)
{
	for (size_t i = 0; i < 3; i++) {
		size_t j = (i + 1) % 3, k = (i + 2) % 3;

		ret_product[i] = a[j] * b[k] - a[k] * b[j];
	}
}

/* Whether two vectors lie in one line, as a zero vector does with any other. */
static bool collinear(const double *a, const double *b)
{
	double product[3], area = length(a) * length(b);

	cross(a, b, product);
	return length(a) < LENGTH_MIN || length(b) < LENGTH_MIN ||
	       length(product) <= ANGLE_EPSILON * area;
}

static bool normalise(double *vector)
{
	double size = length(vector);

	for (size_t i = 0; i < 3; i++)
		vector[i] /= size;
	return size >= LENGTH_MIN;
}

static void refuse_member(struct pen_reader *reader, const struct pen_place *at, json_t *object,
	const char *key, const char *detail)
{
	struct pen_place member = pen_place_member(at, object, key);

	pen_reader_refuse(reader, &member, "%s", detail);
}

void pen_check_image(
	struct pen_reader *reader, const struct pen_place *at, json_t *image, void *desc)
{
	struct pen_image_desc *d = desc;
	struct pen_rect full = {0, 0, d->width, d->height};

	if (pen_rect_area(full) > PEN_IMAGE_PIXELS_MAX) {
		pen_reader_refuse(
			reader, at, "must not have more than %u pixels", PEN_IMAGE_PIXELS_MAX);
		return;
	}
	if (!json_object_get(image, "crop")) {
		d->crop = full;
		pen_reader_fill(reader, image, "crop",
			json_pack("[i, i, i, i]", 0, 0, (int)d->width, (int)d->height));
	}
	if (!pen_rect_valid(d->crop) || !pen_rect_contains(full, d->crop))
		refuse_member(reader, at, image, "crop",
			"must be left, top, right, bottom of a rectangle within the image");
}

void pen_check_shutter(
	struct pen_reader *reader, const struct pen_place *at, json_t *shutter, void *camera_desc)
{
	const struct pen_camera_desc *d = camera_desc;

	if (d->shutter_close < d->shutter_open)
		refuse_member(reader, at, shutter, "close", "must not be before open");
}

/* Whether a camera can look from position to look_at with up upwards; at is where they stand. */
static void check_view(struct pen_reader *reader, const struct pen_place *at, json_t *view,
	const double *position, const double *look_at, const double *up)
{
	double direction[3];

	subtract(look_at, position, direction);
	if (length(direction) < LENGTH_MIN + 1e-12 * (length(position) + length(look_at)))
		refuse_member(reader, at, view, "look_at", "must differ from position");
	else if (collinear(direction, up))
		refuse_member(
			reader, at, view, "up", "must not be zero or along the view direction");
}

/* Right, up and back of a camera at a good view, as rows. */
static void camera_frame(const struct pen_camera_key *key, double ret_frame[3][3])
{
	subtract(key->position, key->look_at, ret_frame[2]);
	(void)normalise(ret_frame[2]);
	cross(key->up, ret_frame[2], ret_frame[0]);
	(void)normalise(ret_frame[0]);
	cross(ret_frame[2], ret_frame[0], ret_frame[1]);
}

/* Two orientations half a turn apart: the trace of the rotation between them is -1. */
static bool opposite_views(const struct pen_camera_key *a, const struct pen_camera_key *b)
{
	double from[3][3], to[3][3], trace = 0;

	camera_frame(a, from);
	camera_frame(b, to);
	for (size_t i = 0; i < 3; i++)
		trace += dot(from[i], to[i]);
	return trace + 1 < 4 * ANGLE_EPSILON * ANGLE_EPSILON;
}

/* A key takes what it leaves out from the camera, or from to, when that has a good default. */
static void inherit(struct pen_reader *reader, const struct pen_place *at, json_t *camera,
	json_t *key, const char *name, const double *from, double *to)
{
	json_t *value = json_object_get(camera, name);
	const struct pen_place member = pen_place_member(at, key, name);

	if (json_object_get(key, name))
		return;
	if (!value && strcmp(name, "up") != 0) {
		pen_reader_refuse(reader, &member,
			"is missing: the camera, which is from a glTF, has none that a key could "
			"take");
		return;
	}
	memcpy(to, from, 3 * sizeof *to);
	pen_reader_fill(reader, key, name,
		value ? json_incref(value) : json_pack("[f, f, f]", to[0], to[1], to[2]));
}

static void check_camera_keys(struct pen_reader *reader, const struct pen_place *at, json_t *camera,
	struct pen_camera_desc *d)
{
	struct pen_place place = pen_place_member(at, camera, "keyframes");
	json_t *list = json_object_get(camera, "keyframes");
	size_t found = reader->found;

	for (uint32_t i = 0; i < d->key_count; i++) {
		struct pen_place element = pen_place_element(&place, i);
		json_t *key = json_array_get(list, i);
		struct pen_camera_key *k = &d->keys[i];

		inherit(reader, &element, camera, key, "position", d->position, k->position);
		inherit(reader, &element, camera, key, "look_at", d->look_at, k->look_at);
		inherit(reader, &element, camera, key, "up", d->up, k->up);
		if (reader->found > found)
			continue;
		check_view(reader, &element, key, k->position, k->look_at, k->up);
	}
	pen_check_times(reader, &place, list, d->keys, sizeof *d->keys);
	for (uint32_t i = 1; reader->found == found && i < d->key_count; i++) {
		struct pen_place element = pen_place_element(&place, i);

		if (opposite_views(&d->keys[i - 1], &d->keys[i]))
			pen_reader_refuse(reader, &element,
				"must not turn the view by 180 degrees from the key before: "
				"put a key between");
	}
}

static const struct camera_default {
	const char *key;
	enum pen_camera_given bit;
	size_t offset;
	size_t count;
	double value[3];
} camera_defaults[] = {
	{"position", PEN_CAMERA_POSITION, offsetof(struct pen_camera_desc, position), 3,
		{0, 2, 10}},
	{"look_at", PEN_CAMERA_LOOK_AT, offsetof(struct pen_camera_desc, look_at), 3, {0, 0, 0}},
	{"up", PEN_CAMERA_UP, offsetof(struct pen_camera_desc, up), 3, {0, 1, 0}},
	{"horizontal_fov", PEN_CAMERA_FOV, offsetof(struct pen_camera_desc, horizontal_fov), 1,
		{50}},
};

enum { CAMERA_DEFAULTS = sizeof camera_defaults / sizeof *camera_defaults };

/* What the tree's camera says of itself. */
static uint32_t find_given(const json_t *camera)
{
	uint32_t given = json_object_get(camera, "focus_distance") ? PEN_CAMERA_FOCUS : 0;

	for (size_t i = 0; i < CAMERA_DEFAULTS; i++)
		if (json_object_get(camera, camera_defaults[i].key))
			given |= camera_defaults[i].bit;
	if (json_array_size(json_object_get(camera, "keyframes")) > 0)
		given |= PEN_CAMERA_KEYS;
	return given;
}

static void complete_camera(
	struct pen_reader *reader, json_t *camera, bool is_of_gltf, struct pen_camera_desc *d)
{
	double view[3];

	for (size_t i = 0; i < CAMERA_DEFAULTS; i++) {
		const struct camera_default *def = &camera_defaults[i];
		const double *v = def->value;

		if (d->given & def->bit)
			continue;
		memcpy((char *)d + def->offset, v, def->count * sizeof *v);
		if (!is_of_gltf)
			pen_reader_fill(reader, camera, def->key,
				def->count == 1 ? json_real(v[0])
						: json_pack("[f, f, f]", v[0], v[1], v[2]));
	}
	if (d->given & PEN_CAMERA_FOCUS)
		return;
	subtract(d->look_at, d->position, view);
	d->focus_distance = fmin(length(view), PEN_COORDINATE_MAX);
	if (!is_of_gltf)
		pen_reader_fill(reader, camera, "focus_distance", json_real(d->focus_distance));
}

void pen_check_camera(
	struct pen_reader *reader, const struct pen_place *at, json_t *camera, void *desc)
{
	const uint32_t view = PEN_CAMERA_POSITION | PEN_CAMERA_LOOK_AT;
	struct pen_camera_desc *d = desc;
	bool is_of_gltf;

	d->given = find_given(camera);
	is_of_gltf =
		d->from || (reader->has_gltf && (d->given | PEN_CAMERA_FOCUS) == PEN_CAMERA_FOCUS);
	if (d->from && !reader->has_gltf)
		refuse_member(reader, at, camera, "from",
			"names a camera of a glTF, but no object of this scene is one");
	if (d->blades == 1 || d->blades == 2)
		refuse_member(reader, at, camera, "blades", "must be 0, or 3 and more");
	complete_camera(reader, camera, is_of_gltf, d);
	d->given = find_given(camera);
	if ((d->given & view) == view)
		check_view(reader, at, camera, d->position, d->look_at, d->up);
	check_camera_keys(reader, at, camera, d);
}

void pen_check_adaptive(
	struct pen_reader *reader, const struct pen_place *at, json_t *sampling, void *desc)
{
	static const uint32_t usual = 16;
	struct pen_sampling_desc *d = desc;

	if (!json_object_get(sampling, "min_samples")) {
		d->min_samples = d->samples < usual ? d->samples : usual;
		pen_reader_fill(
			reader, sampling, "min_samples", json_integer((json_int_t)d->min_samples));
	}
	if (d->min_samples > d->samples)
		refuse_member(reader, at, sampling, "min_samples", "must not be more than samples");
}

void pen_check_background(
	struct pen_reader *reader, const struct pen_place *at, json_t *background, void *desc)
{
	struct pen_background_desc *d = desc;
	const bool has_image = d->picture != PEN_NO_INDEX;

	if (has_image && json_object_get(background, "color"))
		refuse_member(reader, at, background, "color",
			"is of a background without an image: leave out one of them");
	if (!has_image && json_object_get(background, "intensity"))
		refuse_member(
			reader, at, background, "intensity", "is of an image, and there is none");
	if (!has_image && json_object_get(background, "rotation"))
		refuse_member(
			reader, at, background, "rotation", "is of an image, and there is none");
	if (!has_image) {
		if (!json_object_get(background, "color"))
			pen_reader_fill(
				reader, background, "color", json_pack("[i, i, i]", 0, 0, 0));
		return;
	}
	if (!json_object_get(background, "intensity")) {
		d->intensity = 1;
		pen_reader_fill(reader, background, "intensity", json_integer(1));
	}
	if (!json_object_get(background, "rotation"))
		pen_reader_fill(reader, background, "rotation", json_integer(0));
}

void pen_check_frames(
	struct pen_reader *reader, const struct pen_place *at, json_t *frames, void *desc)
{
	const struct pen_frames_desc *d = desc;

	if (d->last < d->first)
		refuse_member(reader, at, frames, "last", "must not be before first");
	else if (d->last - d->first >= PEN_FRAMES_MAX)
		pen_reader_refuse(reader, at, "must not be more than %u frames", PEN_FRAMES_MAX);
	else if (d->last > 1 + PEN_TIME_MAX * d->fps)
		refuse_member(
			reader, at, frames, "fps", "must be higher: the last frame is past 1e6 s");
}

void pen_check_pose(struct pen_reader *reader, const struct pen_place *at, json_t *pose, void *desc)
{
	struct pen_pose *d = desc;
	double size = sqrt(dot(d->rotate, d->rotate) + d->rotate[3] * d->rotate[3]);
	bool singular = false;

	for (size_t i = 0; i < 4; i++)
		d->rotate[i] /= size;
	if (!(size >= LENGTH_MIN))
		refuse_member(reader, at, pose, "rotate", "must not be zero");
	for (size_t i = 0; i < 3; i++)
		singular |= fabs(d->scale[i]) < PEN_SCALE_MIN;
	if (singular)
		refuse_member(reader, at, pose, "scale",
			"must not be smaller than 1e-6 in any direction");
}

void pen_check_pose_key(
	struct pen_reader *reader, const struct pen_place *at, json_t *key, void *desc)
{
	struct pen_pose_key *d = desc;

	pen_check_pose(reader, at, key, &d->pose);
}

static bool opposite_rotations(const struct pen_pose *a, const struct pen_pose *b)
{
	double cosine = dot(a->rotate, b->rotate) + a->rotate[3] * b->rotate[3];

	return fabs(cosine) < ANGLE_EPSILON;
}

/* Scales of unlike sign are singular somewhere between. */
static bool opposite_scales(const struct pen_pose *a, const struct pen_pose *b)
{
	return a->scale[0] * b->scale[0] < 0 || a->scale[1] * b->scale[1] < 0 ||
	       a->scale[2] * b->scale[2] < 0;
}

void pen_check_object(
	struct pen_reader *reader, const struct pen_place *at, json_t *object, void *desc)
{
	const struct pen_object_desc *d = desc;
	struct pen_place place = pen_place_member(at, object, "keyframes");
	json_t *list = json_object_get(object, "keyframes");

	pen_check_times(reader, &place, list, d->keys, sizeof *d->keys);
	for (uint32_t i = 1; i < d->key_count; i++) {
		struct pen_place element = pen_place_element(&place, i);
		json_t *key = json_array_get(list, i);

		if (opposite_rotations(&d->keys[i - 1].pose, &d->keys[i].pose))
			refuse_member(reader, &element, key, "rotate",
				"must not be 180 degrees from the key before: put a key between");
		if (opposite_scales(&d->keys[i - 1].pose, &d->keys[i].pose))
			refuse_member(reader, &element, key, "scale",
				"must not change its sign from the key before");
	}
}

void pen_check_times(struct pen_reader *reader, const struct pen_place *at, json_t *list,
	const void *keys, size_t size)
{
	const char *key = keys;
	double before, time;

	for (size_t i = 1; i < json_array_size(list); i++) {
		struct pen_place element = pen_place_element(at, i);

		memcpy(&before, key + (i - 1) * size, sizeof before);
		memcpy(&time, key + i * size, sizeof time);
		if (time <= before)
			refuse_member(reader, &element, json_array_get(list, i), "time",
				"must be later than that of the key before");
	}
}

void pen_check_rectangle(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc)
{
	const struct pen_light_desc *d = desc;
	const double *u = d->u.rectangle.edge_u, *v = d->u.rectangle.edge_v;

	if (length(u) < LENGTH_MIN)
		refuse_member(reader, at, light, "edge_u", "must not be zero");
	if (length(v) < LENGTH_MIN)
		refuse_member(reader, at, light, "edge_v", "must not be zero");
	if (fabs(dot(u, v)) > ANGLE_EPSILON * length(u) * length(v))
		refuse_member(reader, at, light, "edge_v",
			"must be perpendicular to edge_u: use two triangle lights instead");
}

void pen_check_triangle(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc)
{
	const struct pen_light_desc *d = desc;
	double a[3], b[3];

	subtract(d->u.triangle.vertices[1], d->u.triangle.vertices[0], a);
	subtract(d->u.triangle.vertices[2], d->u.triangle.vertices[0], b);
	if (collinear(a, b))
		refuse_member(reader, at, light, "vertices", "must not lie in one line");
}

void pen_check_disk(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc)
{
	struct pen_light_desc *d = desc;

	if (!normalise(d->u.disk.normal))
		refuse_member(reader, at, light, "normal", "must not be zero");
}

void pen_check_spot(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc)
{
	struct pen_light_desc *d = desc;

	if (!normalise(d->u.spot.direction))
		refuse_member(reader, at, light, "direction", "must not be zero");
}

void pen_check_directional(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc)
{
	struct pen_light_desc *d = desc;

	if (!normalise(d->u.directional.direction))
		refuse_member(reader, at, light, "direction", "must not be zero");
}

void pen_check_scene(struct pen_reader *reader, const struct pen_place *at, json_t *tree)
{
	const struct pen_scene *scene = reader->scene;
	struct pen_rect full = {0, 0, scene->image.width, scene->image.height};
	struct pen_place sampling = pen_place_member(at, tree, "sampling");
	/* No factor is above 2^28, 2^16 and 2^20: the products fit. */
	const uint64_t samples = pen_rect_area(full) * scene->sampling.samples;
	const uint64_t frames = 1ull + scene->frames.last - scene->frames.first;

	if (samples > PEN_FRAME_SAMPLES_MAX)
		refuse_member(reader, &sampling, json_object_get(tree, "sampling"), "samples",
			"must be less: the pixels times the samples must not pass 2^40");
	else if (scene->frames.last >= scene->frames.first &&
		 samples * frames > PEN_JOB_SAMPLES_MAX)
		refuse_member(reader, &sampling, json_object_get(tree, "sampling"), "samples",
			"must be less: the pixels of all frames times the samples must not pass "
			"2^50");
	if (reader->values > PEN_SCENE_NODES_MAX)
		pen_reader_refuse(reader, at, "has more than %u values with its defaults filled in",
			PEN_SCENE_NODES_MAX);
}
