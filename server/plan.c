/* SPDX-License-Identifier: Apache-2.0 */
#include "server/plan.h"

#include "core/base/tile.h"

enum {
	TILES_PER_PROCESS = 4,
	TILE_PX = 64,
	TILE_PX_MIN = 16,
	TILE_PX_FEW = 128, /* where there are at most so many samples: */
	SAMPLES_FEW = 4,
	SAMPLES_FEW_FRAMES = 64, /* of an animation, where nobody waits for a frame's last tile */
	FRAMES_ABREAST = 4,
	TILE_SAMPLES_MIN = 8192 /* rendering fewer takes less time than handing them out */
};

uint32_t pen_plan_tile_px(
	struct pen_rect crop, uint32_t samples, uint32_t frames, uint32_t processes)
{
	const uint32_t few = frames > 1 ? SAMPLES_FEW_FRAMES : SAMPLES_FEW;
	const uint32_t abreast = frames < FRAMES_ABREAST ? frames : FRAMES_ABREAST;
	uint32_t tile_px = samples <= few ? TILE_PX_FEW : TILE_PX;
	struct pen_tiling tiling;

	for (; tile_px > TILE_PX_MIN; tile_px /= 2) {
		pen_tiling_init(&tiling, crop, tile_px);
		if (abreast * tiling.count >= TILES_PER_PROCESS * processes ||
			(uint64_t)tile_px * tile_px / 4 * samples < TILE_SAMPLES_MIN)
			break;
	}
	return tile_px;
}
