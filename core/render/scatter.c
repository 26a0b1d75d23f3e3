/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/scatter.h"

#include "core/render/bsdf.h"

#include <assert.h>

/* Whitted's branches below this throughput are not followed. */
#define WHITTED_THROUGHPUT_MIN 1e-5f

/* Events of a path before Russian roulette may end it. */
enum { ROULETTE_DEPTH = 4 };

/* Where sixteen paths go on to, and what that counts for. */
struct outgoing {
	_Alignas(64) float x[PEN_LANES];
	float y[PEN_LANES];
	float z[PEN_LANES];
	float weight[PEN_LANES]; /* 0: the path ends */
	float pdf[PEN_LANES];
};

static struct pen_vec3 normal_of(const struct pen_points *points, int lane)
{
	return pen_vec3(points->normal_x[lane], points->normal_y[lane], points->normal_z[lane]);
}

static struct pen_vec3 towards_origin(const struct pen_rays *rays, int lane)
{
	return pen_vec3(
		-rays->direction_x[lane], -rays->direction_y[lane], -rays->direction_z[lane]);
}

static void choose(struct outgoing *to, int lane, int wanted, struct pen_lobe lobe)
{
	to->x[lane] = wanted ? lobe.direction.x : to->x[lane];
	to->y[lane] = wanted ? lobe.direction.y : to->y[lane];
	to->z[lane] = wanted ? lobe.direction.z : to->z[lane];
	to->weight[lane] = wanted ? lobe.weight : to->weight[lane];
	to->pdf[lane] = wanted ? lobe.pdf : to->pdf[lane];
}

static void end_all(struct outgoing *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		to->x[i] = to->y[i] = to->weight[i] = to->pdf[i] = 0.0f;
		to->z[i] = 1.0f;
	}
}

static void scatter_matte(
	const struct pen_points *points, const float *u, const float *v, struct outgoing *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		choose(to, i, points->kind[i] == PEN_KIND_MATTE,
			pen_matte_sample(normal_of(points, i), u[i], v[i]));
}

static void scatter_mirror(
	const struct pen_rays *rays, const struct pen_points *points, struct outgoing *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		choose(to, i, points->kind[i] == PEN_KIND_MIRROR,
			pen_mirror_sample(normal_of(points, i), towards_origin(rays, i)));
}

static void scatter_glossy(const struct pen_rays *rays, const struct pen_points *points,
	const float *u, const float *v, struct outgoing *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		choose(to, i, points->kind[i] == PEN_KIND_GLOSSY,
			pen_glossy_sample(points->alpha[i], normal_of(points, i),
				towards_origin(rays, i), u[i], v[i]));
}

static void scatter_clear(const struct pen_rays *rays, const struct pen_points *points,
	const float *choice, struct outgoing *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		choose(to, i, points->kind[i] == PEN_KIND_CLEAR,
			pen_glass_smooth_sample(points->eta[i], normal_of(points, i),
				towards_origin(rays, i), choice[i]));
}

static void scatter_frosted(const struct pen_rays *rays, const struct pen_points *points,
	const float *u, const float *v, const float *choice, struct outgoing *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		choose(to, i, points->kind[i] == PEN_KIND_FROSTED,
			pen_glass_sample(points->alpha[i], points->eta[i], normal_of(points, i),
				towards_origin(rays, i), u[i], v[i], choice[i]));
}

static void append(struct pen_path_queue *queue, const struct pen_paths *from,
	const struct pen_points *points, const struct outgoing *out, int lane, float weight)
{
	const struct pen_vec3 d = {out->x[lane], out->y[lane], out->z[lane]};
	const struct pen_vec3 o = pen_points_leave(points, lane, d);
	struct pen_paths *to = &queue->packets[queue->count / PEN_LANES];
	struct pen_rays *rays = &to->packet.rays;
	const uint32_t i = queue->count % PEN_LANES;

	assert(queue->count < queue->capacity);
	queue->count++;
	rays->origin_x[i] = o.x;
	rays->origin_y[i] = o.y;
	rays->origin_z[i] = o.z;
	rays->tnear[i] = 0.0f;
	rays->direction_x[i] = d.x;
	rays->direction_y[i] = d.y;
	rays->direction_z[i] = d.z;
	rays->time[i] = from->packet.rays.time[lane];
	rays->tfar[i] = INFINITY;
	to->red[i] = from->red[lane] * points->red[lane] * weight;
	to->green[i] = from->green[lane] * points->green[lane] * weight;
	to->blue[i] = from->blue[lane] * points->blue[lane] * weight;
	to->lobe_pdf[i] = out->pdf[lane];
	to->slot[i] = from->slot[lane];
	to->key[i] = from->key[lane];
	to->index[i] = from->index[lane];
}

void pen_path_queue_close(struct pen_path_queue *queue)
{
	const uint32_t used = queue->count % PEN_LANES;
	struct pen_paths *last = &queue->packets[queue->count / PEN_LANES];

	for (uint32_t i = used; i < PEN_LANES && used > 0; i++) {
		pen_rays_park(&last->packet.rays, (int)i);
		last->packet.rays.origin_x[i] = last->packet.rays.origin_y[i] = 0.0f;
		last->packet.rays.origin_z[i] = last->packet.rays.time[i] = 0.0f;
		last->packet.rays.direction_x[i] = last->packet.rays.direction_y[i] = 0.0f;
		last->packet.rays.direction_z[i] = 1.0f;
		last->red[i] = last->green[i] = last->blue[i] = last->lobe_pdf[i] = 0.0f;
		last->slot[i] = last->key[i] = last->index[i] = 0;
	}
}

