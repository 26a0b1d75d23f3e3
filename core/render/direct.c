/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/direct.h"

#include "core/render/bsdf.h"
#include "core/render/detail.h"
#include "core/render/lights.h"

#include <string.h>

/* Shadow rays end a little before the light, so as not to hit it. */
#define SHADOW_SHARE (1.0f - 1e-4f)

/* What reflects diffusely. */
enum { MATTES = PEN_KIND_MATTE | PEN_KIND_PRINCIPLED };

/* Sixteen directions, and what arrives from there if nothing is in between. */
struct incoming {
	_Alignas(64) float x[PEN_LANES];
	float y[PEN_LANES];
	float z[PEN_LANES];
	float distance[PEN_LANES];
	float strength[PEN_LANES]; /* radiance / color */
	float pdf[PEN_LANES];
	float red[PEN_LANES]; /* color */
	float green[PEN_LANES];
	float blue[PEN_LANES];
	float competes[PEN_LANES]; /* 1 where a lobe could hit the light too, else 0 */
	bool is_for_diffuse;	   /* other lobes look there by themselves */
};

/* What the surface makes of it. */
struct response {
	_Alignas(64) float value[PEN_LANES]; /* bsdf * |cos| */
	float pdf[PEN_LANES];		     /* with which a lobe goes there; 0: none does */
	const float *red, *green, *blue;     /* color of the value: the points' or the tint */
	float tint_red[PEN_LANES];
	float tint_green[PEN_LANES];
	float tint_blue[PEN_LANES];
};

static struct pen_vec3 normal_of(const struct pen_points *points, int lane)
{
	return pen_vec3(points->normal_x[lane], points->normal_y[lane], points->normal_z[lane]);
}

static struct pen_vec3 facing_of(const struct pen_points *points, int lane)
{
	return pen_vec3(points->facing_x[lane], points->facing_y[lane], points->facing_z[lane]);
}

static struct pen_vec3 towards_origin(const struct pen_rays *rays, int lane)
{
	return pen_vec3(
		-rays->direction_x[lane], -rays->direction_y[lane], -rays->direction_z[lane]);
}

static void respond_matte(const struct pen_points *points, const struct incoming *in,
	bool continues, struct response *ret)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_lobe_value lobe = pen_matte_eval(
			normal_of(points, i), pen_vec3(in->x[i], in->y[i], in->z[i]));
		const int is_matte = points->kind[i] == PEN_KIND_MATTE;

		ret->value[i] = is_matte ? lobe.value : 0.0f;
		ret->pdf[i] = is_matte && continues ? lobe.pdf : 0.0f;
	}
}

static void respond_glossy(const struct pen_rays *rays, const struct pen_points *points,
	const struct incoming *in, struct response *ret)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_lobe_value lobe =
			pen_glossy_eval(points->alpha[i], normal_of(points, i),
				towards_origin(rays, i), pen_vec3(in->x[i], in->y[i], in->z[i]));
		const int is_glossy = points->kind[i] == PEN_KIND_GLOSSY;

		ret->value[i] = is_glossy ? lobe.value : ret->value[i];
		ret->pdf[i] = is_glossy ? lobe.pdf : ret->pdf[i];
	}
}

static void respond_frosted(const struct pen_rays *rays, const struct pen_points *points,
	const struct incoming *in, struct response *ret)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_lobe_value lobe =
			pen_glass_eval(points->alpha[i], points->eta[i], normal_of(points, i),
				towards_origin(rays, i), pen_vec3(in->x[i], in->y[i], in->z[i]));
		const int is_frosted = points->kind[i] == PEN_KIND_FROSTED;

		ret->value[i] = is_frosted ? lobe.value : ret->value[i];
		ret->pdf[i] = is_frosted ? lobe.pdf : ret->pdf[i];
	}
}

static void set_tint(struct response *ret, const struct pen_points *points)
{
	memcpy(ret->tint_red, points->red, sizeof ret->tint_red);
	memcpy(ret->tint_green, points->green, sizeof ret->tint_green);
	memcpy(ret->tint_blue, points->blue, sizeof ret->tint_blue);
	ret->red = ret->tint_red;
	ret->green = ret->tint_green;
	ret->blue = ret->tint_blue;
}

