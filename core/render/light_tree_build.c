/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light_tree.h"

#include "core/scene/desc.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
	BINS = 12,
	/* Below this level lights are halved by number, so that no tree is deeper than twice it. */
	DEPTH_MAX = 40
};

/* A binary tree, before it is folded. */
struct branch {
	struct pen_light_hull hull; /* of all below it; has its light, of a leaf */
	uint32_t children;	    /* the first of two; 0: a leaf */
};

/* A run of hulls that a branch stands for. */
struct run {
	uint32_t branch, first, count, depth;
};

static float angle_between(struct pen_vec3 a, struct pen_vec3 b)
{
	return pen_angle(pen_length(pen_cross(a, b)), pen_dot(a, b));
}

static float cosine(float radians)
{
	return pen_sincos_turns(radians * (0.5f * PEN_INV_PI)).cos;
}

static float sine(float radians)
{
	return pen_sincos_turns(radians * (0.5f * PEN_INV_PI)).sin;
}

static float radians_of(float cosine)
{
	return pen_angle(pen_sqrt_clamped(1.0f - cosine * cosine), cosine);
}

static void set_all_around(struct pen_light_hull *hull)
{
	hull->axis = pen_vec3(0.0f, 0.0f, 1.0f);
	hull->cos_axis = -1.0f;
	hull->two_sided = false;
}

/* Whether a's cone holds b's, where that is told at once. */
static bool holds(const struct pen_light_hull *a, const struct pen_light_hull *b)
{
	const float between = pen_dot(a->axis, b->axis);

	if (a->cos_axis <= -1.0f)
		return true;
	return a->two_sided == b->two_sided && b->cos_axis >= 1.0f &&
	       (a->two_sided ? fabsf(between) : between) >= a->cos_axis;
}

/* The cone about two cones of normals, into a. */
static void join_cones(struct pen_light_hull *a, const struct pen_light_hull *b)
{
	const float half_a = radians_of(a->cos_axis), half_b = radians_of(b->cos_axis);
	const float turn = a->two_sided && pen_dot(a->axis, b->axis) < 0.0f ? -1.0f : 1.0f;
	const struct pen_vec3 axis_b = pen_scale(b->axis, turn);
	const float between = angle_between(a->axis, axis_b);
	const float half = 0.5f * (half_a + between + half_b) + 1e-4f;
	const float step = half - half_a;

	if (between + half_b <= half_a && a->two_sided == b->two_sided)
		return;
	if (a->two_sided != b->two_sided || half >= 3.14f || between > 3.14f) {
		set_all_around(a);
		return;
	}
	if (between + half_a <= half_b) {
		a->axis = axis_b;
		a->cos_axis = b->cos_axis;
		return;
	}
	if (between > 1e-4f)
		a->axis = pen_normalize(
			pen_madd(pen_scale(a->axis, sine(between - step)), sine(step), axis_b));
	a->cos_axis = cosine(half);
}

static void join(struct pen_light_hull *a, const struct pen_light_hull *b)
{
	for (int k = 0; k < 3; k++) {
		a->lower[k] = fminf(a->lower[k], b->lower[k]);
		a->upper[k] = fmaxf(a->upper[k], b->upper[k]);
	}
	if (!holds(a, b))
		join_cones(a, b);
	a->cos_reach = fminf(a->cos_reach, b->cos_reach);
	a->strength += b->strength;
}

/* The measure of directions that light may go to, as the paper weighs a cone of normals. */
static float cone_measure(const struct pen_light_hull *hull)
{
	const float half = radians_of(hull->cos_axis);
	const float reach = radians_of(hull->cos_reach);
	const float wide = fminf(half + reach, PEN_PI);

	return 2.0f * PEN_PI * (1.0f - hull->cos_axis) +
	       0.5f * PEN_PI *
		       (2.0f * wide * sine(half) - cosine(half - 2.0f * wide) -
			       2.0f * half * sine(half) + hull->cos_axis);
}

static float cost_of(const struct pen_light_hull *hull)
{
	const float x = hull->upper[0] - hull->lower[0];
	const float y = hull->upper[1] - hull->lower[1];
	const float z = hull->upper[2] - hull->lower[2];

	/* The last term tells lights on a line from each other. */
	return hull->strength * cone_measure(hull) *
	       (x * y + y * z + z * x + 1e-3f * (x * x + y * y + z * z));
}

static float centroid(const struct pen_light_hull *hull, int axis)
{
	return 0.5f * hull->lower[axis] + 0.5f * hull->upper[axis];
}

/* How the centroids of a run are divided into bins along an axis. */
struct binning {
	int axis;
	float from, scale;
};

static int bin_of(const struct binning *binning, const struct pen_light_hull *hull)
{
	const float at = (centroid(hull, binning->axis) - binning->from) * binning->scale;

	return at < BINS - 1 ? (at > 0.0f ? (int)at : 0) : BINS - 1;
}

