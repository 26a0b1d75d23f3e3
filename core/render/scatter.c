/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/scatter.h"

#include "core/render/bsdf.h"
#include "core/render/detail.h"

#include <assert.h>
#include <string.h>

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
	const float *red, *green, *blue; /* color of the weight: the points' or the tint */
	float tint_red[PEN_LANES];
	float tint_green[PEN_LANES];
	float tint_blue[PEN_LANES];
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
	to->x[lane] = pen_pick(wanted, lobe.direction.x, to->x[lane]);
	to->y[lane] = pen_pick(wanted, lobe.direction.y, to->y[lane]);
	to->z[lane] = pen_pick(wanted, lobe.direction.z, to->z[lane]);
	to->weight[lane] = pen_pick(wanted, lobe.weight, to->weight[lane]);
	to->pdf[lane] = pen_pick(wanted, lobe.pdf, to->pdf[lane]);
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

/*
 * The cone of what a sample sees goes on, wider by the sample's share of the lobe, whose solid
 * angle is about 1 / pdf. Curvature is left out: the footprint is then too small, which costs
 * samples and changes no mean.
 */
static void carry_cone(const struct pen_path_queue *queue, const struct pen_paths *from,
	const struct outgoing *out, int lane, struct pen_paths *to, uint32_t i)
{
	const float pdf = out->pdf[lane];
	const float lobe = pdf > 0.0f ? sqrtf(PEN_INV_PI / pdf) : 0.0f;

	to->width[i] = from->width[lane] + from->spread[lane] * from->packet.rays.tfar[lane];
	to->spread[i] = pen_min(from->spread[lane] + queue->sample_share * lobe, 1.0f);
}

static void carry_receiver(
	const struct pen_points *points, int lane, struct pen_paths *to, uint32_t i)
{
	const struct pen_vec3 normal = pen_points_receiver(points, lane);

	to->receiver_x[i] = normal.x;
	to->receiver_y[i] = normal.y;
	to->receiver_z[i] = normal.z;
}

static void set_tint(struct outgoing *to, const struct pen_points *points)
{
	memcpy(to->tint_red, points->red, sizeof to->tint_red);
	memcpy(to->tint_green, points->green, sizeof to->tint_green);
	memcpy(to->tint_blue, points->blue, sizeof to->tint_blue);
	to->red = to->tint_red;
	to->green = to->tint_green;
	to->blue = to->tint_blue;
}

PEN_LANE void scatter_principled_one(bool is_path, const struct pen_rays *rays,
	const struct pen_points *points, const float *u, const float *v, const float *choice, int i,
	struct outgoing *to)
{
	const float diffuse_max =
		pen_diffuse_chance_max(is_path ? PEN_INTEGRATOR_PATH : PEN_INTEGRATOR_DISTRIBUTION);
	const struct pen_principled p = pen_detail_principled(points, i);
	const struct pen_vec3 n = normal_of(points, i), wo = towards_origin(rays, i);
	const struct pen_principled_chances chances =
		pen_principled_chances(&p, n, wo, diffuse_max);
	const struct pen_vec3 wi =
		pen_principled_sample(&p, &chances, n, wo, u[i], v[i], choice[i], is_path);
	const int is_lost = (wi.x == 0.0f) & (wi.y == 0.0f) & (wi.z == 0.0f);
	const struct pen_principled_value value = pen_principled_eval(&p, n, wo, wi);
	const float pdf = pen_principled_pdf(&value, &chances, is_path);
	const struct pen_vec3 sum = pen_madd(value.others, is_path ? 1.0f : 0.0f, value.diffuse);
	const float brightest = pen_max(pen_brightest(sum), PEN_TINY);
	const int wanted = points->kind[i] == PEN_KIND_PRINCIPLED;
	const int goes_on = (1 - is_lost) & (pdf > 0.0f);

	choose(to, i, wanted, (struct pen_lobe){wi, pen_pick(goes_on, brightest / pdf, 0.0f), pdf});
	to->tint_red[i] = pen_pick(wanted, sum.x / brightest, to->tint_red[i]);
	to->tint_green[i] = pen_pick(wanted, sum.y / brightest, to->tint_green[i]);
	to->tint_blue[i] = pen_pick(wanted, sum.z / brightest, to->tint_blue[i]);
}

/* is_path is a constant where this is called. */
PEN_LANE void scatter_principled_all(bool is_path, const struct pen_rays *rays,
	const struct pen_points *points, const float *u, const float *v, const float *choice,
	struct outgoing *to)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		scatter_principled_one(is_path, rays, points, u, v, choice, i, to);
}