/*
 * What principled makes of it, in colour. distribution follows no diffuse lobe: what the others
 * give is weighed against them here, and the diffuse part is not weighed at all.
 */
PEN_LANE void respond_principled_one(enum pen_integrator_type type, const struct pen_rays *rays,
	const struct pen_points *points, const struct incoming *in, int i, struct response *ret)
{
	const bool is_path = type == PEN_INTEGRATOR_PATH;
	const float others = in->is_for_diffuse || type == PEN_INTEGRATOR_WHITTED ? 0.0f : 1.0f;
	const struct pen_principled p = pen_detail_principled(points, i);
	const struct pen_vec3 n = normal_of(points, i), wo = towards_origin(rays, i);
	const struct pen_principled_chances chances =
		pen_principled_chances(&p, n, wo, pen_diffuse_chance_max(type));
	const struct pen_principled_value value =
		pen_principled_eval(&p, n, wo, pen_vec3(in->x[i], in->y[i], in->z[i]));
	const float pdf = pen_principled_pdf(&value, &chances, is_path);
	const float share = pen_power_heuristic(in->pdf[i], pdf * in->competes[i]);
	const struct pen_vec3 sum =
		pen_madd(value.diffuse, is_path ? others : others * share, value.others);
	const float brightest = pen_max(pen_brightest(sum), PEN_TINY);
	const int wanted = points->kind[i] == PEN_KIND_PRINCIPLED;

	ret->value[i] = pen_pick(wanted, brightest, ret->value[i]);
	ret->pdf[i] = pen_pick(wanted, is_path ? pdf * others : 0.0f, ret->pdf[i]);
	ret->tint_red[i] = pen_pick(wanted, sum.x / brightest, ret->tint_red[i]);
	ret->tint_green[i] = pen_pick(wanted, sum.y / brightest, ret->tint_green[i]);
	ret->tint_blue[i] = pen_pick(wanted, sum.z / brightest, ret->tint_blue[i]);
}

/* type is a constant where this is called, so that the loops vectorise. */
PEN_LANE void respond_principled_as(enum pen_integrator_type type, const struct pen_rays *rays,
	const struct pen_points *points, const struct incoming *in, struct response *ret)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++)
		respond_principled_one(type, rays, points, in, i, ret);
}

static void respond_principled(const struct pen_pass *pass, const struct pen_rays *rays,
	const struct pen_points *points, const struct incoming *in, struct response *ret)
{
	set_tint(ret, points);
	switch (pass->scene->desc->integrator.type) {
	case PEN_INTEGRATOR_PATH:
		respond_principled_as(PEN_INTEGRATOR_PATH, rays, points, in, ret);
		break;
	case PEN_INTEGRATOR_DISTRIBUTION:
		respond_principled_as(PEN_INTEGRATOR_DISTRIBUTION, rays, points, in, ret);
		break;
	case PEN_INTEGRATOR_WHITTED:
		respond_principled_as(PEN_INTEGRATOR_WHITTED, rays, points, in, ret);
		break;
	}
}

static void respond(const struct pen_pass *pass, const struct pen_rays *rays,
	const struct pen_points *points, const struct incoming *in, struct response *ret)
{
	const bool is_path = pass->scene->desc->integrator.type == PEN_INTEGRATOR_PATH;

	ret->red = points->red;
	ret->green = points->green;
	ret->blue = points->blue;
	respond_matte(points, in, is_path, ret);
	if (points->kinds & PEN_KIND_GLOSSY)
		respond_glossy(rays, points, in, ret);
	if (points->kinds & PEN_KIND_FROSTED)
		respond_frosted(rays, points, in, ret);
	if (points->kinds & PEN_KIND_PRINCIPLED)
		respond_principled(pass, rays, points, in, ret);
}

