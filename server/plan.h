/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_PLAN_H
#define PEN_SERVER_PLAN_H

#include "core/base/rect.h"

#include <stdint.h>

/*
 * The tile size for an image: 64 pixels, or 32 or 16 where that would leave less than four tiles
 * for each of the farm's render processes. The image does not depend on it.
 */
uint32_t pen_plan_tile_px(struct pen_rect crop, uint32_t processes);

#endif
