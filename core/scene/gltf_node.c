/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_node.h"

#include "core/scene/gltf_animation.h"

#include <math.h>
#include <string.h>

static bool within(const struct pen_gltf_numbers *numbers, double most)
{
	for (size_t i = 0; i < numbers->count; i++)
		if (!(fabs(numbers->items[i]) <= most))
			return false;
	return true;
}

static bool read_vector(struct pen_gltf_reading *r, const struct pen_gltf_numbers *from,
	const char *what, size_t count, double most, double *ret_vector)
{
	if (from->count == 0)
		return true;
	pen_gltf_at_part(r, "%s", what);
	if (from->count != count || !within(from, most)) {
		pen_gltf_refuse(r, "it must be %zu numbers of at most %g", count, most);
		return false;
	}
	memcpy(ret_vector, from->items, count * sizeof *ret_vector);
	return true;
}

/* By columns in the asset. */
static void read_matrix(
	struct pen_gltf_reading *r, const struct pen_gltf_numbers *from, struct pen_node_desc *node)
{
	double m[16];

	if (!read_vector(r, from, "matrix", 16, PEN_COORDINATE_MAX, m))
		return;
	if (fabs(m[3]) + fabs(m[7]) + fabs(m[11]) > 1e-6 || fabs(m[15] - 1.0) > 1e-6) {
		pen_gltf_refuse(r, "its last row must be 0 0 0 1");
		return;
	}
	node->has_matrix = true;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			node->matrix[i][j] = m[4 * j + i];
}

static void read_node(
	struct pen_gltf_reading *r, const struct pen_gltf_node *from, struct pen_node_desc *node)
{
	double *q = node->pose.rotate;
	double length;

	*node = (struct pen_node_desc){
		.parent = PEN_NO_INDEX, .pose = {.rotate = {0, 0, 0, 1}, .scale = {1, 1, 1}}};
	if (from->matrix.count > 0) {
		read_matrix(r, &from->matrix, node);
		return;
	}
	(void)read_vector(
		r, &from->translation, "translation", 3, PEN_COORDINATE_MAX, node->pose.translate);
	(void)read_vector(r, &from->scale, "scale", 3, PEN_SCALE_MAX, node->pose.scale);
	(void)read_vector(r, &from->rotation, "rotation", 4, PEN_SCALE_MAX, q);
	length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
	if (length < 1e-6)
		pen_gltf_refuse(r, "it must not be 0");
	for (int i = 0; i < 4; i++)
		q[i] /= length;
}

/* Every node has one parent at most. */
static bool find_parents(struct pen_gltf_reading *r, struct pen_node_desc *nodes)
{
	const size_t count = r->model->node_count;
	const size_t found = r->found;

	for (size_t i = 0; i < count; i++) {
		const struct pen_gltf_indices *children = &r->model->nodes[i].children;

		pen_gltf_at(r, "node", i, r->model->nodes[i].name);
		for (size_t k = 0; k < children->count; k++) {
			const int child = children->items[k];

			if (child < 0 || (size_t)child >= count)
				pen_gltf_refuse(r, "there is no node %d", child);
			else if (nodes[child].parent != PEN_NO_INDEX || (size_t)child == i)
				pen_gltf_refuse(r, "its child %d has another parent", child);
			else
				nodes[child].parent = (uint32_t)i;
		}
	}
	return r->found == found;
}

/* Parents first. With one parent each, only a root within a circle could be met again. */
struct walk {
	uint32_t *order, *depths;
	uint32_t count;
};

static bool add_root(
	struct pen_gltf_reading *r, const struct pen_node_desc *nodes, int root, struct walk *walk)
{
	if (root < 0 || (size_t)root >= r->model->node_count) {
		pen_gltf_refuse(r, "there is no node %d", root);
		return false;
	}
	if (nodes[root].parent != PEN_NO_INDEX || walk->depths[root] > 0) {
		pen_gltf_refuse(r, "its node %d is no root, or named twice", root);
		return false;
	}
	walk->depths[root] = 1;
	walk->order[walk->count++] = (uint32_t)root;
	return true;
}

static bool add_children(struct pen_gltf_reading *r, uint32_t parent, struct walk *walk)
{
	const struct pen_gltf_indices *children = &r->model->nodes[parent].children;

	if (children->count > 0 && walk->depths[parent] >= PEN_GLTF_DEPTH_MAX) {
		pen_gltf_at(r, "node", parent, r->model->nodes[parent].name);
		pen_gltf_refuse(
			r, "more than %u nodes stand above its children", PEN_GLTF_DEPTH_MAX - 1);
		return false;
	}
	for (size_t i = 0; i < children->count; i++) {
		walk->depths[children->items[i]] = walk->depths[parent] + 1;
		walk->order[walk->count++] = (uint32_t)children->items[i];
	}
	return true;
}

/* The root nodes of the scene to show. */
static bool find_roots(struct pen_gltf_reading *r, struct pen_gltf_indices *ret_roots)
{
	const int scene = r->model->default_scene;

	r->place[0] = '\0';
	r->part = 0;
	*ret_roots = (struct pen_gltf_indices){0};
	if (r->model->scene_count == 0) {
		pen_gltf_warn(r, "it has no scene, and nothing of it is shown");
		return true;
	}
	if (scene >= 0 && (size_t)scene >= r->model->scene_count) {
		pen_gltf_refuse(r, "there is no scene %d", scene);
		return false;
	}
	if (scene < 0 && r->model->scene_count > 1)
		pen_gltf_warn(r, "of its %zu scenes the first one is shown", r->model->scene_count);
	*ret_roots = r->model->scenes[scene < 0 ? 0 : scene];
	pen_gltf_at(r, "scene", scene < 0 ? 0 : (size_t)scene, NULL);
	return true;
}

static void find_order(struct pen_gltf_reading *r, const struct pen_node_desc *nodes)
{
	const size_t count = r->model->node_count;
	struct walk walk = {
		.order = pen_gltf_alloc(r, count, sizeof *walk.order),
		.depths = pen_gltf_alloc(r, count, sizeof *walk.depths),
	};
	struct pen_gltf_indices roots;

	if (!walk.order || !walk.depths || !find_roots(r, &roots))
		return;
	for (size_t i = 0; i < roots.count; i++)
		if (!add_root(r, nodes, roots.items[i], &walk))
			return;
	for (uint32_t i = 0; i < walk.count; i++)
		if (!add_children(r, walk.order[i], &walk))
			return;
	r->asset->order = walk.order;
	r->asset->order_count = walk.count;
}

void pen_gltf_tree_read(struct pen_gltf_reading *r)
{
	const size_t count = r->model->node_count;
	struct pen_node_desc *nodes = pen_gltf_alloc(r, count, sizeof *nodes);
	struct pen_track *weights = pen_gltf_alloc(r, count, sizeof *weights);

	if (!nodes || !weights)
		return;
	for (size_t i = 0; i < count; i++) {
		pen_gltf_at(r, "node", i, r->model->nodes[i].name);
		read_node(r, &r->model->nodes[i], &nodes[i]);
	}
	if (!find_parents(r, nodes))
		return;
	find_order(r, nodes);
	pen_gltf_animations(r, nodes, weights);
	r->asset->nodes = nodes;
	r->asset->weights = weights;
}
