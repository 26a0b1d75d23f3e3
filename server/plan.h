/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_PLAN_H
#define PEN_SERVER_PLAN_H

#include "core/base/rect.h"

#include <stdint.h>

/*
 * The tile size for an image: 64 pixels, or 128 where a pixel has few samples; smaller ones where
 * that would leave less than four tiles for each of the farm's render processes, as long as there
 * is enough to render in a tile. Frames of an animation are rendered side by side: up to four count
 * together, and more samples are few. The image does not depend on it.
 */
uint32_t pen_plan_tile_px(
	struct pen_rect crop, uint32_t samples, uint32_t frames, uint32_t processes);

#endif
