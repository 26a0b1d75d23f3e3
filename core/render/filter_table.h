/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_FILTER_TABLE_H
#define PEN_RENDER_FILTER_TABLE_H

#include "core/render/vec.h"
#include "core/scene/desc.h"

enum { PEN_FILTER_CELLS = 1024 };

/*
 * What is known of a filter before its width is. Integrating it takes milliseconds, more than all
 * the rest of a small frame: filter_table_make.c does it when this is built.
 */
struct pen_filter_table {
	double offsets[PEN_FILTER_CELLS]; /* shares of the radius beyond which (i / CELLS)^2 lies */
	double mean;			  /* of f over the half axis */
};

extern const struct pen_filter_table pen_filter_tables[PEN_FILTER_COUNT];

/* Mitchell and Netravali 1988 with B = C = 1/3, at |r| <= 2. */
PEN_LANE float pen_filter_mitchell(float r)
{
	const float inner = 16.0f / 18.0f + r * r * (-2.0f + r * (21.0f / 18.0f));
	const float outer = 32.0f / 18.0f + r * (-60.0f / 18.0f + r * (2.0f + r * (-7.0f / 18.0f)));

	return r < 1.0f ? inner : outer;
}

#endif
