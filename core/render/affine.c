/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/affine.h"

#include <math.h>

static void rotation_of_quaternion(const double q[4], double ret_r[3][3])
{
	const double x = q[0], y = q[1], z = q[2], w = q[3];

	ret_r[0][0] = 1.0 - 2.0 * (y * y + z * z);
	ret_r[0][1] = 2.0 * (x * y - z * w);
	ret_r[0][2] = 2.0 * (x * z + y * w);
	ret_r[1][0] = 2.0 * (x * y + z * w);
	ret_r[1][1] = 1.0 - 2.0 * (x * x + z * z);
	ret_r[1][2] = 2.0 * (y * z - x * w);
	ret_r[2][0] = 2.0 * (x * z - y * w);
	ret_r[2][1] = 2.0 * (y * z + x * w);
	ret_r[2][2] = 1.0 - 2.0 * (x * x + y * y);
}

/* Shepperd's method: the largest of the four components is taken from the diagonal. */
static void quaternion_of_rotation(double r[3][3], double ret_q[4])
{
	const double trace = r[0][0] + r[1][1] + r[2][2];

	if (trace > 0.0) {
		const double s = 2.0 * sqrt(1.0 + trace);

		ret_q[0] = (r[2][1] - r[1][2]) / s;
		ret_q[1] = (r[0][2] - r[2][0]) / s;
		ret_q[2] = (r[1][0] - r[0][1]) / s;
		ret_q[3] = 0.25 * s;
		return;
	}

	const int i = r[1][1] > r[0][0] ? (r[2][2] > r[1][1] ? 2 : 1) : (r[2][2] > r[0][0] ? 2 : 0);
	const int j = (i + 1) % 3, k = (i + 2) % 3;
	const double s = 2.0 * sqrt(1.0 + r[i][i] - r[j][j] - r[k][k]);

	ret_q[i] = 0.25 * s;
	ret_q[j] = (r[j][i] + r[i][j]) / s;
	ret_q[k] = (r[k][i] + r[i][k]) / s;
	ret_q[3] = (r[k][j] - r[j][k]) / s;
}

struct pen_affine pen_affine_of_pose(const struct pen_pose *pose)
{
	struct pen_affine a;
	double r[3][3];

	rotation_of_quaternion(pose->rotate, r);
	for (int i = 0; i < 3; i++) {
		for (int j = 0; j < 3; j++)
			a.m[i][j] = r[i][j] * pose->scale[j];
		a.m[i][3] = pose->translate[i];
	}
	return a;
}

struct pen_affine pen_affine_product(const struct pen_affine *a, const struct pen_affine *b)
{
	struct pen_affine c;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			c.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] +
				    a->m[i][2] * b->m[2][j] + (j == 3 ? a->m[i][3] : 0.0);
	return c;
}

double pen_affine_determinant(const struct pen_affine *a)
{
	const double(*m)[4] = a->m;

	return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
	       m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
	       m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

bool pen_affine_is_singular(const struct pen_affine *a)
{
	double size = 0.0;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			size = fmax(size, fabs(a->m[i][j]));
	for (int i = 0; i < 3; i++)
		if (!isfinite(a->m[i][0] + a->m[i][1] + a->m[i][2] + a->m[i][3]))
			return true;
	/* Embree inverts in float: a volume of less than 1e-9 of the cube, or 1e-30, is too flat.
	 */
	return !(fabs(pen_affine_determinant(a)) > fmax(1e-9 * size * size * size, 1e-30));
}

/* Gram-Schmidt from the first column on; the last axis is a cross product, so that the rotation is
 * proper and a mirror shows as a negative scale. */
struct pen_placement pen_affine_decompose(const struct pen_affine *a)
{
	struct pen_placement p = {.translate = {a->m[0][3], a->m[1][3], a->m[2][3]}};
	double q[3][3]; /* columns are axes */
	double c[3][3], y[3], length;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			c[j][i] = a->m[i][j];
	p.scale[0] = sqrt(c[0][0] * c[0][0] + c[0][1] * c[0][1] + c[0][2] * c[0][2]);
	for (int i = 0; i < 3; i++) {
		q[i][0] = c[0][i] / p.scale[0];
		p.skew_xy += q[i][0] * c[1][i];
		p.skew_xz += q[i][0] * c[2][i];
	}
	for (int i = 0; i < 3; i++)
		y[i] = c[1][i] - p.skew_xy * q[i][0];
	length = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
	p.scale[1] = length;
	for (int i = 0; i < 3; i++) {
		q[i][1] = y[i] / length;
		p.skew_yz += q[i][1] * c[2][i];
	}
	for (int i = 0; i < 3; i++) {
		const int j = (i + 1) % 3, k = (i + 2) % 3;

		q[i][2] = q[j][0] * q[k][1] - q[k][0] * q[j][1];
		p.scale[2] += q[i][2] * c[2][i];
	}
	quaternion_of_rotation(q, p.rotate);
	return p;
}

void pen_slerp(const double a[4], const double b[4], double s, double ret_q[4])
{
	double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
	const double sign = cosine < 0.0 ? -1.0 : 1.0;
	double from = 1.0 - s, to = s, length = 0.0;

	cosine = fmin(fabs(cosine), 1.0);
	if (cosine < 1.0 - 1e-12) {
		const double angle = acos(cosine);

		from = sin(from * angle) / sin(angle);
		to = sin(to * angle) / sin(angle);
	}
	for (int i = 0; i < 4; i++) {
		ret_q[i] = from * a[i] + to * sign * b[i];
		length += ret_q[i] * ret_q[i];
	}
	for (int i = 0; i < 4; i++)
		ret_q[i] /= sqrt(length);
}

struct pen_affine pen_affine_of_placement(const struct pen_placement *p)
{
	const struct pen_affine triangle = {{{p->scale[0], p->skew_xy, p->skew_xz, 0.0},
		{0.0, p->scale[1], p->skew_yz, 0.0}, {0.0, 0.0, p->scale[2], 0.0}}};
	struct pen_pose rigid = {.scale = {1.0, 1.0, 1.0}};
	struct pen_affine a;

	for (int i = 0; i < 3; i++)
		rigid.translate[i] = p->translate[i];
	for (int i = 0; i < 4; i++)
		rigid.rotate[i] = p->rotate[i];
	a = pen_affine_of_pose(&rigid);
	return pen_affine_product(&a, &triangle);
}

void pen_affine_point(const struct pen_affine *a, const double p[3], double ret_q[3])
{
	for (int i = 0; i < 3; i++)
		ret_q[i] = a->m[i][0] * p[0] + a->m[i][1] * p[1] + a->m[i][2] * p[2] + a->m[i][3];
}

/* The cofactors are the inverse transpose, up to a factor, whose sign is put right. */
void pen_affine_normal(const struct pen_affine *a, const float n[3], float ret_n[3])
{
	const double sign = pen_affine_determinant(a) < 0.0 ? -1.0 : 1.0;
	double r[3], length = 0.0;

	for (int i = 0; i < 3; i++) {
		const int j = (i + 1) % 3, k = (i + 2) % 3;

		r[i] = 0.0;
		for (int c = 0; c < 3; c++) {
			const int d = (c + 1) % 3, e = (c + 2) % 3;

			r[i] += sign * (double)n[c] *
				(a->m[j][d] * a->m[k][e] - a->m[j][e] * a->m[k][d]);
		}
		length += r[i] * r[i];
	}
	length = sqrt(length);
	for (int i = 0; i < 3; i++)
		ret_n[i] = length > 0.0 ? (float)(r[i] / length) : 0.0f;
}