/* The cheapest of the ways to cut one axis; its cost, and after which bin. */
static float find_cut(const struct pen_light_hull *hulls, uint32_t count,
	const struct binning *binning, int *ret_bin)
{
	struct pen_light_hull bins[BINS];
	bool filled[BINS] = {false};
	float behind[BINS];
	struct pen_light_hull sum = {.strength = 0.0f};
	bool has_any = false;
	float best = INFINITY;

	for (uint32_t i = 0; i < count; i++) {
		const int bin = bin_of(binning, &hulls[i]);

		if (filled[bin])
			join(&bins[bin], &hulls[i]);
		else
			bins[bin] = hulls[i];
		filled[bin] = true;
	}
	for (int bin = BINS - 1; bin > 0; bin--) {
		if (filled[bin] && has_any)
			join(&sum, &bins[bin]);
		else if (filled[bin])
			sum = bins[bin];
		has_any |= filled[bin];
		behind[bin] = has_any ? cost_of(&sum) : INFINITY;
	}
	has_any = false;
	for (int bin = 0; bin < BINS - 1; bin++) {
		if (filled[bin] && has_any)
			join(&sum, &bins[bin]);
		else if (filled[bin])
			sum = bins[bin];
		has_any |= filled[bin];
		if (has_any && cost_of(&sum) + behind[bin + 1] < best) {
			best = cost_of(&sum) + behind[bin + 1];
			*ret_bin = bin;
		}
	}
	return best;
}

/* Bounds of the centroids; false when they are all one point. */
static bool find_spread(
	const struct pen_light_hull *hulls, uint32_t count, float lower[3], float upper[3])
{
	for (int k = 0; k < 3; k++)
		lower[k] = upper[k] = centroid(&hulls[0], k);
	for (uint32_t i = 1; i < count; i++)
		for (int k = 0; k < 3; k++) {
			lower[k] = fminf(lower[k], centroid(&hulls[i], k));
			upper[k] = fmaxf(upper[k], centroid(&hulls[i], k));
		}
	return upper[0] > lower[0] || upper[1] > lower[1] || upper[2] > lower[2];
}

static uint32_t partition(
	struct pen_light_hull *hulls, uint32_t count, const struct binning *binning, int last)
{
	uint32_t low = 0, high = count;

	while (low < high) {
		const struct pen_light_hull hull = hulls[low];

		if (bin_of(binning, &hull) <= last) {
			low++;
			continue;
		}
		hulls[low] = hulls[--high];
		hulls[high] = hull;
	}
	return low;
}

/* Divides a run in two and tells how many are in the first; both have some. */
static uint32_t divide(struct pen_light_hull *hulls, uint32_t count, uint32_t depth)
{
	float lower[3], upper[3];
	struct binning best_binning = {.axis = 0};
	float best = INFINITY, longest = 0.0f;
	int best_bin = 0;
	uint32_t first;

	if (depth >= DEPTH_MAX || !find_spread(hulls, count, lower, upper))
		return count / 2;
	for (int k = 0; k < 3; k++)
		longest = fmaxf(longest, upper[k] - lower[k]);
	for (int k = 0; k < 3; k++) {
		const float extent = upper[k] - lower[k];
		const struct binning binning = {k, lower[k], (float)BINS / extent};
		int bin = 0;
		float cost;

		if (!(extent > 1e-6f * longest) || !isfinite(binning.scale))
			continue;
		/* Cuts of thin slices cost more, as the paper has it. */
		cost = find_cut(hulls, count, &binning, &bin) * longest / extent;
		if (cost < best) {
			best = cost;
			best_bin = bin;
			best_binning = binning;
		}
	}
	if (best == INFINITY)
		return count / 2;
	first = partition(hulls, count, &best_binning, best_bin);
	return first > 0 && first < count ? first : count / 2;
}

static void grow(struct branch *branches, struct pen_light_hull *hulls, uint32_t count)
{
	struct run stack[2 * DEPTH_MAX];
	uint32_t waiting = 0, used = 1;

	stack[waiting++] = (struct run){.branch = 0, .first = 0, .count = count};
	while (waiting > 0) {
		const struct run run = stack[--waiting];
		struct pen_light_hull *from = hulls + run.first;
		struct branch *branch = &branches[run.branch];
		uint32_t first;

		branch->hull = from[0];
		branch->children = 0;
		for (uint32_t i = 1; i < run.count; i++)
			join(&branch->hull, &from[i]);
		if (run.count == 1)
			continue;
		first = divide(from, run.count, run.depth);
		branch->children = used;
		used += 2;
		stack[waiting++] = (struct run){
			branch->children + 1, run.first + first, run.count - first, run.depth + 1};
		stack[waiting++] = (struct run){branch->children, run.first, first, run.depth + 1};
	}
}

