/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_AFFINE_H
#define PEN_RENDER_AFFINE_H

#include "core/scene/desc.h"

#include <stdbool.h>

/* A point maps to the first three columns times it, plus the fourth. */
struct pen_affine {
	double m[3][4];
};

/*
 * The same in the form that interpolates well: translate * rotate * upper triangle, the triangle
 * with scale on its diagonal. Translation and triangle interpolate linearly, rotation (x y z w)
 * by slerp.
 */
struct pen_placement {
	double scale[3];
	double skew_xy, skew_xz, skew_yz;
	double rotate[4];
	double translate[3];
};

struct pen_affine pen_affine_of_pose(const struct pen_pose *pose);
struct pen_affine pen_affine_product(const struct pen_affine *a, const struct pen_affine *b);
double pen_affine_determinant(const struct pen_affine *a);
/* Whether it keeps hardly any volume, or holds a number that is not finite. */
bool pen_affine_is_singular(const struct pen_affine *a);
struct pen_placement pen_affine_decompose(const struct pen_affine *a);
struct pen_affine pen_affine_of_placement(const struct pen_placement *placement);

void pen_affine_point(const struct pen_affine *a, const double p[3], double ret_q[3]);

/* A normal, carried by the inverse transpose: of length 1, or 0 where that is singular. */
void pen_affine_normal(const struct pen_affine *a, const float n[3], float ret_n[3]);

/* From unit quaternion a at s = 0 to b at s = 1 by the shortest arc. */
void pen_slerp(const double a[4], const double b[4], double s, double ret_q[4]);

#endif
