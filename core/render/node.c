/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/node.h"

#include <math.h>

static void normalize(double q[4])
{
	const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);

	for (int i = 0; i < 4; i++)
		q[i] = length > 0.0 ? q[i] / length : (double)(i == 3);
}

/* The last key at or before a time; the first one before all. */
static uint32_t key_before(const struct pen_track *track, double time)
{
	uint32_t low = 0, high = track->key_count;

	while (high - low > 1) {
		const uint32_t middle = low + (high - low) / 2;

		if ((double)track->times[middle] <= time)
			low = middle;
		else
			high = middle;
	}
	return low;
}

/* The numbers of key i: of a cubic track its value, or with part 0 or 2 a tangent. */
static const float *key_part(
	const struct pen_track *track, uint32_t width, uint32_t i, uint32_t part)
{
	return track->interpolation == PEN_INTERPOLATION_CUBIC
		       ? track->values + ((size_t)i * 3 + part) * width
		       : track->values + (size_t)i * width;
}

/* Hermite's spline, as glTF 2.0 has it (appendix C). */
static double hermite(double a, double tangent_a, double b, double tangent_b, double s)
{
	const double s2 = s * s, s3 = s2 * s;

	return (2.0 * s3 - 3.0 * s2 + 1.0) * a + (s3 - 2.0 * s2 + s) * tangent_a +
	       (3.0 * s2 - 2.0 * s3) * b + (s3 - s2) * tangent_b;
}

static void load(const float *from, uint32_t width, bool rotates, double *ret_value)
{
	for (uint32_t i = 0; i < width; i++)
		ret_value[i] = (double)from[i];
	if (rotates)
		normalize(ret_value);
}

void pen_track_at(
	const struct pen_track *track, uint32_t width, bool rotates, double time, double *ret_value)
{
	const uint32_t i = key_before(track, time);
	const double start = (double)track->times[i];
	const float *a = key_part(track, width, i, 1), *b;
	double length, s;

	if (i + 1 == track->key_count || time <= start ||
		track->interpolation == PEN_INTERPOLATION_STEP) {
		load(a, width, rotates, ret_value);
		return;
	}
	length = (double)track->times[i + 1] - start;
	s = (time - start) / length;
	b = key_part(track, width, i + 1, 1);
	if (track->interpolation == PEN_INTERPOLATION_CUBIC) {
		const float *out = key_part(track, width, i, 2);
		const float *in = key_part(track, width, i + 1, 0);

		for (uint32_t k = 0; k < width; k++)
			ret_value[k] = hermite((double)a[k], length * (double)out[k], (double)b[k],
				length * (double)in[k], s);
		if (rotates)
			normalize(ret_value);
	} else if (rotates) {
		double from[4], to[4];

		load(a, 4, true, from);
		load(b, 4, true, to);
		pen_slerp(from, to, s, ret_value);
	} else {
		for (uint32_t k = 0; k < width; k++)
			ret_value[k] = (double)a[k] + s * ((double)b[k] - (double)a[k]);
	}
}

bool pen_track_moves(
	const struct pen_track *track, uint32_t width, const struct pen_shutter *shutter)
{
	const bool is_cubic = track->interpolation == PEN_INTERPOLATION_CUBIC;
	uint32_t first, last;

	if (track->key_count < 2 || !(shutter->close > shutter->open))
		return false;
	first = key_before(track, shutter->open);
	last = key_before(track, shutter->close);
	if (last + 1 < track->key_count && track->interpolation != PEN_INTERPOLATION_STEP &&
		(double)track->times[last] < shutter->close)
		last++;
	for (uint32_t i = first; i < last; i++)
		for (uint32_t k = 0; k < width; k++)
			if (key_part(track, width, i, 1)[k] !=
					key_part(track, width, i + 1, 1)[k] ||
				(is_cubic && (key_part(track, width, i, 2)[k] != 0.0f ||
						     key_part(track, width, i + 1, 0)[k] != 0.0f)))
				return true;
	return false;
}

uint32_t pen_track_keys_within(const struct pen_track *track, const struct pen_shutter *shutter)
{
	uint32_t first, last;

	if (track->key_count == 0)
		return 0;
	first = key_before(track, shutter->open);
	last = key_before(track, shutter->close);
	while (first < last && (double)track->times[first] <= shutter->open)
		first++;
	if ((double)track->times[first] <= shutter->open ||
		(double)track->times[first] >= shutter->close)
		return 0;
	return last - first + ((double)track->times[last] < shutter->close);
}

static struct pen_affine node_local(const struct pen_node_desc *node, double time)
{
	struct pen_pose pose = node->pose;
	struct pen_affine a;

	if (node->has_matrix) {
		for (int i = 0; i < 3; i++)
			for (int j = 0; j < 4; j++)
				a.m[i][j] = node->matrix[i][j];
		return a;
	}
	if (node->translation.key_count > 0)
		pen_track_at(&node->translation, 3, false, time, pose.translate);
	if (node->rotation.key_count > 0)
		pen_track_at(&node->rotation, 4, true, time, pose.rotate);
	if (node->scale.key_count > 0)
		pen_track_at(&node->scale, 3, false, time, pose.scale);
	return pen_affine_of_pose(&pose);
}

struct pen_affine pen_node_world(const struct pen_scene *scene, uint32_t node, double time)
{
	struct pen_affine world = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