/*
 * Shadow rays where anything may arrive, and into factor how much of the light's color then does.
 * A direction that the two normals see on different sides is lost. From where the ray starts, a
 * little off the surface, it is aimed again at the light's point: a parallel ray could enter a
 * visible sphere well before that point near its rim, and light must not shadow itself.
 */
static bool aim(const struct pen_rays *from, const struct pen_points *points,
	const struct incoming *in, const struct response *response, float factor[PEN_LANES],
	struct pen_rays *ret_rays)
{
	int32_t any = 0;

#pragma omp simd reduction(| : any)
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_vec3 d = {in->x[i], in->y[i], in->z[i]};
		const struct pen_vec3 o = pen_points_leave(points, i, d);
		const int agrees =
			pen_dot(d, normal_of(points, i)) * pen_dot(d, facing_of(points, i)) > 0.0f;
		const float rival = response->pdf[i] * in->competes[i];
		const float f = response->value[i] * in->strength[i] / in->pdf[i] *
				pen_power_heuristic(in->pdf[i], rival);
		const int wanted = agrees & (f > 0.0f);
		const float per_distance = wanted ? 1.0f / in->distance[i] : 0.0f;

		factor[i] = wanted ? f : 0.0f;
		ret_rays->origin_x[i] = o.x;
		ret_rays->origin_y[i] = o.y;
		ret_rays->origin_z[i] = o.z;
		ret_rays->direction_x[i] = d.x + (points->x[i] - o.x) * per_distance;
		ret_rays->direction_y[i] = d.y + (points->y[i] - o.y) * per_distance;
		ret_rays->direction_z[i] = d.z + (points->z[i] - o.z) * per_distance;
		ret_rays->time[i] = from->time[i];
		ret_rays->tnear[i] = wanted ? 0.0f : 1.0f;
		ret_rays->tfar[i] = wanted ? in->distance[i] * SHADOW_SHARE : 0.0f;
		any |= wanted;
	}
	return any != 0;
}

static void gather(const struct pen_paths *paths, const struct response *response,
	const struct incoming *in, const float factor[PEN_LANES], const struct pen_rays *shadow,
	struct pen_gathered *sum)
{
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const float f = shadow->tfar[i] >= 0.0f ? factor[i] : 0.0f;

		sum->red[i] += paths->red[i] * response->red[i] * in->red[i] * f;
		sum->green[i] += paths->green[i] * response->green[i] * in->green[i] * f;
		sum->blue[i] += paths->blue[i] * response->blue[i] * in->blue[i] * f;
	}
}

static uint32_t lanes_traced(const struct pen_rays *rays)
{
	uint32_t count = 0;

	for (int i = 0; i < PEN_LANES; i++)
		count += rays->tnear[i] <= rays->tfar[i];
	return count;
}

static void test_and_gather(struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, const struct incoming *in, struct pen_gathered *sum)
{
	const struct pen_sieve sieve = {pass, paths->key, paths->index, true};
	struct response response;
	struct pen_rays shadow;
	_Alignas(64) float factor[PEN_LANES];

	respond(pass, &paths->packet.rays, points, in, &response);
	if (!aim(&paths->packet.rays, points, in, &response, factor, &shadow))
		return;
	pass->rays += lanes_traced(&shadow);
	pass->rays_dropped +=
		pen_trace_occluded(pass->scene->trace, pass->is_coherent, &sieve, &shadow);
	gather(paths, &response, in, factor, &shadow, sum);
}

static bool lobes_hit(const struct pen_render_scene *scene, uint32_t light)
{
	return light >= scene->lights->own_count || scene->desc->lights[light].visible;
}

