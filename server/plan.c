/* SPDX-License-Identifier: Apache-2.0 */
#include "server/plan.h"

#include "core/base/tile.h"

enum { TILES_PER_PROCESS = 4, TILE_PX = 64, TILE_PX_MIN = 16 };

uint32_t pen_plan_tile_px(struct pen_rect crop, uint32_t processes)
{
	struct pen_tiling tiling;
	uint32_t tile_px = TILE_PX;

	for (; tile_px > TILE_PX_MIN; tile_px /= 2) {
		pen_tiling_init(&tiling, crop, tile_px);
		if (tiling.count >= TILES_PER_PROCESS * processes)
			break;
	}
	return tile_px;
}
