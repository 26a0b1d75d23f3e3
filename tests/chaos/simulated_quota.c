/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/chaos/simulated_quota.h"

#include "core/base/limits.h"

#include <string.h>

enum { PIXEL_STEP = 3 }; /* every third pixel goes on */

/* How many rounds a cell gets in the end. */
static uint32_t need_of(const struct sim_job *job, uint32_t cell)
{
	const uint32_t spare = job->round_count - job->rounds.sure;
	const uint64_t key = job->shown.number * CELLS_MAX + cell;
	const uint32_t drawn = (uint32_t)(key * 0x9e3779b97f4a7c15u >> 40);

	if (job->rounds.kind == PEN_ROUNDS_EDGE)
		return job->rounds.sure + (drawn % 2) * spare;
	return job->rounds.sure + drawn % (spare + 1);
}

static uint32_t masked_pixels(const struct sim_job *job, uint32_t tile)
{
	const uint64_t area = pen_rect_area(pen_tiling_rect(&job->shown.tiling, tile));

	return (uint32_t)((area + PIXEL_STEP - 1) / PIXEL_STEP);
}

struct pen_demand sim_quota_demand(const struct sim_job *job, uint32_t cell, uint32_t decided)
{
	const uint32_t tile = cell % job->shown.tiling.count;
	const uint64_t area = pen_rect_area(pen_tiling_rect(&job->shown.tiling, tile));
	struct pen_demand demand = pen_demand_first(&job->rounds, area);
	uint32_t need = need_of(job, cell);

	if (decided == 0)
		return demand;
	if (job->rounds.kind == PEN_ROUNDS_ADAPTIVE && need > decided + 1)
		need = decided + 1;
	demand.rounds = (uint16_t)need;
	demand.is_final = need <= decided || need == job->round_count;
	if (need > job->rounds.sure)
		demand.pixels = masked_pixels(job, tile);
	return demand;
}

uint32_t sim_quota_next(const struct sim_job *job, uint32_t decided)
{
	return decided == 0 ? job->rounds.sure : decided + 1;
}

bool sim_quota_mask(const struct sim_job *job, uint32_t tile, uint32_t round, uint8_t *ret_mask)
{
	const uint64_t area = pen_rect_area(pen_tiling_rect(&job->shown.tiling, tile));

	if (round < job->rounds.sure)
		return false;
	memset(ret_mask, 0, PEN_MASK_BYTES_MAX);
	for (size_t i = 0; i < area; i += PIXEL_STEP)
		pen_mask_add(ret_mask, i);
	return true;
}

bool sim_quota_is_met(const struct sim_job *job, uint32_t frame, bool *ret_final)
{
	*ret_final = true;
	for (uint32_t i = 0; i < job->shown.tiling.count; i++) {
		const uint32_t cell = sim_cell(job, frame, i);
		const struct pen_demand demand =
			sim_quota_demand(job, cell, job->frames[frame - 1].decided);

		if (job->cells[cell].rounds < demand.rounds)
			return false;
		*ret_final = *ret_final && demand.is_final;
	}
	return true;
}

bool sim_quota_is_final(const struct sim_job *job, uint32_t frame)
{
	bool is_final;

	return sim_quota_is_met(job, frame, &is_final) && is_final;
}

uint32_t sim_quota_final_frames(const struct sim_job *job)
{
	uint32_t count = 0;

	while (count < job->shown.frame_count && sim_quota_is_final(job, count + 1))
		count++;
	return count;
}
