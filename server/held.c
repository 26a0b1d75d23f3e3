/* SPDX-License-Identifier: Apache-2.0 */
#include "server/held.h"

#include "core/base/limits.h"
#include "server/tree.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOMENT_MS = 100 };

void pen_held_finish(struct pen_held *held)
{
	free(held->text);
	*held = (struct pen_held){0};
}

static json_t *tile_json(const struct pen_job *job, const struct pen_sched_held *unit)
{
	const struct pen_rect rect = pen_tiling_rect(&job->tiling, unit->tile);

	return json_pack("[I, I, I, I, I]", (json_int_t)unit->frame, (json_int_t)rect.x0,
		(json_int_t)rect.y0, (json_int_t)pen_rect_width(rect),
		(json_int_t)pen_rect_height(rect));
}

/* A worker, and those of the units, in order of workers, that are its; tells how many. */
static json_t *worker_json(const struct pen_farm *farm, const struct pen_job *job,
	const struct pen_sched_held *units, size_t count, size_t *ret_count)
{
	const struct pen_worker *worker = pen_farm_next(farm, units[0].worker - 1);
	const bool is_known = worker && worker->id == units[0].worker;
	json_t *tiles = json_array();
	char id[24];
	size_t i;

	for (i = 0; i < count && units[i].worker == units[0].worker; i++)
		pen_tree_append(&tiles, tile_json(job, &units[i]));
	*ret_count = i;
	(void)snprintf(id, sizeof id, "%" PRIu64, units[0].worker);
	return json_pack("{s:s, s:s?, s:o}", "id", id, "name", is_known ? worker->name : NULL,
		"tiles", tiles);
}

void pen_held_refresh(struct pen_held *held, const struct pen_farm *farm, const struct pen_job *job,
	int64_t now_ms)
{
	struct pen_sched_held units[PEN_EVENT_HELD_MAX];
	json_t *list;
	size_t count, of_worker;

	if (held->text && held->number == job->number && now_ms < held->until_ms)
		return;
	pen_held_finish(held);
	list = json_array();
	count = pen_farm_held(farm, job->number, units, PEN_EVENT_HELD_MAX);
	for (size_t i = 0; i < count; i += of_worker)
		pen_tree_append(&list, worker_json(farm, job, units + i, count - i, &of_worker));
	*held = (struct pen_held){
		.number = job->number,
		.until_ms = now_ms + MOMENT_MS,
		.text = pen_tree_text(json_pack("{s:o}", "workers", list)),
		.count = count,
	};
}
