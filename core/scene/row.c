/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/row.h"

const struct pen_range pen_range_world = {-PEN_COORDINATE_MAX, PEN_COORDINATE_MAX};
const struct pen_range pen_range_positive = {1e-15, PEN_COORDINATE_MAX};
const struct pen_range pen_range_magnitude = {0, PEN_COORDINATE_MAX};
const struct pen_range pen_range_unit = {0, 1};
const struct pen_range pen_range_turn = {-360, 360};
const struct pen_range pen_range_instant = {-PEN_TIME_MAX, PEN_TIME_MAX};
const struct pen_range pen_range_scale = {-PEN_SCALE_MAX, PEN_SCALE_MAX};
