/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/motion.h"

#include "core/render/node.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

enum {
	SEGMENTS_MAX = PEN_MOTION_STEPS_MAX - 1,
	SEGMENTS_SHEARED = 32 /* where no step count is exact: a rotation under a stretch */
};

/* How far a corner may leave its path between two steps, as a share of its object's size. */
#define DEVIATION_MAX 1e-3

static double lerp(double a, double b, double s)
{
	return a + (b - a) * s;
}

double pen_shutter_time(const struct pen_shutter *shutter, uint32_t step, uint32_t count)
{
	return count < 2 ? shutter->open
			 : lerp(shutter->open, shutter->close, (double)step / (double)(count - 1));
}

struct pen_shutter pen_shutter_of(const struct pen_scene *scene, uint32_t frame)
{
	const double time = frame > 1 ? (frame - 1) / scene->frames.fps : 0.0;

	return (struct pen_shutter){
		time + scene->camera.shutter_open, time + scene->camera.shutter_close};
}

static struct pen_pose pose_at(const struct pen_object_desc *object, double time)
{
	const struct pen_pose_key *keys = object->keys;
	const uint32_t last = object->key_count - 1;
	uint32_t i = 0;

	if (time <= keys[0].time)
		return keys[0].pose;
	if (time >= keys[last].time)
		return keys[last].pose;
	while (keys[i + 1].time < time)
		i++;

	const struct pen_pose *a = &keys[i].pose, *b = &keys[i + 1].pose;
	const double s = (time - keys[i].time) / (keys[i + 1].time - keys[i].time);
	struct pen_pose pose;

	for (int k = 0; k < 3; k++) {
		pose.translate[k] = lerp(a->translate[k], b->translate[k], s);
		pose.scale[k] = lerp(a->scale[k], b->scale[k], s);
	}
	pen_slerp(a->rotate, b->rotate, s, pose.rotate);
	return pose;
}

struct pen_box pen_motion_box(const struct pen_object_desc *object)
{
	struct pen_box box = {.lower = {HUGE_VAL, HUGE_VAL, HUGE_VAL},
		.upper = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};

	for (int k = 0; k < 3 && object->type == PEN_OBJECT_SPHERE; k++) {
		box.lower[k] = object->u.sphere.center[k] - object->u.sphere.radius;
		box.upper[k] = object->u.sphere.center[k] + object->u.sphere.radius;
	}
	for (uint32_t i = 0; object->type == PEN_OBJECT_MESH && i < object->u.mesh.vertex_count;
		i++) {
		const float *v = object->u.mesh.vertices + 3 * (size_t)i;

		for (int k = 0; k < 3; k++) {
			box.lower[k] = fmin(box.lower[k], (double)v[k]);
			box.upper[k] = fmax(box.upper[k], (double)v[k]);
		}
	}
	return box;
}

struct pen_affine pen_motion_world(
	const struct pen_scene *scene, const struct pen_object_desc *object, double time)
{
	if (object->node != PEN_NO_INDEX)
		return pen_node_world(scene, object->node, time);

	const struct pen_affine transform = pen_affine_of_pose(&object->transform);

	if (object->key_count == 0)
		return transform;

	const struct pen_pose pose = pose_at(object, time);
	const struct pen_affine own = pen_affine_of_pose(&pose);

	return pen_affine_product(&transform, &own);
}

/* Whether the time falls on a step of a division of the shutter into so many segments. */
static bool falls_on_step(const struct pen_shutter *shutter, double time, uint32_t segments)
{
	const double x = (time - shutter->open) / (shutter->close - shutter->open) * segments;

	return fabs(x - round(x)) < 1e-6 * segments;
}

/* Key times, a stride apart; times outside the shutter do not matter. */
struct key_times {
	const char *first; /* of the double */
	size_t stride;
	uint32_t count;
};

static double key_time(const struct key_times *keys, uint32_t index)
{
	double time;

	memcpy(&time, keys->first + index * keys->stride, sizeof time);
	return time;
}

/* The fewest segments of which every key within the shutter is a step; 0 when no key matters. */
static uint32_t grid_segments(const struct key_times *keys, const struct pen_shutter *shutter)
{
	if (!(shutter->close > shutter->open) || shutter->close <= key_time(keys, 0) ||
		shutter->open >= key_time(keys, keys->count - 1))
		return 0;
	for (uint32_t segments = 1; segments < SEGMENTS_MAX; segments++) {
		bool fits = true;

		for (uint32_t i = 0; i < keys->count && fits; i++) {
			const double time = key_time(keys, i);

			fits = time <= shutter->open || time >= shutter->close ||
			       falls_on_step(shutter, time, segments);
		}
		if (fits)
			return segments;
	}
	return SEGMENTS_MAX;
}

static bool same_pose(const struct pen_pose *a, const struct pen_pose *b)
{
	return memcmp(a, b, sizeof *a) == 0;
}