	for (; node != PEN_NO_INDEX; node = scene->nodes[node].parent) {
		const struct pen_affine local = node_local(&scene->nodes[node], time);

		world = pen_affine_product(&local, &world);
	}
	return world;
}

bool pen_node_moves(const struct pen_scene *scene, uint32_t node, const struct pen_shutter *shutter)
{
	for (; node != PEN_NO_INDEX; node = scene->nodes[node].parent) {
		const struct pen_node_desc *n = &scene->nodes[node];

		if (pen_track_moves(&n->translation, 3, shutter) ||
			pen_track_moves(&n->rotation, 4, shutter) ||
			pen_track_moves(&n->scale, 3, shutter))
			return true;
	}
	return false;
}

static uint32_t larger(uint32_t a, uint32_t b)
{
	return a > b ? a : b;
}

uint32_t pen_node_keys_within(
	const struct pen_scene *scene, uint32_t node, const struct pen_shutter *shutter)
{
	uint32_t most = 0;

	for (; node != PEN_NO_INDEX; node = scene->nodes[node].parent) {
		const struct pen_node_desc *n = &scene->nodes[node];

		most = larger(most, pen_track_keys_within(&n->translation, shutter));
		most = larger(most, pen_track_keys_within(&n->rotation, shutter));
		most = larger(most, pen_track_keys_within(&n->scale, shutter));
	}
	return most;
}

uint32_t pen_segments_to_try(uint32_t k)
{
	static const uint8_t counts[] = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128};

	return k < sizeof counts ? counts[k] : 0;
}

/* Between two placements as Embree goes. */
static struct pen_affine between(
	const struct pen_placement *a, const struct pen_placement *b, double s)
{
	const double from[9] = {a->scale[0], a->scale[1], a->scale[2], a->skew_xy, a->skew_xz,
		a->skew_yz, a->translate[0], a->translate[1], a->translate[2]};
	const double to[9] = {b->scale[0], b->scale[1], b->scale[2], b->skew_xy, b->skew_xz,
		b->skew_yz, b->translate[0], b->translate[1], b->translate[2]};
	struct pen_placement p;
	double v[9];

	for (int i = 0; i < 9; i++)
		v[i] = from[i] + s * (to[i] - from[i]);
	p = (struct pen_placement){.scale = {v[0], v[1], v[2]},
		.skew_xy = v[3],
		.skew_xz = v[4],
		.skew_yz = v[5],
		.translate = {v[6], v[7], v[8]}};
	pen_slerp(a->rotate, b->rotate, s, p.rotate);
	return pen_affine_of_placement(&p);
}

bool pen_box_agrees(const struct pen_affine *a, const struct pen_affine *b,
	const struct pen_box *box, double share)
{
	double size = 0.0, apart = 0.0;

	for (int i = 0; i < 3; i++) {
		double across = 0.0;

		for (int j = 0; j < 3; j++)
			across += fabs(a->m[i][j]) * (box->upper[j] - box->lower[j]);
		size += across * across;
	}
	for (int corner = 0; corner < 8; corner++) {
		double p[3], x[3], y[3];

		for (int j = 0; j < 3; j++)
			p[j] = corner >> j & 1 ? box->upper[j] : box->lower[j];
		pen_affine_point(a, p, x);
		pen_affine_point(b, p, y);
		for (int j = 0; j < 3; j++)
			apart = fmax(apart, fabs(x[j] - y[j]));
	}
	return apart <= share * sqrt(size);
}

static bool turns_too_far(const struct pen_placement *a, const struct pen_placement *b)
{
	double cosine = 0.0;

	for (int i = 0; i < 4; i++)
		cosine += a->rotate[i] * b->rotate[i];
	return !(fabs(cosine) > 0.7072);
}

static bool segments_suffice(const struct pen_scene *scene, uint32_t node,
	const struct pen_box *box, double share, const struct pen_shutter *shutter,
	uint32_t segments)
{
	struct pen_affine world = pen_node_world(scene, node, shutter->open);
	struct pen_placement a = pen_affine_decompose(&world), b;

	for (uint32_t i = 1; i <= segments; i++, a = b) {
		world = pen_node_world(scene, node, pen_shutter_time(shutter, i, segments + 1));
		b = pen_affine_decompose(&world);
		if (turns_too_far(&a, &b))
			return false;
		for (uint32_t k = 1; k < 4; k++) {
			const struct pen_affine shown = between(&a, &b, k / 4.0);

			world = pen_node_world(scene, node,
				pen_shutter_time(shutter, 4 * (i - 1) + k, 4 * segments + 1));
			if (!pen_box_agrees(&world, &shown, box, share))
				return false;
		}
	}
	return true;
}

uint32_t pen_node_steps(const struct pen_scene *scene, uint32_t node, const struct pen_box *box,
	double share, const struct pen_shutter *shutter)
{
	const uint32_t keys = pen_node_keys_within(scene, node, shutter);

	if (!pen_node_moves(scene, node, shutter))
		return 1;
	for (uint32_t k = 0; pen_segments_to_try(k) > 0; k++)
		if (pen_segments_to_try(k) > keys &&
			segments_suffice(scene, node, box, share, shutter, pen_segments_to_try(k)))
			return pen_segments_to_try(k) + 1;
	return PEN_MOTION_STEPS_MAX;
}
