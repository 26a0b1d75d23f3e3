/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_PACKET_H
#define PEN_RENDER_PACKET_H

#include <stdint.h>

enum { PEN_LANES = 16 };

/* Sixteen rays, laid out as Embree's RTCRay16. A lane with tnear > tfar is parked: not traced. */
struct pen_rays {
	_Alignas(64) float origin_x[PEN_LANES];
	float origin_y[PEN_LANES];
	float origin_z[PEN_LANES];
	float tnear[PEN_LANES];
	float direction_x[PEN_LANES];
	float direction_y[PEN_LANES];
	float direction_z[PEN_LANES];
	float time[PEN_LANES]; /* fraction of the shutter */
	float tfar[PEN_LANES]; /* becomes the hit's distance; negative in occluded lanes */
	uint32_t mask[PEN_LANES];
	uint32_t id[PEN_LANES];
	uint32_t flags[PEN_LANES];
};

/* What they hit, laid out as RTCHit16. */
struct pen_hits {
	_Alignas(64) float normal_x[PEN_LANES];
	float normal_y[PEN_LANES];
	float normal_z[PEN_LANES];
	float u[PEN_LANES];
	float v[PEN_LANES];
	uint32_t primitive[PEN_LANES];
	uint32_t geometry[PEN_LANES]; /* PEN_NO_INDEX: nothing */
	uint32_t instance[PEN_LANES]; /* PEN_NO_INDEX: geometry is the shape; else the shape */
};

struct pen_packet {
	struct pen_rays rays;
	struct pen_hits hits;
};

#endif
