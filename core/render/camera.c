/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/camera.h"

#include "core/render/warp.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

struct pose {
	double position[3];
	double rotation[4]; /* quaternion x y z w */
};

static double dot3(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalize3(double v[3])
{
	const double length = sqrt(dot3(v, v));

	for (int i = 0; i < 3; i++)
		v[i] /= length;
}

static void cross3(const double a[3], const double b[3], double ret[3])
{
	ret[0] = a[1] * b[2] - a[2] * b[1];
	ret[1] = a[2] * b[0] - a[0] * b[2];
	ret[2] = a[0] * b[1] - a[1] * b[0];
}

/* Rows right, up and backward of the frame that looks at a point. */
static void look_at(
	const double position[3], const double at[3], const double up[3], double ret_axes[3][3])
{
	double forward[3];

	for (int i = 0; i < 3; i++)
		forward[i] = at[i] - position[i];
	normalize3(forward);
	cross3(forward, up, ret_axes[0]);
	normalize3(ret_axes[0]);
	cross3(ret_axes[0], forward, ret_axes[1]);
	for (int i = 0; i < 3; i++)
		ret_axes[2][i] = -forward[i];
}

/* The rotation that turns the coordinate axes into these (Shepperd 1978: largest divisor first). */
static void axes_to_quaternion(double axes[3][3], double ret[4])
{
	const double trace = axes[0][0] + axes[1][1] + axes[2][2];
	int largest = 3;
	double best = trace;

	for (int i = 0; i < 3; i++)
		if (axes[i][i] > best) {
			best = axes[i][i];
			largest = i;
		}
	if (largest == 3) {
		ret[0] = axes[1][2] - axes[2][1];
		ret[1] = axes[2][0] - axes[0][2];
		ret[2] = axes[0][1] - axes[1][0];
		ret[3] = 1.0 + trace;
	} else {
		const int i = largest;
		const int j = (i + 1) % 3;
		const int k = (i + 2) % 3;

		ret[i] = 1.0 + axes[i][i] - axes[j][j] - axes[k][k];
		ret[j] = axes[i][j] + axes[j][i];
		ret[k] = axes[i][k] + axes[k][i];
		ret[3] = axes[j][k] - axes[k][j];
	}

	const double length =
		sqrt(ret[0] * ret[0] + ret[1] * ret[1] + ret[2] * ret[2] + ret[3] * ret[3]);

	for (int i = 0; i < 4; i++)
		ret[i] /= length;
}

static void key_pose(const struct pen_camera_key *key, struct pose *ret_pose)
{
	double axes[3][3];

	look_at(key->position, key->look_at, key->up, axes);
	axes_to_quaternion(axes, ret_pose->rotation);
	memcpy(ret_pose->position, key->position, sizeof(ret_pose->position));
}

/* The angle between two rotations as points of the 4-sphere, after b took a's hemisphere. */
static double align(const double a[4], double b[4])
{
	double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
	double gap = 0.0;

	if (dot < 0.0)
		for (int i = 0; i < 4; i++)
			b[i] = -b[i];
	for (int i = 0; i < 4; i++)
		gap += (a[i] - b[i]) * (a[i] - b[i]);
	return 2.0 * asin(fmin(0.5 * sqrt(gap), 1.0));
}

/* a at s = 0, b at s = 1: position linear, rotation by the shortest arc. */
static void interpolate(const struct pose *a, const struct pose *b, double s, struct pose *ret_pose)
{
	struct pose end = *b;
	const double angle = align(a->rotation, end.rotation);
	const bool turns = angle > 1e-9;
	const double keep = turns ? sin((1.0 - s) * angle) / sin(angle) : 1.0;
	const double take = turns ? sin(s * angle) / sin(angle) : 0.0;

	for (int i = 0; i < 3; i++)
		ret_pose->position[i] = (1.0 - s) * a->position[i] + s * end.position[i];
	for (int i = 0; i < 4; i++)
		ret_pose->rotation[i] = keep * a->rotation[i] + take * end.rotation[i];
}

/* The pose at a time, held before the first and after the last of count > 0 keys. */
static void pose_at(
	const struct pen_camera_key *keys, uint32_t count, double time, struct pose *ret_pose)
{
	uint32_t next = 0;
	struct pose before, after;

	while (next < count && keys[next].time <= time)
		next++;
	if (next == 0 || next == count) {
		key_pose(&keys[next == 0 ? 0 : next - 1], ret_pose);
		return;
	}
	key_pose(&keys[next - 1], &before);
	key_pose(&keys[next], &after);
	interpolate(&before, &after,
		(time - keys[next - 1].time) / (keys[next].time - keys[next - 1].time), ret_pose);
}

static void segment_init(struct pen_camera_segment *segment, double start, double end,
	const struct pose *from, struct pose *to)
{
	const double angle = align(from->rotation, to->rotation);

	segment->start = (float)start;
	segment->inv_length = (float)(1.0 / (end - start));
	segment->position = pen_vec3_load(from->position);
	segment->step = pen_vec3((float)(to->position[0] - from->position[0]),
		(float)(to->position[1] - from->position[1]),
		(float)(to->position[2] - from->position[2]));
	segment->angle_turns = (float)(angle / (2.0 * M_PI));
	for (int i = 0; i < 4; i++) {
		const double toward = to->rotation[i] - cos(angle) * from->rotation[i];

		segment->from[i] = (float)from->rotation[i];
		segment->toward[i] = angle > 1e-9 ? (float)(toward / sin(angle)) : 0.0f;
	}
}

/* Cuts the shutter at the keys within it. */
static int add_segments(
	struct pen_camera *camera, const struct pen_camera_desc *desc, struct pen_error *err)
{
	const double open = desc->shutter_open;
	double start = 0.0;
	struct pose from, to;

	camera->segments = calloc((size_t)desc->key_count + 1, sizeof(*camera->segments));
	if (camera->segments == NULL)
		return pen_error_memory(err);
	pose_at(desc->keys, desc->key_count, open, &from);
	for (uint32_t i = 0; i <= desc->key_count; i++) {
		const bool last = i == desc->key_count;
		const double time = last ? desc->shutter_close : desc->keys[i].time;
		const double end = (time - open) / (desc->shutter_close - open);

		if (end <= start || end > 1.0)
			continue;
		pose_at(desc->keys, desc->key_count, time, &to);
		segment_init(&camera->segments[camera->segment_count++], start, end, &from, &to);
		from = to;
		start = end;
	}
	return 0;
}

/* v turned by a unit quaternion. */
PEN_LANE struct pen_vec3 rotate(const float q[4], struct pen_vec3 v)
{
	const struct pen_vec3 axis = pen_vec3(q[0], q[1], q[2]);
	const struct pen_vec3 t = pen_scale(pen_cross(axis, v), 2.0f);

	return pen_add(pen_madd(v, q[3], t), pen_cross(axis, t));
}

/* The frame while the shutter opens: all there is without motion. */
static void set_frame(struct pen_camera *camera, const struct pen_camera_desc *desc)
{
	struct pen_camera_key fixed = {.time = 0.0};
	struct pose pose;
	float q[4];

	memcpy(fixed.position, desc->position, sizeof(fixed.position));
	memcpy(fixed.look_at, desc->look_at, sizeof(fixed.look_at));
	memcpy(fixed.up, desc->up, sizeof(fixed.up));
	if (desc->key_count > 0)
		pose_at(desc->keys, desc->key_count, desc->shutter_open, &pose);
	else
		key_pose(&fixed, &pose);
	for (int i = 0; i < 4; i++)
		q[i] = (float)pose.rotation[i];
	camera->frame = (struct pen_camera_frame){
		.position = pen_vec3_load(pose.position),
		.right = rotate(q, pen_vec3(1.0f, 0.0f, 0.0f)),
		.up = rotate(q, pen_vec3(0.0f, 1.0f, 0.0f)),
		.forward = rotate(q, pen_vec3(0.0f, 0.0f, -1.0f)),
	};
}

int pen_camera_init(struct pen_camera *camera, const struct pen_camera_desc *desc, uint32_t width,
	uint32_t height, struct pen_error *err)
{
	const bool is_orthographic = desc->orthographic_width > 0.0;
	const double tan_x = is_orthographic ? 0.5 * desc->orthographic_width
					     : tan(desc->horizontal_fov * M_PI / 360.0);
	/* Unturned, the middle of an edge lies to the right. */
	const double half_blade = desc->blades > 0 ? 0.5 / desc->blades : 0.0;
	const double turns = desc->blade_rotation / 360.0 + half_blade;
	const bool pinhole = desc->aperture_radius <= 0.0;

	*camera = (struct pen_camera){
		.tan_x = (float)tan_x,
		.tan_y = (float)(tan_x * height / width),
		.is_orthographic = is_orthographic,
		.pixel_x = (float)(2.0 / width),
		.pixel_y = (float)(2.0 / height),
		.aperture_radius = (float)desc->aperture_radius,
		.inv_focus = pinhole ? 0.0f : (float)(1.0 / desc->focus_distance),
		.focal_surface = desc->focal_surface,
		.blades = desc->blades,
		.blade_turns = (float)(turns - floor(turns)),
	};
	set_frame(camera, desc);
	if (desc->key_count == 0 || desc->shutter_close <= desc->shutter_open)
		return 0;
	return add_segments(camera, desc, err);
}

void pen_camera_finish(struct pen_camera *camera)
{
	free(camera->segments);
	camera->segments = NULL;
}

static struct pen_camera_frame moving_frame(const struct pen_camera *camera, float time)
{
	const struct pen_camera_segment *segment = camera->segments;
	float q[4];

	for (uint32_t i = 1; i < camera->segment_count; i++)
		if (time >= camera->segments[i].start)
			segment = &camera->segments[i];

	const float s = (time - segment->start) * segment->inv_length;
	const struct pen_sincos sc = pen_sincos_turns(s * segment->angle_turns);

	for (int i = 0; i < 4; i++)
		q[i] = sc.cos * segment->from[i] + sc.sin * segment->toward[i];
	return (struct pen_camera_frame){
		.position = pen_madd(segment->position, s, segment->step),
		.right = rotate(q, pen_vec3(1.0f, 0.0f, 0.0f)),
		.up = rotate(q, pen_vec3(0.0f, 1.0f, 0.0f)),
		.forward = rotate(q, pen_vec3(0.0f, 0.0f, -1.0f)),
	};
}

enum aperture { APERTURE_PINHOLE, APERTURE_ROUND, APERTURE_POLYGON };

PEN_LANE struct pen_vec2 lens_point(
	const struct pen_camera *camera, enum aperture aperture, float u, float v)
{
	switch (aperture) {
	case APERTURE_PINHOLE: break;
	case APERTURE_ROUND: return pen_warp_disk(u, v);
	case APERTURE_POLYGON: return pen_warp_polygon(camera->blades, camera->blade_turns, u, v);
	}
	return (struct pen_vec2){0.0f, 0.0f};
}

struct ray {
	struct pen_vec3 origin, direction;
};

/* From the lens through the point of the focal surface that the lens' centre sees. */
PEN_LANE struct ray make_ray(const struct pen_camera *camera, const struct pen_camera_frame *frame,
	float film_x, float film_y, struct pen_vec2 lens)
{
	const float x = (film_x * camera->pixel_x - 1.0f) * camera->tan_x;
	const float y = (1.0f - film_y * camera->pixel_y) * camera->tan_y;
	/* One unit forward on the plane, one unit away on the sphere. */
	const float reach = camera->focal_surface == PEN_FOCAL_SPHERE
				    ? 1.0f / sqrtf(x * x + y * y + 1.0f)
				    : 1.0f;
	const float lens_x = lens.x * camera->aperture_radius;
	const float lens_y = lens.y * camera->aperture_radius;
	const struct pen_vec3 along = pen_scale(frame->forward, reach);
	const struct pen_vec3 across =
		pen_madd(along, x * reach - lens_x * camera->inv_focus, frame->right);

	return (struct ray){
		.origin = pen_madd(
			pen_madd(frame->position, lens_x, frame->right), lens_y, frame->up),
		.direction = pen_normalize(
			pen_madd(across, y * reach - lens_y * camera->inv_focus, frame->up)),
	};
}

/* From a lens around the film's point through the point of the plane in focus straight ahead. */
static struct ray make_parallel_ray(const struct pen_camera *camera,
	const struct pen_camera_frame *frame, float film_x, float film_y, struct pen_vec2 lens)
{
	const float lens_x = lens.x * camera->aperture_radius;
	const float lens_y = lens.y * camera->aperture_radius;
	const float x = (film_x * camera->pixel_x - 1.0f) * camera->tan_x + lens_x;
	const float y = (1.0f - film_y * camera->pixel_y) * camera->tan_y + lens_y;
	const struct pen_vec3 across =
		pen_madd(frame->forward, -lens_x * camera->inv_focus, frame->right);

	return (struct ray){
		.origin = pen_madd(pen_madd(frame->position, x, frame->right), y, frame->up),
		.direction =
			pen_normalize(pen_madd(across, -lens_y * camera->inv_focus, frame->up)),
	};
}

/* Inputs and outputs of pen_camera_generate. */
struct batch {
	const float *film_x, *film_y, *lens_u, *lens_v, *time;
	struct pen_camera_rays rays;
};

PEN_LANE void store_ray(const struct batch *batch, uint32_t i, struct ray ray)
{
	batch->rays.origin_x[i] = ray.origin.x;
	batch->rays.origin_y[i] = ray.origin.y;
	batch->rays.origin_z[i] = ray.origin.z;
	batch->rays.direction_x[i] = ray.direction.x;
	batch->rays.direction_y[i] = ray.direction.y;
	batch->rays.direction_z[i] = ray.direction.z;
}

PEN_LANE void generate_one(const struct pen_camera *camera, const struct pen_camera_frame *frame,
	const struct batch *batch, enum aperture aperture, uint32_t i)
{
	const struct pen_vec2 lens =
		lens_point(camera, aperture, batch->lens_u[i], batch->lens_v[i]);

	store_ray(batch, i, make_ray(camera, frame, batch->film_x[i], batch->film_y[i], lens));
}

/* aperture is a constant where this is called, so that each loop has one shape of lens. */
PEN_LANE void generate_static(
	const struct pen_camera *camera, uint32_t n, struct batch batch, enum aperture aperture)
{
	const struct pen_camera copy = *camera;

#pragma omp simd
	for (uint32_t i = 0; i < n; i++)
		generate_one(&copy, &copy.frame, &batch, aperture, i);
}

static void generate_moving(
	const struct pen_camera *camera, uint32_t n, struct batch batch, enum aperture aperture)
{
	for (uint32_t i = 0; i < n; i++) {
		const struct pen_camera_frame frame = moving_frame(camera, batch.time[i]);

		generate_one(camera, &frame, &batch, aperture, i);
	}
}

static void generate_parallel(
	const struct pen_camera *camera, uint32_t n, struct batch batch, enum aperture aperture)
{
	for (uint32_t i = 0; i < n; i++) {
		const struct pen_camera_frame frame = camera->segment_count > 0
							      ? moving_frame(camera, batch.time[i])
							      : camera->frame;
		const struct pen_vec2 lens =
			lens_point(camera, aperture, batch.lens_u[i], batch.lens_v[i]);

		store_ray(&batch, i,
			make_parallel_ray(camera, &frame, batch.film_x[i], batch.film_y[i], lens));
	}
}

void pen_camera_generate(const struct pen_camera *camera, uint32_t n, const float *film_x,
	const float *film_y, const float *lens_u, const float *lens_v, const float *time,
	const struct pen_camera_rays *ret_rays)
{
	const struct batch batch = {film_x, film_y, lens_u, lens_v, time, *ret_rays};
	const enum aperture aperture = camera->aperture_radius <= 0.0f ? APERTURE_PINHOLE
				       : camera->blades == 0	       ? APERTURE_ROUND
								       : APERTURE_POLYGON;

	if (camera->is_orthographic)
		generate_parallel(camera, n, batch, aperture);
	else if (camera->segment_count > 0)
		generate_moving(camera, n, batch, aperture);
	else if (aperture == APERTURE_PINHOLE)
		generate_static(camera, n, batch, APERTURE_PINHOLE);
	else if (aperture == APERTURE_ROUND)
		generate_static(camera, n, batch, APERTURE_ROUND);
	else
		generate_static(camera, n, batch, APERTURE_POLYGON);
}

struct pen_vec3 pen_camera_axis(const struct pen_camera *camera, float time)
{
	return camera->segment_count > 0 ? moving_frame(camera, time).forward
					 : camera->frame.forward;
}
