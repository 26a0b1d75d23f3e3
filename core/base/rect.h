/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_RECT_H
#define PEN_BASE_RECT_H

#include <stdbool.h>
#include <stdint.h>

/* Pixels x0 <= x < x1, y0 <= y < y1; y grows downwards. */
struct pen_rect {
	uint32_t x0, y0, x1, y1;
};

static inline uint32_t pen_rect_width(struct pen_rect r)
{
	return r.x1 - r.x0;
}

static inline uint32_t pen_rect_height(struct pen_rect r)
{
	return r.y1 - r.y0;
}

static inline uint64_t pen_rect_area(struct pen_rect r)
{
	return (uint64_t)pen_rect_width(r) * pen_rect_height(r);
}

static inline bool pen_rect_valid(struct pen_rect r)
{
	return r.x0 < r.x1 && r.y0 < r.y1;
}

/* Whether inner lies within outer. */
static inline bool pen_rect_contains(struct pen_rect outer, struct pen_rect inner)
{
	return inner.x0 >= outer.x0 && inner.y0 >= outer.y0 && inner.x1 <= outer.x1 &&
	       inner.y1 <= outer.y1;
}

#endif
