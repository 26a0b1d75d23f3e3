/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/closed.h"

#include <stdlib.h>
#include <string.h>

/* A vertex's place, to bring together those at one. */
struct place {
	float p[3];
	uint32_t vertex;
};

static int compare_places(const void *a, const void *b)
{
	const struct place *x = a, *y = b;

	for (int k = 0; k < 3; k++)
		if (x->p[k] != y->p[k])
			return x->p[k] < y->p[k] ? -1 : 1;
	return 0;
}

/* An edge with its lesser end first, and which way round a triangle goes along it. */
struct edge {
	uint32_t low, high;
	int32_t way;
};

static int compare_edges(const void *a, const void *b)
{
	const struct edge *x = a, *y = b;

	if (x->low != y->low)
		return x->low < y->low ? -1 : 1;
	return x->high < y->high ? -1 : x->high > y->high;
}

/* Numbers vertices by their place. */
static void weld(const struct pen_geometry *geometry, const struct pen_model *model,
	struct place *places, uint32_t *ret_numbers)
{
	for (uint32_t i = 0; i < model->vertex_count; i++) {
		const float *v = geometry->vertices + 3 * ((size_t)model->vertex_first + i);

		places[i] = (struct place){{v[0], v[1], v[2]}, i};
	}
	qsort(places, model->vertex_count, sizeof *places, compare_places);
	for (uint32_t i = 0, number = 0; i < model->vertex_count; i++) {
		if (i > 0 && compare_places(&places[i - 1], &places[i]) != 0)
			number = i;
		ret_numbers[places[i].vertex] = number;
	}
}

static uint32_t list_edges(const struct pen_geometry *geometry, const struct pen_model *model,
	const uint32_t *numbers, struct edge *ret_edges)
{
	uint32_t count = 0;

	for (uint32_t i = 0; i < model->count; i++) {
		const uint32_t *index = geometry->indices + 3 * ((size_t)model->first + i);

		for (int k = 0; k < 3; k++) {
			const uint32_t a = numbers[index[k] - model->vertex_first];
			const uint32_t b = numbers[index[(k + 1) % 3] - model->vertex_first];

			if (a != b)
				ret_edges[count++] =
					(struct edge){a < b ? a : b, a < b ? b : a, a < b ? 1 : -1};
		}
	}
	return count;
}

static bool all_balance(struct edge *edges, uint32_t count)
{
	int64_t sum = 0;

	qsort(edges, count, sizeof *edges, compare_edges);
	for (uint32_t i = 0; i < count; i++) {
		sum += edges[i].way;
		if (i + 1 == count || compare_edges(&edges[i], &edges[i + 1]) != 0) {
			if (sum != 0)
				return false;
		}
	}
	return count > 0;
}

int pen_closed(const struct pen_geometry *geometry, const struct pen_model *model,
	bool *ret_is_closed, struct pen_error *err)
{
	struct place *places;
	uint32_t *numbers;
	struct edge *edges;
	int r = 0;

	if (model->type != PEN_MODEL_TRIANGLES) {
		*ret_is_closed = model->type == PEN_MODEL_SPHERES;
		return 0;
	}
	places = calloc(model->vertex_count + 1ul, sizeof *places);
	numbers = calloc(model->vertex_count + 1ul, sizeof *numbers);
	edges = calloc(3ul * model->count + 1, sizeof *edges);
	if (places && numbers && edges) {
		weld(geometry, model, places, numbers);
		*ret_is_closed = all_balance(edges, list_edges(geometry, model, numbers, edges));
	} else {
		r = pen_error_memory(err);
	}
	free(places);
	free(numbers);
	free(edges);
	return r;
}
