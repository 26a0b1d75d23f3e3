/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/motion.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

enum {
	SEGMENTS_MAX = PEN_MOTION_STEPS_MAX - 1,
	SEGMENTS_SHEARED = 32 /* where no step count is exact: a rotation under a stretch */
};

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

static void rotation_of_quaternion(const double q[4], double ret_r[3][3])
{
	const double x = q[0], y = q[1], z = q[2], w = q[3];

	ret_r[0][0] = 1.0 - 2.0 * (y * y + z * z);
	ret_r[0][1] = 2.0 * (x * y - z * w);
	ret_r[0][2] = 2.0 * (x * z + y * w);
	ret_r[1][0] = 2.0 * (x * y + z * w);
	ret_r[1][1] = 1.0 - 2.0 * (x * x + z * z);
	ret_r[1][2] = 2.0 * (y * z - x * w);
	ret_r[2][0] = 2.0 * (x * z - y * w);
	ret_r[2][1] = 2.0 * (y * z + x * w);
	ret_r[2][2] = 1.0 - 2.0 * (x * x + y * y);
}

/* Shepperd's method: the largest of the four components is taken from the diagonal. */
static void quaternion_of_rotation(double r[3][3], double ret_q[4])
{
	const double trace = r[0][0] + r[1][1] + r[2][2];

	if (trace > 0.0) {
		const double s = 2.0 * sqrt(1.0 + trace);

		ret_q[0] = (r[2][1] - r[1][2]) / s;
		ret_q[1] = (r[0][2] - r[2][0]) / s;
		ret_q[2] = (r[1][0] - r[0][1]) / s;
		ret_q[3] = 0.25 * s;
		return;
	}

	const int i = r[1][1] > r[0][0] ? (r[2][2] > r[1][1] ? 2 : 1) : (r[2][2] > r[0][0] ? 2 : 0);
	const int j = (i + 1) % 3, k = (i + 2) % 3;
	const double s = 2.0 * sqrt(1.0 + r[i][i] - r[j][j] - r[k][k]);

	ret_q[i] = 0.25 * s;
	ret_q[j] = (r[j][i] + r[i][j]) / s;
	ret_q[k] = (r[k][i] + r[i][k]) / s;
	ret_q[3] = (r[k][j] - r[j][k]) / s;
}

struct pen_affine pen_affine_of_pose(const struct pen_pose *pose)
{
	struct pen_affine a;
	double r[3][3];

	rotation_of_quaternion(pose->rotate, r);
	for (int i = 0; i < 3; i++) {
		for (int j = 0; j < 3; j++)
			a.m[i][j] = r[i][j] * pose->scale[j];
		a.m[i][3] = pose->translate[i];
	}
	return a;
}

struct pen_affine pen_affine_product(const struct pen_affine *a, const struct pen_affine *b)
{
	struct pen_affine c;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			c.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] +
				    a->m[i][2] * b->m[2][j] + (j == 3 ? a->m[i][3] : 0.0);
	return c;
}

double pen_affine_determinant(const struct pen_affine *a)
{
	const double(*m)[4] = a->m;

	return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
	       m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
	       m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

bool pen_affine_is_singular(const struct pen_affine *a)
{
	double size = 0.0;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			size = fmax(size, fabs(a->m[i][j]));
	for (int i = 0; i < 3; i++)
		if (!isfinite(a->m[i][0] + a->m[i][1] + a->m[i][2] + a->m[i][3]))
			return true;
	/* Embree inverts in float: a volume of less than 1e-9 of the cube, or 1e-30, is too flat.
	 */
	return !(fabs(pen_affine_determinant(a)) > fmax(1e-9 * size * size * size, 1e-30));
}

/* Gram-Schmidt from the first column on; the last axis is a cross product, so that the rotation is
 * proper and a mirror shows as a negative scale. */
struct pen_placement pen_affine_decompose(const struct pen_affine *a)
{
	struct pen_placement p = {.translate = {a->m[0][3], a->m[1][3], a->m[2][3]}};
	double q[3][3]; /* columns are axes */
	double c[3][3], y[3], length;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			c[j][i] = a->m[i][j];
	p.scale[0] = sqrt(c[0][0] * c[0][0] + c[0][1] * c[0][1] + c[0][2] * c[0][2]);
	for (int i = 0; i < 3; i++) {
		q[i][0] = c[0][i] / p.scale[0];
		p.skew_xy += q[i][0] * c[1][i];
		p.skew_xz += q[i][0] * c[2][i];
	}
	for (int i = 0; i < 3; i++)
		y[i] = c[1][i] - p.skew_xy * q[i][0];
	length = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
	p.scale[1] = length;
	for (int i = 0; i < 3; i++) {
		q[i][1] = y[i] / length;
		p.skew_yz += q[i][1] * c[2][i];
	}
	for (int i = 0; i < 3; i++) {
		const int j = (i + 1) % 3, k = (i + 2) % 3;

		q[i][2] = q[j][0] * q[k][1] - q[k][0] * q[j][1];
		p.scale[2] += q[i][2] * c[2][i];
	}
	quaternion_of_rotation(q, p.rotate);
	return p;
}

static void slerp(const double a[4], const double b[4], double s, double ret_q[4])
{
	double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
	const double sign = cosine < 0.0 ? -1.0 : 1.0;
	double from = 1.0 - s, to = s, length = 0.0;

	cosine = fmin(fabs(cosine), 1.0);
	if (cosine < 1.0 - 1e-12) {
		const double angle = acos(cosine);

		from = sin(from * angle) / sin(angle);
		to = sin(to * angle) / sin(angle);
	}
	for (int i = 0; i < 4; i++) {
		ret_q[i] = from * a[i] + to * sign * b[i];
		length += ret_q[i] * ret_q[i];
	}
	for (int i = 0; i < 4; i++)
		ret_q[i] /= sqrt(length);
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
	slerp(a->rotate, b->rotate, s, pose.rotate);
	return pose;
}

struct pen_affine pen_motion_world(const struct pen_object_desc *object, double time)
{
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

uint32_t pen_motion_steps(const struct pen_object_desc *object, const struct pen_shutter *shutter)
{
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