static bool poses_differ(const struct pen_object_desc *object, const struct pen_shutter *shutter)
{
	const struct pen_pose open = pose_at(object, shutter->open);
	const struct pen_pose close = pose_at(object, shutter->close);

	if (!same_pose(&open, &close))
		return true;
	for (uint32_t i = 0; i < object->key_count; i++)
		if (object->keys[i].time > shutter->open && object->keys[i].time < shutter->close &&
			!same_pose(&object->keys[i].pose, &open))
			return true;
	return false;
}

static double rotation_between(const struct pen_pose *a, const struct pen_pose *b)
{
	double cosine = 0.0;

	for (int i = 0; i < 4; i++)
		cosine += a->rotate[i] * b->rotate[i];
	return 2.0 * acos(fmin(fabs(cosine), 1.0));
}

static double rotation_of_step_max(
	const struct pen_object_desc *object, const struct pen_shutter *shutter, uint32_t segments)
{
	struct pen_pose before = pose_at(object, shutter->open);
	double angle = 0.0;

	for (uint32_t i = 1; i <= segments; i++) {
		const struct pen_pose after =
			pose_at(object, pen_shutter_time(shutter, i, segments + 1));

		angle = fmax(angle, rotation_between(&before, &after));
		before = after;
	}
	return angle;
}

uint32_t pen_motion_steps(const struct pen_scene *scene, const struct pen_object_desc *object,
	const struct pen_box *box, const struct pen_shutter *shutter)
{
	if (object->node != PEN_NO_INDEX)
		return pen_node_steps(scene, object->node, box, DEVIATION_MAX, shutter);
	if (object->key_count < 2)
		return 1;

	const struct key_times times = {
		.first = (const char *)object->keys + offsetof(struct pen_pose_key, time),
		.stride = sizeof *object->keys,
		.count = object->key_count,
	};
	const uint32_t grid = grid_segments(&times, shutter);
	const double *scale = object->transform.scale;
	const bool stretched = scale[0] != scale[1] || scale[0] != scale[2];
	uint32_t segments = grid;

	if (grid == 0 || !poses_differ(object, shutter))
		return 1;

	const double angle = rotation_of_step_max(object, shutter, grid);
	const uint32_t wanted = stretched && angle > 0.0 ? SEGMENTS_SHEARED
				: angle >= 1.57		 ? 3 * grid
							 : grid;

	while (segments < wanted && segments + grid <= SEGMENTS_MAX)
		segments += grid;
	return segments + 1;
}

static bool track_rests(const struct pen_track *track)
{
	return track->key_count < 2;
}

static bool node_rests(const struct pen_scene *scene, uint32_t index)
{
	for (; index != PEN_NO_INDEX; index = scene->nodes[index].parent) {
		const struct pen_node_desc *node = &scene->nodes[index];

		if (!track_rests(&node->translation) || !track_rests(&node->rotation) ||
			!track_rests(&node->scale))
			return false;
	}
	return true;
}

bool pen_motion_mesh_is_rigid(const struct pen_object_desc *mesh)
{
	return mesh->type != PEN_OBJECT_MESH ||
	       (mesh->u.mesh.key_count < 2 && !mesh->u.mesh.deform);
}

bool pen_motion_rests(const struct pen_scene *scene, const struct pen_object_desc *object)
{
	const struct pen_object_desc *of = object->type == PEN_OBJECT_INSTANCE
						   ? &scene->objects[object->u.instance.of]
						   : object;

	for (uint32_t i = 1; i < object->key_count; i++)
		if (!same_pose(&object->keys[i].pose, &object->keys[0].pose))
			return false;
	return pen_motion_mesh_is_rigid(of) && node_rests(scene, object->node);
}

uint32_t pen_motion_mesh_steps(
	const struct pen_object_desc *mesh, const struct pen_shutter *shutter)
{
	if (mesh->u.mesh.key_count < 2)
		return 1;

	const struct key_times times = {
		.first = (const char *)mesh->u.mesh.keys + offsetof(struct pen_mesh_key, time),
		.stride = sizeof *mesh->u.mesh.keys,
		.count = mesh->u.mesh.key_count,
	};

	return grid_segments(&times, shutter) + 1;
}

void pen_motion_mesh_vertices(const struct pen_object_desc *mesh, double time, float *ret_vertices)
{
	const struct pen_mesh_key *keys = mesh->u.mesh.keys;
	const uint32_t count = mesh->u.mesh.key_count;
	const size_t floats = 3 * (size_t)mesh->u.mesh.vertex_count;
	const float *a = mesh->u.mesh.vertices, *b;
	uint32_t i = 0;
	double s = 0.0;

	while (i + 1 < count && keys[i + 1].time <= time)
		i++;
	if (count > 0)
		a = keys[i].vertices;
	b = a;
	if (i + 1 < count && time > keys[i].time) {
		b = keys[i + 1].vertices;
		s = (time - keys[i].time) / (keys[i + 1].time - keys[i].time);
	}
	for (size_t k = 0; k < floats; k++)
		ret_vertices[k] = (float)lerp((double)a[k], (double)b[k], s);
}