static void sample_light(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, uint32_t light, struct incoming *ret)
{
	const struct pen_render_scene *scene = pass->scene;
	const struct pen_vec3 color = scene->lights->items[light].color;
	const float competes = lobes_hit(scene, light) ? 1.0f : 0.0f;
	const struct pen_light_points at = {points->x, points->y, points->z};
	const struct pen_light_samples to = {
		ret->x, ret->y, ret->z, ret->distance, ret->strength, ret->pdf};
	_Alignas(64) float u[PEN_LANES];
	_Alignas(64) float v[PEN_LANES];

	pen_sampler_pairs(pass->sampler, pen_sample_group(pass->depth, PEN_SLOT_LIGHT + light),
		PEN_LANES, paths->key, paths->index, u, v);
	pen_light_sample(&scene->lights->items[light], PEN_LANES, &at, u, v, &to);
	for (int i = 0; i < PEN_LANES; i++) {
		ret->red[i] = color.x;
		ret->green[i] = color.y;
		ret->blue[i] = color.z;
		ret->competes[i] = competes;
	}
}

static void set_incoming(
	struct incoming *to, int lane, const struct pen_light_sample *sample, struct pen_vec3 color)
{
	to->x[lane] = sample->direction.x;
	to->y[lane] = sample->direction.y;
	to->z[lane] = sample->direction.z;
	to->distance[lane] = sample->distance;
	to->strength[lane] = sample->strength;
	to->pdf[lane] = sample->pdf;
	to->red[lane] = color.x;
	to->green[lane] = color.y;
	to->blue[lane] = color.z;
}

static struct pen_vec3 point_of(const struct pen_points *points, int lane)
{
	return pen_vec3(points->x[lane], points->y[lane], points->z[lane]);
}

/* What pen_light_sample_triangles reads, and where in each triangle its point is. */
struct chosen_triangles {
	_Alignas(64) float corner_x[PEN_LANES];
	float corner_y[PEN_LANES];
	float corner_z[PEN_LANES];
	float edge_ux[PEN_LANES];
	float edge_uy[PEN_LANES];
	float edge_uz[PEN_LANES];
	float edge_vx[PEN_LANES];
	float edge_vy[PEN_LANES];
	float edge_vz[PEN_LANES];
	uint32_t is_turned[PEN_LANES]; /* edge_u is the triangle's second edge */
};

/* One that shines from both sides shows the point the one that it sees. */
static void set_chosen_triangle(struct chosen_triangles *to, int lane,
	const struct pen_light *light, bool two_sided, struct pen_vec3 p)
{
	const bool turn = two_sided && pen_dot(pen_sub(light->origin, p), light->axis) > 0.0f;
	const struct pen_vec3 u = turn ? light->edge_v : light->edge_u;
	const struct pen_vec3 v = turn ? light->edge_u : light->edge_v;

	to->corner_x[lane] = light->origin.x;
	to->corner_y[lane] = light->origin.y;
	to->corner_z[lane] = light->origin.z;
	to->edge_ux[lane] = u.x;
	to->edge_uy[lane] = u.y;
	to->edge_uz[lane] = u.z;
	to->edge_vx[lane] = v.x;
	to->edge_vy[lane] = v.y;
	to->edge_vz[lane] = v.z;
	to->is_turned[lane] = turn;
}

/* Barycentric coordinates of the point that a lane's direction leads to. */
static struct pen_vec2 place_in_triangle(const struct chosen_triangles *triangles,
	const struct incoming *in, const struct pen_points *points, int lane)
{
	const struct pen_vec3 u = {
		triangles->edge_ux[lane], triangles->edge_uy[lane], triangles->edge_uz[lane]};
	const struct pen_vec3 v = {
		triangles->edge_vx[lane], triangles->edge_vy[lane], triangles->edge_vz[lane]};
	const struct pen_vec3 d = {in->x[lane], in->y[lane], in->z[lane]};
	const struct pen_vec3 from = {points->x[lane] - triangles->corner_x[lane],
		points->y[lane] - triangles->corner_y[lane],
		points->z[lane] - triangles->corner_z[lane]};
	const struct pen_vec3 at = pen_madd(from, in->distance[lane], d);
	const struct pen_vec3 n = pen_cross(u, v);
	const float inverse = 1.0f / pen_max(pen_dot(n, n), PEN_TINY);
	const float a = pen_clamp(pen_dot(pen_cross(at, v), n) * inverse, 0.0f, 1.0f);
	const float b = pen_clamp(pen_dot(pen_cross(u, at), n) * inverse, 0.0f, 1.0f - a);

	return triangles->is_turned[lane] ? (struct pen_vec2){b, a} : (struct pen_vec2){a, b};
}

