/* SPDX-License-Identifier: Apache-2.0 */
#include "server/reel.h"

#include <assert.h>
#include <stdlib.h>

/* Frames in flight have at least so many tiles together, as far as there may be so many frames. */
enum { TILES_IN_FLIGHT = 1024 };

uint32_t pen_reel_slots(const struct pen_tiling *tiling, uint32_t count)
{
	uint32_t slots = 2 + TILES_IN_FLIGHT / tiling->count;

	if (slots > PEN_REEL_FRAMES_MAX)
		slots = PEN_REEL_FRAMES_MAX;
	return slots < count ? slots : count;
}

int pen_reel_init(struct pen_reel *reel, const struct pen_tiling *tiling, uint32_t first,
	uint32_t end, const struct pen_rounds *rounds, const uint16_t *merged,
	const struct pen_demand *demands, struct pen_error *err)
{
	const uint32_t slots = pen_reel_slots(tiling, end - first);
	int r = 0;

	assert(first < end);
	*reel = (struct pen_reel){
		.backlogs = calloc(slots, sizeof *reel->backlogs),
		.slots = slots,
		.first = first,
		.open = first + (merged ? slots : 1),
		.end = end,
	};
	if (!reel->backlogs)
		return pen_error_memory(err);
	for (uint32_t i = 0; r == 0 && i < slots; i++)
		r = pen_backlog_init(&reel->backlogs[(first + i) % slots], tiling, rounds,
			merged ? merged + (size_t)i * tiling->count : NULL,
			demands ? demands + (size_t)i * tiling->count : NULL, err);
	if (r < 0)
		pen_reel_finish(reel);
	else
		pen_reel_advance(reel);
	return r;
}

void pen_reel_finish(struct pen_reel *reel)
{
	for (uint32_t i = 0; reel->backlogs && i < reel->slots; i++)
		pen_backlog_finish(&reel->backlogs[i]);
	free(reel->backlogs);
	reel->backlogs = NULL;
}

struct pen_backlog *pen_reel_backlog(const struct pen_reel *reel, uint32_t frame)
{
	assert(frame >= reel->first && frame < reel->open);
	return &reel->backlogs[frame % reel->slots];
}

void pen_reel_advance(struct pen_reel *reel)
{
	while (reel->first < reel->open && pen_reel_backlog(reel, reel->first)->tiles_left == 0)
		reel->first++;
	if (reel->open == reel->end || reel->open - reel->first == reel->slots ||
		pen_reel_waiting(reel) > 0)
		return;
	reel->open++;
	pen_backlog_restart(pen_reel_backlog(reel, reel->open - 1));
}

uint64_t pen_reel_waiting(const struct pen_reel *reel)
{
	uint64_t count = 0;

	for (uint32_t i = reel->first; i < reel->open; i++)
		count += pen_reel_backlog(reel, i)->waiting.count;
	return count;
}

uint32_t pen_reel_merging(const struct pen_reel *reel)
{
	uint32_t count = 0;

	for (uint32_t i = reel->first; i < reel->open; i++)
		count += pen_reel_backlog(reel, i)->merging;
	return count;
}
