/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/light_choice.h"

#include <stdlib.h>

/*
 * share[i] is count times light i's probability. Each column that is less than full takes the rest
 * from a light that has more than its own column holds.
 */
static void fill_columns(struct pen_light_choice *choice, double *share, uint32_t *stack)
{
	uint32_t small = 0;		/* lights below 1, from the front of the stack */
	uint32_t large = choice->count; /* the others, from its end */

	for (uint32_t i = 0; i < choice->count; i++)
		stack[share[i] < 1.0 ? small++ : --large] = i;
	while (small > 0 && large < choice->count) {
		const uint32_t poor = stack[--small];
		const uint32_t rich = stack[large];

		choice->keep[poor] = (float)share[poor];
		choice->other[poor] = rich;
		share[rich] -= 1.0 - share[poor];
		if (share[rich] < 1.0) {
			large++;
			stack[small++] = rich;
		}
	}
}

int pen_light_choice_init(struct pen_light_choice *choice, const double *powers, uint32_t count,
	struct pen_error *err)
{
	double *share = calloc(count, sizeof(*share));
	uint32_t *stack = calloc(count, sizeof(*stack));
	double sum = 0.0;
	int r = 0;

	*choice = (struct pen_light_choice){
		.count = count,
		.keep = calloc(count, sizeof(*choice->keep)),
		.other = calloc(count, sizeof(*choice->other)),
		.chance = calloc(count, sizeof(*choice->chance)),
	};
	if (share == NULL || stack == NULL || choice->keep == NULL || choice->other == NULL ||
		choice->chance == NULL) {
		pen_light_choice_finish(choice);
		r = pen_error_memory(err);
		goto out;
	}
	for (uint32_t i = 0; i < count; i++)
		sum += powers[i];
	for (uint32_t i = 0; i < count; i++) {
		share[i] = sum > 0.0 ? powers[i] / sum * count : 1.0;
		choice->chance[i] = (float)(share[i] / count);
		choice->keep[i] = 1.0f;
		choice->other[i] = i;
	}
	fill_columns(choice, share, stack);
out:
	free(share);
	free(stack);
	return r;
}

void pen_light_choice_finish(struct pen_light_choice *choice)
{
	free(choice->keep);
	free(choice->other);
	free(choice->chance);
	*choice = (struct pen_light_choice){.count = 0};
}
