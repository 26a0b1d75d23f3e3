/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_LIGHT_TREE_H
#define PEN_RENDER_LIGHT_TREE_H

#include "core/base/error.h"
#include "core/render/packet.h"
#include "core/render/vec.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * One of many lights, the likelier the more of its light a point may get (Conty Estevez, Kulla
 * 2018, "Importance sampling of many lights with adaptive tree splitting", without the splitting;
 * the binary tree that it builds is folded into one of eight children a node).
 * Bounds are conservative: a light that can reach a point has a chance there.
 */

/*
 * What is known of a light or a cluster: where it is, the cone that holds the normals of its
 * emitting sides, how far from a normal light still goes, and how much of it.
 */
struct pen_light_hull {
	float lower[3], upper[3];
	struct pen_vec3 axis;
	float cos_axis;	 /* of half the cone of normals; -1: all directions */
	float cos_reach; /* 0: light goes to all of a normal's side */
	float strength;	 /* radiant intensity along a normal, as a luminance; > 0 */
	uint32_t light;
	bool two_sided; /* the opposite normals are meant too */
};

enum { PEN_LIGHT_NODE_WIDTH = 8 };

/* Up to eight clusters or lights, to be weighed against each other at once. */
struct pen_light_node {
	_Alignas(64) float center_x[PEN_LIGHT_NODE_WIDTH]; /* of a sphere about the bounds */
	float center_y[PEN_LIGHT_NODE_WIDTH];
	float center_z[PEN_LIGHT_NODE_WIDTH];
	float radius[PEN_LIGHT_NODE_WIDTH];
	float axis_x[PEN_LIGHT_NODE_WIDTH];
	float axis_y[PEN_LIGHT_NODE_WIDTH];
	float axis_z[PEN_LIGHT_NODE_WIDTH];
	float cos_axis[PEN_LIGHT_NODE_WIDTH];
	float sin_axis[PEN_LIGHT_NODE_WIDTH];
	float cos_reach[PEN_LIGHT_NODE_WIDTH];
	float strength[PEN_LIGHT_NODE_WIDTH];	  /* 0: none is here */
	uint32_t two_sided[PEN_LIGHT_NODE_WIDTH]; /* 1 or 0 */
	uint32_t child[PEN_LIGHT_NODE_WIDTH];	  /* a node, or 0: then */
	uint32_t light[PEN_LIGHT_NODE_WIDTH];	  /* this one */
	uint32_t parent;			  /* its place, as below */
};

/* A place is a node's index times PEN_LIGHT_NODE_WIDTH plus that within the node. */
struct pen_light_tree {
	struct pen_light_node *nodes; /* the root first */
	uint32_t *places;	      /* of each light; PEN_NO_INDEX: it is not in the tree */
	uint32_t node_count, light_count;
	float strength, radius2; /* of all together */
};

/*
 * hulls, which are reordered, are of different lights below light_count. Without hulls the tree
 * chooses nothing. PEN_ENOMEM.
 */
int pen_light_tree_init(struct pen_light_tree *tree, struct pen_light_hull *hulls, uint32_t count,
	uint32_t light_count, struct pen_error *err);
void pen_light_tree_finish(struct pen_light_tree *tree);

/* Points, and the normals of what light from behind does not light; zero vectors: all counts. */
struct pen_light_receivers {
	const float *x, *y, *z;
	const float *normal_x, *normal_y, *normal_z;
	const uint32_t *wanted; /* 0: chance is to be 0 */
};

/*
 * A light for each of sixteen points, by u, and by v where u has no digits left, both in [0, 1).
 * chance is the light's, 0 where none can light the point: then light is a number all the same.
 */
void pen_light_tree_choose(const struct pen_light_tree *tree,
	const struct pen_light_receivers *receivers, const float u[PEN_LANES],
	const float v[PEN_LANES], uint32_t ret_light[PEN_LANES], float ret_chance[PEN_LANES]);

/* The chance with which pen_light_tree_choose chooses a light for a point. */
float pen_light_tree_chance(const struct pen_light_tree *tree, struct pen_vec3 p,
	struct pen_vec3 normal, uint32_t light);

#endif
