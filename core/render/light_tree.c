/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light_tree.h"

#include "core/scene/desc.h"

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

/* Which of the weights holds a share of their sum; what is left of it within that one. */
static int find(const float weights[WIDTH], float sum, float u, float *ret_rest)
{
	float left = u * sum;
	int last = 0;

	for (int k = 0; k < WIDTH; k++) {
		if (weights[k] == 0.0f)
			continue;
		last = k;
		if (left < weights[k])
			break;
		left -= weights[k];
	}
	*ret_rest = pen_clamp(left / weights[last], 0.0f, 0x1.fffffep-1f);
	return last;
}

static uint32_t choose(const struct pen_light_tree *tree, struct pen_vec3 p, struct pen_vec3 n,
	float u, float v, float *ret_chance)
{
	const struct pen_light_node *node = tree->nodes;
	float chance = 1.0f;

	for (int level = 0;; level++) {
		float weights[WIDTH];
		const float sum = weigh(node, p, n, weights);
		int k;

		if (!(sum > 0.0f)) {
			*ret_chance = 0.0f;
			return 0;
		}
		k = find(weights, sum, level == LEVEL_OF_V ? v : u, &u);
		chance *= weights[k] / sum;
		if (node->child[k] == 0) {
			*ret_chance = chance;
			return node->light[k];
		}
		node = &tree->nodes[node->child[k]];
	}
}

void pen_light_tree_choose(const struct pen_light_tree *tree,
	const struct pen_light_receivers *receivers, const float u[PEN_LANES],
	const float v[PEN_LANES], uint32_t ret_light[PEN_LANES], float ret_chance[PEN_LANES])
{
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_vec3 p = {receivers->x[i], receivers->y[i], receivers->z[i]};
		const struct pen_vec3 n = {
			receivers->normal_x[i], receivers->normal_y[i], receivers->normal_z[i]};

		ret_light[i] = 0;
		ret_chance[i] = 0.0f;
		if (tree->node_count > 0 && receivers->wanted[i] != 0)
			ret_light[i] = choose(tree, p, n, u[i], v[i], &ret_chance[i]);
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
