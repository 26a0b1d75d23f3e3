/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_SCATTER_H
#define PEN_RENDER_SCATTER_H

#include "core/render/path.h"
#include "core/render/point.h"

/* Paths in the order in which they were added, sixteen to a packet. */
struct pen_path_queue {
	struct pen_paths *packets;
	uint32_t count, capacity; /* paths */
	bool has_cones;		  /* paths know what a sample sees */
	bool has_receivers;	  /* and what they left */
	float sample_share;	  /* of a lobe, see struct pen_render_scene */
};

/* Parks the free lanes of the last packet. */
void pen_path_queue_close(struct pen_path_queue *queue);

/*
 * Appends the paths that go on from the points, lane by lane: one each, by one sample of a lobe;
 * for whitted, before max_depth, both the reflected and the refracted one. Paths of slots from
 * slot_end on are dropped.
 */
void pen_scatter(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, uint32_t slot_end, struct pen_path_queue *queue);

#endif