static float radius2_of(const struct pen_light_hull *hull)
{
	float sum = 0.0f;

	for (int k = 0; k < 3; k++) {
		const float half = 0.5f * hull->upper[k] - 0.5f * hull->lower[k];

		sum += half * half;
	}
	return sum;
}

static void set_place(struct pen_light_node *node, uint32_t k, const struct pen_light_hull *hull)
{
	node->center_x[k] = centroid(hull, 0);
	node->center_y[k] = centroid(hull, 1);
	node->center_z[k] = centroid(hull, 2);
	node->radius[k] = sqrtf(radius2_of(hull)) * 1.0001f;
	node->axis_x[k] = hull->axis.x;
	node->axis_y[k] = hull->axis.y;
	node->axis_z[k] = hull->axis.z;
	node->cos_axis[k] = hull->cos_axis;
	node->sin_axis[k] = pen_sqrt_clamped(1.0f - hull->cos_axis * hull->cos_axis);
	node->cos_reach[k] = hull->cos_reach;
	node->strength[k] = hull->strength;
	node->two_sided[k] = hull->two_sided;
}

/* The branches that a node is to hold: those that tell least where they are are opened first. */
static uint32_t open_branches(
	const struct branch *branches, uint32_t root, uint32_t ret_chosen[PEN_LIGHT_NODE_WIDTH])
{
	uint32_t count = 1;

	ret_chosen[0] = root;
	while (count < PEN_LIGHT_NODE_WIDTH) {
		float most = -1.0f;
		uint32_t widest = 0;

		for (uint32_t i = 0; i < count; i++) {
			const struct branch *branch = &branches[ret_chosen[i]];
			const float width = branch->hull.strength * radius2_of(&branch->hull);

			if (branch->children == 0 || !(width > most))
				continue;
			most = width;
			widest = i;
		}
		if (most < 0.0f)
			break;
		ret_chosen[count++] = branches[ret_chosen[widest]].children + 1;
		ret_chosen[widest] = branches[ret_chosen[widest]].children;
	}
	return count;
}

/* Nodes in the order of their depth; while one waits, the light of its place is its branch. */
static void fold(struct pen_light_tree *tree, const struct branch *branches)
{
	tree->nodes[0] = (struct pen_light_node){.parent = PEN_NO_INDEX};
	tree->nodes[0].light[0] = 0;
	tree->node_count = 1;
	for (uint32_t at = 0; at < tree->node_count; at++) {
		struct pen_light_node *node = &tree->nodes[at];
		const uint32_t parent = node->parent;
		const uint32_t root = parent == PEN_NO_INDEX
					      ? 0
					      : tree->nodes[parent / PEN_LIGHT_NODE_WIDTH]
							.light[parent % PEN_LIGHT_NODE_WIDTH];
		uint32_t chosen[PEN_LIGHT_NODE_WIDTH];
		const uint32_t count = open_branches(branches, root, chosen);

		for (uint32_t k = 0; k < count; k++) {
			const struct branch *branch = &branches[chosen[k]];
			const uint32_t place = at * PEN_LIGHT_NODE_WIDTH + k;

			set_place(node, k, &branch->hull);
			node->light[k] = branch->children == 0 ? branch->hull.light : chosen[k];
			if (branch->children == 0) {
				tree->places[branch->hull.light] = place;
				continue;
			}
			node->child[k] = tree->node_count;
			tree->nodes[tree->node_count++] = (struct pen_light_node){.parent = place};
		}
	}
}

int pen_light_tree_init(struct pen_light_tree *tree, struct pen_light_hull *hulls, uint32_t count,
	uint32_t light_count, struct pen_error *err)
{
	struct branch *branches;
	struct pen_light_node *fitting;
	int r = 0;

	*tree = (struct pen_light_tree){.light_count = light_count};
	if (count == 0)
		return 0;
	branches = malloc((2ul * count - 1) * sizeof *branches);
	tree->nodes = aligned_alloc(64, count * sizeof *tree->nodes);
	tree->places = malloc(light_count * sizeof *tree->places);
	if (!branches || !tree->nodes || !tree->places) {
		pen_light_tree_finish(tree);
		r = pen_error_memory(err);
		goto out;
	}
	memset(tree->places, 0xff, light_count * sizeof *tree->places);
	grow(branches, hulls, count);
	tree->strength = branches[0].hull.strength;
	tree->radius2 = radius2_of(&branches[0].hull);
	fold(tree, branches);
	fitting = aligned_alloc(64, tree->node_count * sizeof *fitting);
	if (fitting) {
		memcpy(fitting, tree->nodes, tree->node_count * sizeof *fitting);
		free(tree->nodes);
		tree->nodes = fitting;
	}
out:
	free(branches);
	return r;
}

void pen_light_tree_finish(struct pen_light_tree *tree)
{
	free(tree->nodes);
	free(tree->places);
	*tree = (struct pen_light_tree){.node_count = 0};
}