static bool is_two_sided(const struct pen_render_scene *scene, const struct pen_emitter *emitter)
{
	return !scene->materials[scene->geometry.shapes[emitter->shape].surface].is_one_sided;
}

/* What an emitter sends along a lane's direction. */
static void set_emission(const struct pen_render_scene *scene, const struct pen_emitter *emitter,
	const struct pen_light *light, struct pen_vec2 at, struct incoming *in, int lane,
	struct pen_vec3 p)
{
	const struct pen_vec3 d = {in->x[lane], in->y[lane], in->z[lane]};
	const bool is_sphere = light->type == PEN_LIGHT_SPHERE;
	const struct pen_vec3 n =
		is_sphere
			? pen_normalize(pen_sub(pen_madd(p, in->distance[lane], d), light->origin))
			: light->axis;
	const struct pen_vec3 color = pen_detail_emission(
		scene, emitter->shape, emitter->primitive, at.x, at.y, n, pen_dot(n, d));

	in->red[lane] = color.x;
	in->green[lane] = color.y;
	in->blue[lane] = color.z;
	in->competes[lane] = 1.0f;
}

/* What was chosen for sixteen points. */
struct chosen {
	_Alignas(64) uint32_t light[PEN_LANES];
	float chance[PEN_LANES];
	float u[PEN_LANES];
	float v[PEN_LANES];
	const struct pen_emitter *emitter[PEN_LANES]; /* NULL: another light, or none */
	struct pen_light placed[PEN_LANES];	      /* of emitters */
};

static void choose_lights(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct chosen *ret)
{
	const struct pen_lights *lights = pass->scene->lights;
	_Alignas(64) float normal_x[PEN_LANES];
	_Alignas(64) float normal_y[PEN_LANES];
	_Alignas(64) float normal_z[PEN_LANES];
	_Alignas(64) uint32_t wanted[PEN_LANES];
	const struct pen_light_receivers receivers = {
		points->x, points->y, points->z, normal_x, normal_y, normal_z, wanted};

	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_vec3 n = pen_points_receiver(points, i);

		wanted[i] = (points->kind[i] & (MATTES | PEN_KIND_GLOSSY | PEN_KIND_FROSTED)) != 0;
		normal_x[i] = n.x;
		normal_y[i] = n.y;
		normal_z[i] = n.z;
	}
	pen_sampler_pairs(pass->sampler, pen_sample_group(pass->depth, PEN_SLOT_LIGHT_CHOICE),
		PEN_LANES, paths->key, paths->index, ret->u, ret->v);
	pen_lights_choose(lights, &receivers, ret->u, ret->v, ret->light, ret->chance);
	pen_sampler_pairs(pass->sampler, pen_sample_group(pass->depth, PEN_SLOT_CHOSEN_LIGHT),
		PEN_LANES, paths->key, paths->index, ret->u, ret->v);
	for (int i = 0; i < PEN_LANES; i++) {
		const bool is_none = ret->light[i] < lights->count || ret->chance[i] == 0.0f;

		ret->emitter[i] =
			is_none ? NULL : &lights->emitters.items[ret->light[i] - lights->count];
		if (!is_none)
			pen_emitter_place(pass->scene, ret->emitter[i], paths->packet.rays.time[i],
				&ret->placed[i]);
	}
}

/* Triangles in the lanes that chose one; some triangle in the others. */
static void sample_chosen_triangles(const struct pen_render_scene *scene,
	const struct pen_points *points, const struct chosen *chosen,
	struct chosen_triangles *triangles, struct incoming *ret)
{
	const struct pen_light_triangles from = {triangles->corner_x, triangles->corner_y,
		triangles->corner_z, triangles->edge_ux, triangles->edge_uy, triangles->edge_uz,
		triangles->edge_vx, triangles->edge_vy, triangles->edge_vz};
	const struct pen_light_points at = {points->x, points->y, points->z};
	const struct pen_light_samples to = {
		ret->x, ret->y, ret->z, ret->distance, ret->strength, ret->pdf};
	struct pen_light some;

