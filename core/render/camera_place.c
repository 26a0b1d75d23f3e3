/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/camera_place.h"

#include "core/render/framing.h"
#include "core/render/node.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of the distance in focus: a tenth of a pixel in most images. */
#define DEVIATION_MAX 1e-4

static double length_of(const double v[3])
{
	return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static double distance(const double a[3], const double b[3])
{
	const double between[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};

	return length_of(between);
}

/* How far a view is from looking along its up, which would leave it without a right. */
static double spread(const struct pen_camera_key *key)
{
	double view[3], across[3];

	for (int i = 0; i < 3; i++)
		view[i] = key->look_at[i] - key->position[i];
	for (int i = 0; i < 3; i++) {
		const int j = (i + 1) % 3, k = (i + 2) % 3;

		across[i] = view[j] * key->up[k] - view[k] * key->up[j];
	}
	return length_of(across) / (length_of(view) * length_of(key->up));
}

/* The camera at a time. */
static int find_key(const struct pen_scene *scene, double time, struct pen_camera_key *ret_key,
	struct pen_error *err)
{
	const struct pen_camera_desc *camera = &scene->camera;
	const struct pen_affine world = pen_node_world(scene, camera->node, time);
	const bool has_position = camera->given & PEN_CAMERA_POSITION;
	const bool has_look_at = camera->given & PEN_CAMERA_LOOK_AT;
	const bool has_up = camera->given & PEN_CAMERA_UP;
	const double back[3] = {world.m[0][2], world.m[1][2], world.m[2][2]};
	const double depth = length_of(back);

	ret_key->time = time;
	for (int i = 0; i < 3; i++) {
		ret_key->position[i] = has_position ? camera->position[i] : world.m[i][3];
		ret_key->look_at[i] = has_look_at ? camera->look_at[i]
						  : ret_key->position[i] - camera->focus_distance *
										   back[i] / depth;
		ret_key->up[i] = has_up ? camera->up[i] : world.m[i][1];
	}
	if (!(spread(ret_key) > 1e-6) || !(depth > 0.0))
		return pen_error_set(err, PEN_EINVALID,
			"the camera's node is flattened at some time, or it looks along its up");
	return 0;
}

static uint32_t steps_of(const struct pen_scene *scene, const struct pen_shutter *shutter)
{
	const struct pen_camera_desc *camera = &scene->camera;
	struct pen_box box;

	for (int i = 0; i < 3; i++) {
		box.upper[i] = camera->focus_distance;
		box.lower[i] = -camera->focus_distance;
	}
	return pen_node_steps(scene, camera->node, &box, DEVIATION_MAX, shutter);
}

int pen_camera_place(const struct pen_scene *scene, const struct pen_shutter *shutter,
	struct pen_camera_desc *ret_camera, struct pen_camera_key **ret_keys, struct pen_error *err)
{
	struct pen_camera_desc camera = scene->camera;
	struct pen_camera_key *keys = NULL;
	uint32_t steps;
	int r = pen_framing_choose(scene, &camera, err);

	if (r < 0)
		return r;
	camera.shutter_open = shutter->open;
	camera.shutter_close = shutter->close;
	if (camera.node != PEN_NO_INDEX) {
		steps = steps_of(scene, shutter);
		keys = calloc(steps, sizeof *keys);
		if (!keys)
			return pen_error_memory(err);
		for (uint32_t i = 0; i < steps && r == 0; i++)
			r = find_key(scene, pen_shutter_time(shutter, i, steps), &keys[i], err);
		memcpy(camera.position, keys->position, sizeof camera.position);
		memcpy(camera.look_at, keys->look_at, sizeof camera.look_at);
		memcpy(camera.up, keys->up, sizeof camera.up);
		if (r == 0 && camera.given & PEN_CAMERA_LOOK_AT &&
			!(camera.given & PEN_CAMERA_FOCUS))
			camera.focus_distance = distance(keys->position, keys->look_at);
		camera.keys = keys;
		camera.key_count = steps > 1 ? steps : 0;
	}
	if (r < 0) {
		free(keys);
		return r;
	}
	*ret_camera = camera;
	*ret_keys = keys;
	return 0;
}