static void scatter_principled(const struct pen_rays *rays, const struct pen_points *points,
	enum pen_integrator_type type, const float *u, const float *v, const float *choice,
	struct outgoing *to)
{
	set_tint(to, points);
	if (type == PEN_INTEGRATOR_PATH)
		scatter_principled_all(true, rays, points, u, v, choice, to);
	else
		scatter_principled_all(false, rays, points, u, v, choice, to);
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
	to->red[i] = from->red[lane] * out->red[lane] * weight;
	to->green[i] = from->green[lane] * out->green[lane] * weight;
	to->blue[i] = from->blue[lane] * out->blue[lane] * weight;
	to->lobe_pdf[i] = out->pdf[lane];
	to->slot[i] = from->slot[lane];
	to->key[i] = from->key[lane];
	to->index[i] = from->index[lane];
	if (queue->has_cones)
		carry_cone(queue, from, out, lane, to, i);
	if (queue->has_receivers)
		carry_receiver(points, lane, to, i);
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
	out->red = points->red;
	out->green = points->green;
	out->blue = points->blue;
	pen_sampler_pairs(pass->sampler, pen_sample_group(pass->depth, PEN_SLOT_LOBE), PEN_LANES,
		paths->key, paths->index, u, v);
	if (points->kinds & (PEN_KIND_CLEAR | PEN_KIND_FROSTED | PEN_KIND_PRINCIPLED))
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
	if (points->kinds & PEN_KIND_PRINCIPLED)
		scatter_principled(
			rays, points, pass->scene->desc->integrator.type, u, v, choice, out);
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

static void append_branch(const struct pen_paths *paths, const struct pen_points *points, int lane,
	struct pen_vec3 direction, float share, struct outgoing *out, struct pen_path_queue *queue)
{
	if (!is_worth_following(paths, lane, share))
		return;
	choose(out, lane, 1, (struct pen_lobe){.direction = direction});
	append(queue, paths, points, out, lane, share);
}

/* The same in colour. */
static void append_tinted(const struct pen_paths *paths, const struct pen_points *points, int lane,
	struct pen_vec3 direction, struct pen_vec3 share, struct pen_path_queue *queue)
{
	const float brightest = pen_max(pen_brightest(share), PEN_TINY);
	struct outgoing out;

	out.red = out.tint_red;
	out.green = out.tint_green;
	out.blue = out.tint_blue;
	out.tint_red[lane] = share.x / brightest;
	out.tint_green[lane] = share.y / brightest;
	out.tint_blue[lane] = share.z / brightest;
	append_branch(paths, points, lane, direction, brightest, &out, queue);
}

/* principled as if it were smooth: what it reflects, and what it lets through. */
static void branch_principled(const struct pen_paths *paths, const struct pen_points *points,
	int lane, struct pen_path_queue *queue)
{
	const struct pen_principled p = pen_detail_principled(points, lane);
	const struct pen_vec3 n = normal_of(points, lane);
	const struct pen_vec3 wo = towards_origin(&paths->packet.rays, lane);
	const float c = pen_max(pen_dot(wo, n), 0.0f);
	const float fresnel = pen_principled_fresnel(&p, c);
	const float coat = pen_coat_share(&p, wo, pen_dot(p.coat_normal, wo));
	const float below = pen_below_coat(&p, coat);
	const float metal = below * p.metallic;
	const float dielectric = below * (1.0f - p.metallic);
	const float grazing = pen_grazing_weight(&p, c);
	const float white = coat + dielectric * fresnel + metal * grazing;
	const float through = dielectric * p.transmission * (1.0f - fresnel);

	append_tinted(paths, points, lane, pen_reflect(wo, n),
		pen_madd(pen_vec3(white, white, white), metal * (1.0f - grazing), p.color), queue);
	append_tinted(paths, points, lane, p.is_solid ? pen_refract(wo, n, p.eta) : pen_neg(wo),
		pen_scale(p.color, through), queue);
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

		if (paths->slot[i] >= slot_end)
			continue;
		out.red = points->red;
		out.green = points->green;
		out.blue = points->blue;
		if (points->kind[i] == PEN_KIND_PRINCIPLED)
			branch_principled(paths, points, i, queue);
		if (!is_clear && points->kind[i] != PEN_KIND_MIRROR)
			continue;
		append_branch(paths, points, i, pen_reflect(wo, n), share, &out, queue);
		if (is_clear)
			append_branch(paths, points, i, pen_refract(wo, n, points->eta[i]),
				1.0f - share, &out, queue);
	}
}

void pen_scatter(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, uint32_t slot_end, struct pen_path_queue *queue)
{
	const struct pen_integrator_desc *integrator = &pass->scene->desc->integrator;
	const bool is_path = integrator->type == PEN_INTEGRATOR_PATH;
	const uint32_t going_on = PEN_KIND_MIRROR | PEN_KIND_GLOSSY | PEN_KIND_CLEAR |
				  PEN_KIND_FROSTED | PEN_KIND_PRINCIPLED |
				  (is_path ? PEN_KIND_MATTE : 0u);

	if ((points->kinds & going_on) == 0)
		return;
	if (integrator->type != PEN_INTEGRATOR_WHITTED)
		scatter_one(pass, paths, points, slot_end, queue);
	else if (pass->depth < integrator->max_depth)
		scatter_both(paths, points, slot_end, queue);
}