	pen_light_set_triangle(&some, pen_vec3(0.0f, 0.0f, 0.0f), pen_vec3(1.0f, 0.0f, 0.0f),
		pen_vec3(0.0f, 1.0f, 0.0f));
	for (int i = 0; i < PEN_LANES; i++) {
		const bool is_triangle =
			chosen->emitter[i] && chosen->placed[i].type == PEN_LIGHT_TRIANGLE;

		set_chosen_triangle(triangles, i, is_triangle ? &chosen->placed[i] : &some,
			is_triangle && is_two_sided(scene, chosen->emitter[i]),
			point_of(points, i));
	}
	pen_light_sample_triangles(PEN_LANES, &from, &at, chosen->u, chosen->v, &to);
}

/* One of many lights for each lane. */
static void sample_chosen_lights(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct incoming *ret)
{
	const struct pen_render_scene *scene = pass->scene;
	const struct pen_vec3 black = {0.0f, 0.0f, 0.0f};
	struct chosen_triangles triangles;
	struct chosen chosen;

	choose_lights(pass, paths, points, &chosen);
	sample_chosen_triangles(scene, points, &chosen, &triangles, ret);
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_emitter *emitter = chosen.emitter[i];
		const bool is_own = !emitter && chosen.chance[i] > 0.0f;
		const struct pen_light *light =
			is_own ? &scene->lights->items[chosen.light[i]] : &chosen.placed[i];
		struct pen_light_sample sample;
		struct pen_vec2 at = {0.0f, 0.0f};

		if (is_own || (emitter && light->type == PEN_LIGHT_SPHERE)) {
			sample = pen_light_sample_one(
				light, point_of(points, i), chosen.u[i], chosen.v[i]);
			set_incoming(ret, i, &sample, is_own ? light->color : black);
		}
		if (is_own)
			ret->competes[i] = lobes_hit(scene, chosen.light[i]) ? 1.0f : 0.0f;
		if (emitter && light->type == PEN_LIGHT_TRIANGLE)
			at = place_in_triangle(&triangles, ret, points, i);
		if (emitter)
			set_emission(scene, emitter, light, at, ret, i, point_of(points, i));
		ret->strength[i] = chosen.chance[i] > 0.0f ? ret->strength[i] : 0.0f;
		ret->pdf[i] *= chosen.chance[i] > 0.0f ? chosen.chance[i] : 1.0f;
		if (!is_own && !emitter)
			ret->red[i] = ret->green[i] = ret->blue[i] = ret->competes[i] = 0.0f;
	}
}

static void aim_at_centre(const struct pen_render_scene *scene, const struct pen_points *points,
	uint32_t light, struct incoming *ret)
{
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_light_sample sample =
			pen_light_centre(&scene->lights->items[light], point_of(points, i));

		set_incoming(ret, i, &sample, scene->lights->items[light].color);
		ret->competes[i] = 0.0f;
	}
}

/* The background over a matte surface, by its cosine: bsdf * cos / pdf is 1. */
static void add_background(struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct pen_gathered *sum)
{
	const struct pen_vec3 color = pass->scene->background;
	struct incoming in;
	_Alignas(64) float u[PEN_LANES];
	_Alignas(64) float v[PEN_LANES];

	in.is_for_diffuse = true;
	pen_sampler_pairs(pass->sampler, pen_sample_group(pass->depth, PEN_SLOT_BACKGROUND),
		PEN_LANES, paths->key, paths->index, u, v);
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_lobe lobe = pen_matte_sample(normal_of(points, i), u[i], v[i]);

		in.x[i] = lobe.direction.x;
		in.y[i] = lobe.direction.y;
		in.z[i] = lobe.direction.z;
		in.distance[i] = INFINITY;
		in.strength[i] = (points->kind[i] & MATTES) != 0 ? 1.0f : 0.0f;
		in.pdf[i] = pen_max(lobe.pdf, 1e-30f);
		in.competes[i] = 0.0f;
		in.red[i] = color.x;
		in.green[i] = color.y;
		in.blue[i] = color.z;
	}
	test_and_gather(pass, paths, points, &in, sum);
}

