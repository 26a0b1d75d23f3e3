/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light_tree.h"

#include "core/scene/desc.h"

#include <string.h>

/* From this level on v chooses. */
enum { LEVEL_OF_V = 4, WIDTH = PEN_LIGHT_NODE_WIDTH };

/*
 * A sphere of radius r at distance d holds points in directions w whose cosines with a vector a
 * are below those of the centre's direction plus this times r / d, as far as that matters to where
 * light ends: the sine of a sum, bounded without a square root.
 */
#define REACH 1.125f

/*
 * Estimates of what a node's eight give to a point; 0 only where they give nothing. A point within
 * a sphere is weighed as one on it. Tells their sum.
 */
static float weigh(const struct pen_light_node *node, struct pen_vec3 p, struct pen_vec3 n,
	float ret_weights[WIDTH])
{
	const float any = n.x == 0.0f && n.y == 0.0f && n.z == 0.0f ? 1.0f : 0.0f;
	float sum = 0.0f;

#pragma omp simd
	for (int k = 0; k < WIDTH; k++) {
		const struct pen_vec3 to = {
			node->center_x[k] - p.x, node->center_y[k] - p.y, node->center_z[k] - p.z};
		const struct pen_vec3 axis = {node->axis_x[k], node->axis_y[k], node->axis_z[k]};
		const float radius2 = node->radius[k] * node->radius[k];
		const float d2 = pen_dot(to, to);
		const int is_within = d2 <= radius2;
		const float inv_d = 1.0f / sqrtf(pen_max(pen_max(d2, radius2), PEN_TINY));
		const float spread = REACH * node->radius[k] * inv_d;
		const float straight = -pen_dot(axis, to) * inv_d;
		const float side = node->two_sided[k] != 0 ? fabsf(straight) : straight;
		const float c = is_within ? 1.0f : pen_min(side + spread, 1.0f);
		const float s = pen_sqrt_clamped(1.0f - c * c);
		const float off = c * node->cos_axis[k] + s * node->sin_axis[k];
		const float sent = c > node->cos_axis[k] ? 1.0f : off;
		const float got = pen_clamp(pen_dot(n, to) * inv_d + spread + any, 0.0f, 1.0f);
		const float weight = node->strength[k] * pen_max(sent, 0.01f) * got * inv_d * inv_d;

		ret_weights[k] = sent > node->cos_reach[k] ? weight : 0.0f;
	}
	for (int k = 0; k < WIDTH; k++)
		sum += ret_weights[k];
	return sum;
}

/* Sixteen points on their way down, all by a level at a time. */
struct descent {
	_Alignas(64) float weights[WIDTH][PEN_LANES];
	_Alignas(64) float sum[PEN_LANES];
	_Alignas(64) float u[PEN_LANES];     /* what is left of it */
	_Alignas(64) float found[PEN_LANES]; /* the weight of the child that u falls to */
	_Alignas(64) int32_t child[PEN_LANES];
	uint32_t node[PEN_LANES];
	bool is_going[PEN_LANES];
};

/* Lanes that are there already have weights of 1, which divide without harm. */
static void weigh_all(const struct pen_light_tree *tree,
	const struct pen_light_receivers *receivers, struct descent *d)
{
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_vec3 p = {receivers->x[i], receivers->y[i], receivers->z[i]};
		const struct pen_vec3 n = {
			receivers->normal_x[i], receivers->normal_y[i], receivers->normal_z[i]};
		_Alignas(32) float weights[WIDTH] = {1.0f};

		d->sum[i] = 1.0f;
		if (d->is_going[i])
			d->sum[i] = weigh(&tree->nodes[d->node[i]], p, n, weights);
		for (int k = 0; k < WIDTH; k++)
			d->weights[k][i] = weights[k];
	}
}

/* Which of the weights holds a share of their sum; what is left of it within that one. */
static void find(struct descent *d)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		float left = d->u[i] * d->sum[i], found = 1.0f;
		int32_t last = 0;
		int is_found = 0;

#pragma GCC unroll 8
		for (int32_t k = 0; k < WIDTH; k++) {
			const float weight = d->weights[k][i];
			const int counts = (1 - is_found) & (weight != 0.0f);
			const int is_here = counts & (left < weight);

			last = (int32_t)pen_pick_bits(counts, (uint32_t)k, (uint32_t)last);
			found = pen_pick(counts, weight, found);
			left = pen_pick(counts - is_here, left - weight, left);
			is_found |= is_here;
		}
		d->child[i] = last;
		d->found[i] = found;
		d->u[i] = pen_clamp(left / found, 0.0f, 0x1.fffffep-1f);
	}
}

/* Tells whether any lane goes on. */
static bool step_down(const struct pen_light_tree *tree, struct descent *d,
	uint32_t ret_light[PEN_LANES], float chance[PEN_LANES])
{
	bool goes_on = false;

	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_light_node *node = &tree->nodes[d->node[i]];

		if (!d->is_going[i])
			continue;
		if (!(d->sum[i] > 0.0f)) {
			chance[i] = 0.0f;
			d->is_going[i] = false;
			continue;
		}
		chance[i] *= d->found[i] / d->sum[i];
		d->node[i] = node->child[d->child[i]];
		d->is_going[i] = d->node[i] != 0;
		if (!d->is_going[i])
			ret_light[i] = node->light[d->child[i]];
		goes_on |= d->is_going[i];
	}
	return goes_on;
}

void pen_light_tree_choose(const struct pen_light_tree *tree,
	const struct pen_light_receivers *receivers, const float u[PEN_LANES],
	const float v[PEN_LANES], uint32_t ret_light[PEN_LANES], float ret_chance[PEN_LANES])
{
	bool goes_on = false;
	struct descent d;

	for (int i = 0; i < PEN_LANES; i++) {
		d.u[i] = u[i];
		d.node[i] = 0;
		d.is_going[i] = tree->node_count > 0 && receivers->wanted[i] != 0;
		ret_light[i] = 0;
		ret_chance[i] = d.is_going[i] ? 1.0f : 0.0f;
		goes_on |= d.is_going[i];
	}
	for (int level = 0; goes_on; level++) {
		weigh_all(tree, receivers, &d);
		if (level == LEVEL_OF_V)
			memcpy(d.u, v, sizeof d.u);
		find(&d);
		goes_on = step_down(tree, &d, ret_light, ret_chance);
	}
}

float pen_light_tree_chance(const struct pen_light_tree *tree, struct pen_vec3 p,
	struct pen_vec3 normal, uint32_t light)
{
	uint32_t place = tree->places ? tree->places[light] : PEN_NO_INDEX;
	float chance = place != PEN_NO_INDEX ? 1.0f : 0.0f;

	while (place != PEN_NO_INDEX && chance > 0.0f) {
		const struct pen_light_node *node = &tree->nodes[place / WIDTH];
		float weights[WIDTH];
		const float sum = weigh(node, p, normal, weights);

		chance *= sum > 0.0f ? weights[place % WIDTH] / sum : 0.0f;
		place = node->parent;
	}
	return chance;
}