static void sample_lobes(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct outgoing *out)
{
	const struct pen_rays *rays = &paths->packet.rays;
	const bool is_path = pass->scene->desc->integrator.type == PEN_INTEGRATOR_PATH;
	_Alignas(64) float u[PEN_LANES];
	_Alignas(64) float v[PEN_LANES];
	_Alignas(64) float choice[PEN_LANES];
	_Alignas(64) float unused[PEN_LANES];

	end_all(out);
	pen_sampler_pairs(pass->sampler, pen_sample_group(pass->depth, PEN_SLOT_LOBE), PEN_LANES,
		paths->key, paths->index, u, v);
	if (points->kinds & (PEN_KIND_CLEAR | PEN_KIND_FROSTED))
		pen_sampler_pairs(pass->sampler,
			pen_sample_group(pass->depth, PEN_SLOT_LOBE_CHOICE), PEN_LANES, paths->key,
			paths->index, choice, unused);
	if (is_path && (points->kinds & PEN_KIND_MATTE))
		scatter_matte(points, u, v, out);
	if (points->kinds & PEN_KIND_MIRROR)
		scatter_mirror(rays, points, out);
	if (points->kinds & PEN_KIND_GLOSSY)
		scatter_glossy(rays, points, u, v, out);
	if (points->kinds & PEN_KIND_CLEAR)
		scatter_clear(rays, points, choice, out);
	if (points->kinds & PEN_KIND_FROSTED)
		scatter_frosted(rays, points, u, v, choice, out);
}

/*
 * Directions that the shading normal and the surface itself see on different sides are lost: a
 * reflection would otherwise pass through, a refraction would not.
 */
static void lose_disagreeing(const struct pen_points *points, struct outgoing *out)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_vec3 d = {out->x[i], out->y[i], out->z[i]};
		const struct pen_vec3 f = {
			points->facing_x[i], points->facing_y[i], points->facing_z[i]};
		const float agreement = pen_dot(d, normal_of(points, i)) * pen_dot(d, f);

		out->weight[i] = agreement > 0.0f ? out->weight[i] : 0.0f;
	}
}

/* Ends dim paths of the path integrator by chance and makes up for it in the others. */
static void play_roulette(
	const struct pen_pass *pass, const struct pen_paths *paths, struct outgoing *out)
{
	_Alignas(64) float u[PEN_LANES];
	_Alignas(64) float unused[PEN_LANES];

	if (pass->scene->desc->integrator.type != PEN_INTEGRATOR_PATH ||
		pass->depth < ROULETTE_DEPTH)
		return;
	pen_sampler_pairs(pass->sampler, pen_sample_group(pass->depth, PEN_SLOT_ROULETTE),
		PEN_LANES, paths->key, paths->index, u, unused);
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const float brightest =
			pen_max(pen_max(fabsf(paths->red[i]), fabsf(paths->green[i])),
				fabsf(paths->blue[i]));
		const float survival = pen_clamp(brightest, 0.05f, 1.0f);

		out->weight[i] = u[i] < survival ? out->weight[i] / survival : 0.0f;
	}
}

static void scatter_one(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, uint32_t slot_end, struct pen_path_queue *queue)
{
	struct outgoing out;

	sample_lobes(pass, paths, points, &out);
	lose_disagreeing(points, &out);
	play_roulette(pass, paths, &out);
	for (int i = 0; i < PEN_LANES; i++)
		if (out.weight[i] > 0.0f && paths->slot[i] < slot_end)
			append(queue, paths, points, &out, i, out.weight[i]);
}

static bool is_worth_following(const struct pen_paths *paths, int lane, float weight)
{
	const float brightest = pen_max(pen_max(fabsf(paths->red[lane]), fabsf(paths->green[lane])),
		fabsf(paths->blue[lane]));

	return brightest * weight >= WHITTED_THROUGHPUT_MIN;
}

/* Reflection, then refraction, each with its Fresnel share. */
static void scatter_both(const struct pen_paths *paths, const struct pen_points *points,
	uint32_t slot_end, struct pen_path_queue *queue)
{
	const struct pen_rays *rays = &paths->packet.rays;

	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_vec3 n = normal_of(points, i);
		const struct pen_vec3 wo = towards_origin(rays, i);
		const bool is_clear = points->kind[i] == PEN_KIND_CLEAR;
		const float share =
			is_clear ? pen_fresnel(pen_max(pen_dot(wo, n), 0.0f), points->eta[i])
				 : 1.0f;
		struct outgoing out;

		if (paths->slot[i] >= slot_end || !(is_clear || points->kind[i] == PEN_KIND_MIRROR))
			continue;
		choose(&out, i, 1, pen_mirror_sample(n, wo));
		if (is_worth_following(paths, i, share))
			append(queue, paths, points, &out, i, share);
		if (!is_clear || !is_worth_following(paths, i, 1.0f - share))
			continue;
		choose(&out, i, 1,
			(struct pen_lobe){.direction = pen_refract(wo, n, points->eta[i])});
		append(queue, paths, points, &out, i, 1.0f - share);
	}
}

void pen_scatter(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, uint32_t slot_end, struct pen_path_queue *queue)
{
	const struct pen_integrator_desc *integrator = &pass->scene->desc->integrator;
	const bool is_path = integrator->type == PEN_INTEGRATOR_PATH;
	const uint32_t going_on = PEN_KIND_MIRROR | PEN_KIND_GLOSSY | PEN_KIND_CLEAR |
				  PEN_KIND_FROSTED | (is_path ? PEN_KIND_MATTE : 0u);

	if ((points->kinds & going_on) == 0)
		return;
	if (integrator->type != PEN_INTEGRATOR_WHITTED)
		scatter_one(pass, paths, points, slot_end, queue);
	else if (pass->depth < integrator->max_depth)
		scatter_both(paths, points, slot_end, queue);
}
