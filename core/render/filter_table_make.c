/* SPDX-License-Identifier: Apache-2.0 */
/* Writes the source of pen_filter_tables to its output. */
#include "core/render/filter_table.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* A filter at a share t in [0, 1] of its radius, up to a factor. */
static double profile(enum pen_filter_type type, double t)
{
	switch (type) {
	case PEN_FILTER_BOX: return 1.0;
	case PEN_FILTER_TRIANGLE: return 1.0 - t;
	case PEN_FILTER_GAUSSIAN: return exp(-4.5 * t * t); /* sigma = radius / 3 */
	case PEN_FILTER_BLACKMAN_HARRIS:
		return 0.35875 + 0.48829 * cos(M_PI * t) + 0.14128 * cos(2.0 * M_PI * t) +
		       0.01168 * cos(3.0 * M_PI * t);
	case PEN_FILTER_MITCHELL: return (double)pen_filter_mitchell((float)(2.0 * t));
	case PEN_FILTER_COUNT: break;
	}
	return 0.0;
}

/*
 * Inverts the mass beyond an offset: walks inwards in small steps and notes where the share
 * (i / PEN_FILTER_CELLS)^2 of the whole is reached.
 */
static void tabulate(enum pen_filter_type type, struct pen_filter_table *ret_table)
{
	const int steps = 1 << 17;
	double mass = 0.0;
	double whole = 0.0;
	int cell = 0;

	*ret_table = (struct pen_filter_table){.mean = 0.0};
	for (int i = 0; i < steps; i++) {
		const double f = profile(type, 1.0 - (i + 0.5) / steps);

		whole += fabs(f) / steps;
		ret_table->mean += f / steps;
	}
	for (int i = 0; i < steps && cell < PEN_FILTER_CELLS; i++) {
		const double step = fabs(profile(type, 1.0 - (i + 0.5) / steps)) / steps / whole;

		for (; cell < PEN_FILTER_CELLS; cell++) {
			const double q = (double)cell / PEN_FILTER_CELLS;

			if (q * q > mass + step)
				break;
			ret_table->offsets[cell] = 1.0 - (i + (q * q - mass) / step) / steps;
		}
		mass += step;
	}
}

static void print(const struct pen_filter_table *table)
{
	(void)printf("\t{\n\t\t{\n");
	for (int i = 0; i < PEN_FILTER_CELLS; i++)
		(void)printf("\t\t\t%a,\n", table->offsets[i]);
	(void)printf("\t\t},\n\t\t%a,\n\t},\n", table->mean);
}

int main(void)
{
	(void)printf("#include \"core/render/filter_table.h\"\n\n"
		     "const struct pen_filter_table pen_filter_tables[PEN_FILTER_COUNT] = {\n");
	for (int type = 0; type < PEN_FILTER_COUNT; type++) {
		struct pen_filter_table table;

		tabulate((enum pen_filter_type)type, &table);
		print(&table);
	}
	(void)printf("};\n");
	return fflush(stdout) == 0 && !ferror(stdout) ? EXIT_SUCCESS : EXIT_FAILURE;
}