/* The environment by its picture, for all that lobes could find it with too. */
static void add_environment(struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct pen_gathered *sum)
{
	const struct pen_environment *environment = pass->scene->environment;
	struct incoming in;
	_Alignas(64) float u[PEN_LANES];
	_Alignas(64) float v[PEN_LANES];

	in.is_for_diffuse = false;
	pen_sampler_pairs(pass->sampler, pen_sample_group(pass->depth, PEN_SLOT_BACKGROUND),
		PEN_LANES, paths->key, paths->index, u, v);
	for (int i = 0; i < PEN_LANES; i++) {
		const struct pen_environment_sample from =
			pen_environment_sample(environment, u[i], v[i]);
		const struct pen_light_sample sample = {
			.direction = from.direction,
			.distance = INFINITY,
			.strength = from.pdf > 0.0f ? 1.0f : 0.0f,
			.pdf = from.pdf > 0.0f ? from.pdf : 1.0f,
		};

		set_incoming(&in, i, &sample,
			pen_environment_radiance(environment, from.direction, 0.0f));
		in.competes[i] = 1.0f;
	}
	test_and_gather(pass, paths, points, &in, sum);
}

void pen_direct_add(struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct pen_gathered *sum)
{
	const struct pen_render_scene *scene = pass->scene;
	const enum pen_integrator_type type = scene->desc->integrator.type;
	const struct pen_vec3 background = scene->background;
	const bool is_black = background.x == 0 && background.y == 0 && background.z == 0;
	struct incoming in;

	if ((points->kinds & (MATTES | PEN_KIND_GLOSSY | PEN_KIND_FROSTED)) == 0)
		return;
	in.is_for_diffuse = false;
	if (type == PEN_INTEGRATOR_WHITTED) {
		for (uint32_t light = 0; light < scene->lights->count; light++) {
			aim_at_centre(scene, points, light, &in);
			test_and_gather(pass, paths, points, &in, sum);
		}
		return;
	}
	if (scene->lights->chooses) {
		sample_chosen_lights(pass, paths, points, &in);
		test_and_gather(pass, paths, points, &in, sum);
	}
	for (uint32_t light = 0; light < scene->lights->sampled_count; light++) {
		sample_light(pass, paths, points, light, &in);
		test_and_gather(pass, paths, points, &in, sum);
	}
	if (scene->environment)
		add_environment(pass, paths, points, sum);
	else if (type == PEN_INTEGRATOR_DISTRIBUTION && !is_black && (points->kinds & MATTES))
		add_background(pass, paths, points, sum);
}

static struct pen_vec3 direction_of(const struct pen_rays *rays, int lane)
{
	return pen_vec3(rays->direction_x[lane], rays->direction_y[lane], rays->direction_z[lane]);
}

/* What a ray that hits nothing sees, weighted like lights where a lobe led it there. */
static struct pen_vec3 seen_environment(
	const struct pen_environment *environment, const struct pen_paths *paths, int lane)
{
	const struct pen_vec3 d = pen_normalize(direction_of(&paths->packet.rays, lane));
	const float pdf = paths->lobe_pdf[lane];

	if (pdf == 0.0f)
		return pen_environment_radiance(environment, d, paths->spread[lane]);
	return pen_scale(pen_environment_radiance(environment, d, 0.0f),
		pen_power_heuristic(pdf, pen_environment_pdf(environment, d)));
}

/* Weighs a light that a lobe found against finding it by its number. */
static float seen_weight(const struct pen_render_scene *scene, const struct pen_paths *paths,
	const struct pen_light *light, uint32_t number, int lane)
{
	const struct pen_rays *rays = &paths->packet.rays;
	const struct pen_vec3 origin = {
		rays->origin_x[lane], rays->origin_y[lane], rays->origin_z[lane]};
	const struct pen_vec3 direction = direction_of(rays, lane);
	const struct pen_vec3 normal = {
		paths->receiver_x[lane], paths->receiver_y[lane], paths->receiver_z[lane]};
	float rival = pen_light_pdf(light, origin, direction, rays->tfar[lane]);

	if (scene->lights->chooses)
		rival *= pen_lights_chance(scene->lights, origin, normal, number);
	return pen_power_heuristic(paths->lobe_pdf[lane], rival);
}

