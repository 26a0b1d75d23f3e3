/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_animation.h"

#include "core/scene/gltf_accessor.h"

#include <math.h>
#include <string.h>

static bool read_times(
	struct pen_gltf_reading *r, const struct pen_gltf_sampler *sampler, struct pen_track *track)
{
	const float *times =
		pen_gltf_accessor_floats(r, sampler->input, 1, PEN_GLTF_ANY, &track->key_count);

	if (!times)
		return false;
	if (track->key_count == 0) {
		pen_gltf_refuse(r, "it has no keys");
		return false;
	}
	for (uint32_t i = 0; i < track->key_count; i++) {
		if (fabsf(times[i]) <= (float)PEN_TIME_MAX && (i == 0 || times[i] > times[i - 1]))
			continue;
		pen_gltf_refuse(r, "key %u: times must rise, and stay below %g s", i, PEN_TIME_MAX);
		return false;
	}
	track->times = times;
	return true;
}

static bool read_interpolation(
	struct pen_gltf_reading *r, const struct pen_gltf_sampler *sampler, struct pen_track *track)
{
	if (strcmp(sampler->interpolation, "LINEAR") == 0)
		track->interpolation = PEN_INTERPOLATION_LINEAR;
	else if (strcmp(sampler->interpolation, "STEP") == 0)
		track->interpolation = PEN_INTERPOLATION_STEP;
	else if (strcmp(sampler->interpolation, "CUBICSPLINE") == 0)
		track->interpolation = PEN_INTERPOLATION_CUBIC;
	else
		pen_gltf_refuse(r, "interpolation must be STEP, LINEAR or CUBICSPLINE");
	return strcmp(sampler->interpolation, "LINEAR") == 0 ||
	       track->interpolation != PEN_INTERPOLATION_LINEAR;
}

/* Quaternions of keys that no normalisation helps. */
static bool check_rotations(struct pen_gltf_reading *r, const struct pen_track *track)
{
	const uint32_t each = track->interpolation == PEN_INTERPOLATION_CUBIC ? 3 : 1;

	for (uint32_t i = 0; i < track->key_count; i++) {
		const float *q = track->values + 4 * ((size_t)i * each + each / 2);

		if (fabsf(q[0]) + fabsf(q[1]) + fabsf(q[2]) + fabsf(q[3]) > 1e-6f)
			continue;
		pen_gltf_refuse(r, "key %u: a rotation of length 0", i);
		return false;
	}
	return true;
}

/* numbers: how many a key holds; per: of them in an element of the accessor. */
static bool read_track(struct pen_gltf_reading *r, const struct pen_gltf_sampler *sampler,
	uint32_t numbers, uint32_t per, struct pen_track *ret_track)
{
	struct pen_track track = {0};
	uint32_t count;

	if (!read_interpolation(r, sampler, &track) || !read_times(r, sampler, &track))
		return false;

	const size_t each = track.interpolation == PEN_INTERPOLATION_CUBIC ? 3 : 1;

	track.values = pen_gltf_accessor_floats(
		r, sampler->output, per, track.key_count * each * (numbers / per), &count);
	if (!track.values || (per == 4 && !check_rotations(r, &track)))
		return false;
	*ret_track = track;
	return true;
}

/* How many morph targets a node's mesh has. */
static uint32_t morphs_of(const struct pen_gltf_reading *r, size_t node)
{
	const int mesh = r->model->nodes[node].mesh;

	if (mesh < 0 || (size_t)mesh >= r->model->mesh_count ||
		r->model->meshes[mesh].primitive_count == 0 ||
		r->model->meshes[mesh].primitives[0].target_count > PEN_GLTF_MORPHS_MAX)
		return 0;
	return (uint32_t)r->model->meshes[mesh].primitives[0].target_count;
}

static void read_channel(struct pen_gltf_reading *r, const struct pen_gltf_animation *animation,
	const struct pen_gltf_channel *channel, struct pen_node_desc *nodes,
	struct pen_track *weights)
{
	struct pen_node_desc *node = &nodes[channel->node];
	const struct pen_gltf_sampler *sampler = &animation->samplers[channel->sampler];
	const bool moves_weights = strcmp(channel->path, "weights") == 0;
	const bool rotates = strcmp(channel->path, "rotation") == 0;
	struct pen_track *track = moves_weights ? &weights[channel->node]
				  : rotates	? &node->rotation
				  : strcmp(channel->path, "translation") == 0 ? &node->translation
				  : strcmp(channel->path, "scale") == 0	      ? &node->scale
									      : NULL;
	const uint32_t numbers = moves_weights ? morphs_of(r, (size_t)channel->node)
				 : rotates     ? 4
					       : 3;

	if (!track)
		pen_gltf_warn(r, "what it moves is not known: it is left out");
	else if (track->key_count > 0)
		pen_gltf_warn(r, "its node %d is moved by another already: it is left out",
			channel->node);
	else if (node->has_matrix && !moves_weights)
		pen_gltf_warn(r, "its node %d has a matrix: it is left out", channel->node);
	else if (numbers == 0)
		pen_gltf_warn(r, "its node %d has no morph targets: it is left out", channel->node);
	else
		(void)read_track(r, sampler, numbers, moves_weights ? 1 : numbers, track);
}

void pen_gltf_animations(
	struct pen_gltf_reading *r, struct pen_node_desc *nodes, struct pen_track *weights)
{
	for (size_t i = 0; i < r->model->animation_count; i++) {
		const struct pen_gltf_animation *animation = &r->model->animations[i];

		pen_gltf_at(r, "animation", i, animation->name);
		for (size_t k = 0; k < animation->channel_count && pen_gltf_sound(r); k++) {
			const struct pen_gltf_channel *channel = &animation->channels[k];

			pen_gltf_at_part(r, "channel %zu", k);
			if (channel->node < 0) /* of an extension */
				pen_gltf_warn(r, "it moves no node: it is left out");
			else if ((size_t)channel->node >= r->model->node_count)
				pen_gltf_refuse(r, "there is no node %d", channel->node);
			else if (channel->sampler < 0 ||
				 (size_t)channel->sampler >= animation->sampler_count)
				pen_gltf_refuse(r, "there is no sampler %d", channel->sampler);
			else
				read_channel(r, animation, channel, nodes, weights);
		}
	}
}
