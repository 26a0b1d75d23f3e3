/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_ENVIRONMENT_H
#define PEN_RENDER_ENVIRONMENT_H

#include "core/base/error.h"
#include "core/image/mipmap.h"
#include "core/render/texture.h"
#include "core/render/vec.h"
#include "core/scene/desc.h"

#include <stdint.h>

/*
 * A latitude-longitude picture of the surroundings. Its top is +Y; its centre is seen along +X and
 * its right quarter along +Z, as Blender shows one of a scene that it exports to glTF (there +X and
 * -Y). A rotation turns it counter-clockwise seen from above.
 *
 * Directions are sampled by a table of at most 1024 x 512 cells: a row by its power, then a cell of
 * the row, each by inverting a running sum of whole numbers. Within a cell they are uniform by
 * solid angle.
 */
struct pen_environment {
	struct pen_texture texture;
	float intensity;
	float turn; /* of the rotation, in turns */
	uint32_t columns, rows;
	float *row_cos;	       /* of the polar angle where each row begins, and of the end */
	uint32_t *row_sums;    /* rows + 1, up to PEN_ENVIRONMENT_SUM */
	uint32_t *column_sums; /* columns + 1 a row, likewise */
};

enum { PEN_ENVIRONMENT_COLUMNS_MAX = 1024, PEN_ENVIRONMENT_ROWS_MAX = 512 };

#define PEN_ENVIRONMENT_SUM (1u << 24)

/* mipmap must outlive the result, whose texture refers to it. PEN_ENOMEM. */
int pen_environment_create(const struct pen_mipmap *mipmap, const struct pen_background_desc *desc,
	struct pen_environment **ret_environment, struct pen_error *err);
void pen_environment_destroy(struct pen_environment *environment);

/* pdf by solid angle: 0 where nothing is to be found; direction is unit all the same. */
struct pen_environment_sample {
	struct pen_vec3 direction;
	float pdf;
};

struct pen_environment_sample pen_environment_sample(
	const struct pen_environment *environment, float u, float v);

float pen_environment_pdf(const struct pen_environment *environment, struct pen_vec3 direction);

/*
 * The radiance from a direction, as the mean over a cone of a full width in radians; of width 0 it
 * is interpolated, and then 0 only where pen_environment_pdf is.
 */
struct pen_vec3 pen_environment_radiance(
	const struct pen_environment *environment, struct pen_vec3 direction, float width);

#endif