/* The same of what a surface sends out itself. */
static float glow_weight(
	const struct pen_render_scene *scene, const struct pen_paths *paths, int lane)
{
	const struct pen_lights *lights = scene->lights;
	const struct pen_hits *hits = &paths->packet.hits;
	const uint32_t placed = hits->instance[lane];
	const uint32_t shape = placed != PEN_NO_INDEX ? placed : hits->geometry[lane];
	const uint32_t number = pen_emitters_find(&lights->emitters, shape, hits->primitive[lane]);
	struct pen_light light;

	if (paths->lobe_pdf[lane] == 0.0f || number == PEN_NO_INDEX)
		return 1.0f;
	if (number < lights->count)
		return seen_weight(scene, paths, &lights->items[number], number, lane);
	pen_emitter_place(scene, &lights->emitters.items[number - lights->count],
		paths->packet.rays.time[lane], &light);
	return seen_weight(scene, paths, &light, number, lane);
}

/*
 * What surfaces send out themselves, dimmed by their coat. Unlit ones show their color where the
 * ray could have come only from them, and light nothing.
 */
static void add_glow(const struct pen_render_scene *scene, const struct pen_paths *paths,
	const struct pen_points *points, struct pen_gathered *sum)
{
	const struct pen_rays *rays = &paths->packet.rays;

	for (int i = 0; i < PEN_LANES; i++) {
		const bool is_unlit = points->kind[i] == PEN_KIND_UNLIT;
		const bool is_black = points->glow_red[i] == 0.0f &&
				      points->glow_green[i] == 0.0f && points->glow_blue[i] == 0.0f;
		float weight = paths->lobe_pdf[i] == 0.0f ? 1.0f : 0.0f;

		if (is_black)
			continue;
		if (!is_unlit)
			weight = glow_weight(scene, paths, i) *
				 (1.0f - pen_coat_fresnel(
						 points->additive[i] ? 0.0f : points->coat[i],
						 pen_dot(facing_of(points, i),
							 towards_origin(rays, i))));
		sum->red[i] += paths->red[i] * points->glow_red[i] * weight;
		sum->green[i] += paths->green[i] * points->glow_green[i] * weight;
		sum->blue[i] += paths->blue[i] * points->glow_blue[i] * weight;
	}
}

void pen_direct_seen(const struct pen_pass *pass, const struct pen_paths *paths,
	const struct pen_points *points, struct pen_gathered *sum)
{
	const struct pen_render_scene *scene = pass->scene;
	const struct pen_rays *rays = &paths->packet.rays;

	if (points->kinds & PEN_KIND_GLOWING)
		add_glow(scene, paths, points, sum);
	for (int i = 0; i < PEN_LANES; i++) {
		const bool is_light = points->kind[i] == PEN_KIND_LIGHT && !points->backside[i];
		const bool is_miss =
			points->kind[i] == PEN_KIND_NOTHING && rays->tnear[i] <= rays->tfar[i];
		struct pen_vec3 color =
			is_light ? scene->lights->items[points->light[i]].color : scene->background;
		float weight = is_miss ? 1.0f : 0.0f;

		if (is_miss && scene->environment)
			color = seen_environment(scene->environment, paths, i);
		if (is_light && paths->lobe_pdf[i] == 0.0f)
			weight = 1.0f;
		else if (is_light)
			weight = seen_weight(scene, paths, &scene->lights->items[points->light[i]],
				points->light[i], i);
		sum->red[i] += paths->red[i] * color.x * weight;
		sum->green[i] += paths->green[i] * color.y * weight;
		sum->blue[i] += paths->blue[i] * color.z * weight;
	}
}
