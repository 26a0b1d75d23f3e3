/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_NODE_H
#define PEN_RENDER_NODE_H

#include "core/render/motion.h"

/*
 * Where the nodes of a scene are at a time. Before its first key and after its last one a track
 * holds its value. STEP jumps at the key; a rotation goes by the shortest arc.
 */

/* The numbers of a track with keys, width of them; a rotation (width 4) is made a unit one. */
void pen_track_at(const struct pen_track *track, uint32_t width, bool rotates, double time,
	double *ret_value);

/* Whether a track's value changes while the shutter is open. */
bool pen_track_moves(
	const struct pen_track *track, uint32_t width, const struct pen_shutter *shutter);

/* How many of a track's keys lie within the shutter. */
uint32_t pen_track_keys_within(const struct pen_track *track, const struct pen_shutter *shutter);

/* World from a node's coordinates; the identity for PEN_NO_INDEX. */
struct pen_affine pen_node_world(const struct pen_scene *scene, uint32_t node, double time);

/* Whether anything in the chain of nodes moves while the shutter is open. */
bool pen_node_moves(
	const struct pen_scene *scene, uint32_t node, const struct pen_shutter *shutter);

/* The most keys that a track of the chain has within the shutter. */
uint32_t pen_node_keys_within(
	const struct pen_scene *scene, uint32_t node, const struct pen_shutter *shutter);

/* Whether two maps take the corners of a box to places no further apart than a share of its size.
 */
bool pen_box_agrees(const struct pen_affine *a, const struct pen_affine *b,
	const struct pen_box *box, double share);

/* The k-th number of segments to divide a shutter into, rising from 1 to 128; 0 beyond. */
uint32_t pen_segments_to_try(uint32_t k);

/*
 * The steps that show a moving chain: the fewest of a list between which no corner of a box, in the
 * node's coordinates, leaves its path by more than a share of the box's size, at three places of
 * each segment, and no rotation reaches 90 degrees; else PEN_MOTION_STEPS_MAX. 1 when nothing
 * moves.
 */
uint32_t pen_node_steps(const struct pen_scene *scene, uint32_t node, const struct pen_box *box,
	double share, const struct pen_shutter *shutter);

#endif
