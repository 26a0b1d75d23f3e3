/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/detail.h"

#include "core/render/vertex.h"

#include <math.h>

/* A hit, for whoever asks what lies there. */
struct site {
	const struct pen_geometry *geometry;
	const struct pen_shape *shape;
	const struct pen_model *model;
	const float (*world)[4]; /* NULL: own coordinates are the world's */
	uint32_t primitive;
	float u, v, time;
	struct pen_vec3 out; /* of spheres: unit, from the centre in own coordinates */
	float radius;	     /* likewise */
};

/* Texture coordinates of both sets, and how they change along the footprint's axes. */
struct coordinates {
	struct pen_vec2 uv[2], major[2], minor[2];
};

static const uint32_t *corners_of(const struct site *site)
{
	return site->geometry->indices + 3 * (size_t)(site->model->first + site->primitive);
}

static float blend(const struct site *site, float a, float b, float c)
{
	return a * (1.0f - site->u - site->v) + b * site->u + c * site->v;
}

/* The values of an attribute at the corners: width floats each. */
static void load_corners(const struct site *site, const float *pool, uint32_t offset,
	uint32_t width, const float *ret_corners[3])
{
	const uint32_t *index = corners_of(site);

	for (int k = 0; k < 3; k++)
		ret_corners[k] = pool + (size_t)width * (uint32_t)(index[k] + offset);
}

/* Barycentric u and v along a direction within the triangle. */
struct gradient {
	struct pen_vec3 u, v; /* dot products with a direction give the change */
};

static struct gradient triangle_gradient(const struct site *site)
{
	const uint32_t *index = corners_of(site);
	const struct pen_vec3 a =
		pen_vertex_at(site->geometry->vertices, site->model, index[0], site->time);
	const struct pen_vec3 e1 = pen_sub(
		pen_vertex_at(site->geometry->vertices, site->model, index[1], site->time), a);
	const struct pen_vec3 e2 = pen_sub(
		pen_vertex_at(site->geometry->vertices, site->model, index[2], site->time), a);
	const struct pen_vec3 n = pen_cross(e1, e2);
	const float inverse = 1.0f / pen_max(pen_dot(n, n), PEN_TINY);

	return (struct gradient){
		.u = pen_scale(pen_cross(e2, n), inverse),
		.v = pen_scale(pen_cross(n, e1), inverse),
	};
}

static struct pen_vec2 change_along(
	const float *const uv[3], const struct gradient *gradient, struct pen_vec3 axis)
{
	const float b = pen_dot(gradient->u, axis), c = pen_dot(gradient->v, axis);

	return (struct pen_vec2){
		b * (uv[1][0] - uv[0][0]) + c * (uv[2][0] - uv[0][0]),
		b * (uv[1][1] - uv[0][1]) + c * (uv[2][1] - uv[0][1]),
	};
}

static void find_triangle_coordinates(const struct site *site, struct pen_vec3 major,
	struct pen_vec3 minor, struct coordinates *ret)
{
	const struct gradient gradient = triangle_gradient(site);

	for (int set = 0; set < 2; set++) {
		const float *uv[3];

		if (site->model->uv_offsets[set] == PEN_NO_INDEX)
			continue;
		load_corners(site, site->geometry->uvs, site->model->uv_offsets[set], 2, uv);
		ret->uv[set] = (struct pen_vec2){blend(site, uv[0][0], uv[1][0], uv[2][0]),
			blend(site, uv[0][1], uv[1][1], uv[2][1])};
		ret->major[set] = change_along(uv, &gradient, major);
		ret->minor[set] = change_along(uv, &gradient, minor);
	}
}

/* Eastward at a point of a sphere, unit; at a pole some direction. */
static struct pen_vec3 east_of(struct pen_vec3 out, float r)
{
	return r > 1e-6f ? pen_vec3(out.z / r, 0.0f, -out.x / r) : pen_vec3(1.0f, 0.0f, 0.0f);
}

/*
 * Latitude and longitude: u runs east about +Y, with 1/2 at +Z, v from the pole at +Y down, so that
 * the picture is seen upright from outside.
 */
static struct pen_vec2 sphere_uv(struct pen_vec3 out)
{
	const float r = sqrtf(out.x * out.x + out.z * out.z);
	const float angle = pen_angle(fabsf(out.x), out.z);

	return (struct pen_vec2){
		0.5f + copysignf(angle, out.x) * (0.5f * PEN_INV_PI),
		pen_angle(r, out.y) * PEN_INV_PI,
	};
}

static void find_sphere_coordinates(const struct site *site, struct pen_vec3 major,
	struct pen_vec3 minor, struct coordinates *ret)
{
	const struct pen_vec3 n = site->out;
	const float r = pen_max(sqrtf(n.x * n.x + n.z * n.z), 1e-3f);
	const struct pen_vec3 east =
		pen_scale(east_of(n, r), 0.5f * PEN_INV_PI / (r * site->radius));
	const struct pen_vec3 south =
		pen_scale(pen_vec3(n.x / r * n.y, -r, n.z / r * n.y), PEN_INV_PI / site->radius);
	const struct pen_vec2 uv = sphere_uv(n);

	for (int set = 0; set < 2; set++) {
		ret->uv[set] = uv;
		ret->major[set] = (struct pen_vec2){pen_dot(east, major), pen_dot(south, major)};
		ret->minor[set] = (struct pen_vec2){pen_dot(east, minor), pen_dot(south, minor)};
	}
}

/* The axes of what a cone sees of a surface, in world coordinates. */
static void find_axes(const struct pen_paths *paths, const struct pen_points *points, int lane,
	struct pen_vec3 *ret_major, struct pen_vec3 *ret_minor)
{
	const struct pen_rays *rays = &paths->packet.rays;
	const struct pen_vec3 d = {
		rays->direction_x[lane], rays->direction_y[lane], rays->direction_z[lane]};
	const struct pen_vec3 n = {
		points->facing_x[lane], points->facing_y[lane], points->facing_z[lane]};
	const float width = paths->width[lane] + paths->spread[lane] * rays->tfar[lane];
	const float cosine = pen_max(fabsf(pen_dot(d, n)), 0.02f);
	const struct pen_vec3 across = pen_cross(n, d);
	const float sine = pen_length(across);
	const struct pen_vec3 minor =
		sine > 1e-4f ? pen_scale(across, 1.0f / sine) : pen_basis(n).t;

	*ret_minor = pen_scale(minor, width);
	*ret_major = pen_scale(pen_cross(minor, n), width / cosine);
}

static void find_coordinates(const struct site *site, struct pen_vec3 major, struct pen_vec3 minor,
	struct coordinates *ret)
{
	*ret = (struct coordinates){.uv = {{0.0f, 0.0f}}};
	if (site->world) {
		major = pen_linear_inverse(site->world, major);
		minor = pen_linear_inverse(site->world, minor);
	}
	if (site->model->type == PEN_MODEL_TRIANGLES)
		find_triangle_coordinates(site, major, minor, ret);
	else
		find_sphere_coordinates(site, major, minor, ret);
}

static struct pen_vec2 transform(const struct pen_texture *texture, struct pen_vec2 a, float one)
{
	const float(*m)[3] = texture->uv;

	return (struct pen_vec2){
		m[0][0] * a.x + m[0][1] * a.y + m[0][2] * one,
		m[1][0] * a.x + m[1][1] * a.y + m[1][2] * one,
	};
}

/* All ones where there is no texture. */
static struct pen_texel read_input(const struct pen_texture *texture, const struct coordinates *at)
{
	const uint32_t set = texture->uv_set & 1;
	struct pen_footprint footprint;

	if (!texture->mipmap)
		return (struct pen_texel){1.0f, 1.0f, 1.0f, 1.0f};
	footprint = (struct pen_footprint){
		.center = transform(texture, at->uv[set], 1.0f),
		.major = transform(texture, at->major[set], 0.0f),
		.minor = transform(texture, at->minor[set], 0.0f),
	};
	return pen_texture_mean(texture, &footprint);
}

static float read_number(const struct pen_texture *texture, const struct coordinates *at)
{
	return texture->mipmap ? pen_texel_channel(read_input(texture, at), texture->channel)
			       : 1.0f;
}

static struct pen_texel vertex_color(const struct site *site)
{
	const float *c[3];

	if (site->model->type != PEN_MODEL_TRIANGLES || site->model->color_offset == PEN_NO_INDEX)
		return (struct pen_texel){1.0f, 1.0f, 1.0f, 1.0f};
	load_corners(site, site->geometry->colors, site->model->color_offset, 4, c);
	return (struct pen_texel){
		blend(site, c[0][0], c[1][0], c[2][0]),
		blend(site, c[0][1], c[1][1], c[2][1]),
		blend(site, c[0][2], c[1][2], c[2][2]),
		blend(site, c[0][3], c[1][3], c[2][3]),
	};
}

/* World direction in which u grows, and the sign of normal x tangent; false without one. */
static bool find_tangent(const struct site *site, struct pen_vec3 *ret_tangent, float *ret_sign)
{
	const float *t[3];
	float sign = 1.0f;
	struct pen_vec3 own;

	if (site->model->type != PEN_MODEL_TRIANGLES) {
		const struct pen_vec3 n = site->out;

		own = east_of(n, sqrtf(n.x * n.x + n.z * n.z));
	} else if (site->model->tangent_offset != PEN_NO_INDEX) {
		load_corners(site, site->geometry->tangents, site->model->tangent_offset, 4, t);
		own = pen_vec3(blend(site, t[0][0], t[1][0], t[2][0]),
			blend(site, t[0][1], t[1][1], t[2][1]),
			blend(site, t[0][2], t[1][2], t[2][2]));
		sign = blend(site, t[0][3], t[1][3], t[2][3]) < 0.0f ? -1.0f : 1.0f;
	} else {
		return false;
	}
	if (site->world) {
		const float(*m)[4] = site->world;
		const struct pen_vec3 a = {m[0][0], m[1][0], m[2][0]};
		const struct pen_vec3 b = {m[0][1], m[1][1], m[2][1]};
		const struct pen_vec3 c = {m[0][2], m[1][2], m[2][2]};

		own = pen_linear(m, own);
		sign = pen_dot(a, pen_cross(b, c)) < 0.0f ? -sign : sign;
	}
	*ret_tangent = own;
	*ret_sign = sign;
	return true;
}

/*
 * The normal that a map gives, on the side of wo; one that wo sees from behind is turned until it
 * is just in view. normal: unit, on the side of wo, which is the mesh's other side when behind.
 */
static struct pen_vec3 mapped_normal(const struct site *site, const struct pen_texture *texture,
	float scale, const struct coordinates *at, struct pen_vec3 normal, bool behind,
	struct pen_vec3 wo)
{
	const struct pen_texel texel = read_input(texture, at);
	const struct pen_vec3 n = behind ? pen_neg(normal) : normal;
	const float x = (2.0f * texel.red - 1.0f) * scale;
	const float y = (2.0f * texel.green - 1.0f) * scale;
	const float z = 2.0f * texel.blue - 1.0f;
	struct pen_vec3 t, mapped;
	float sign, shortfall;

	if (!texture->mipmap || !find_tangent(site, &t, &sign))
		return normal;
	t = pen_madd(t, -pen_dot(t, n), n);
	t = pen_scale(t, 1.0f / pen_max(pen_length(t), PEN_TINY));
	mapped = pen_madd(pen_madd(pen_scale(n, z), x, t), y * sign, pen_cross(n, t));
	mapped = pen_normalize(behind ? pen_neg(mapped) : mapped);
	shortfall = 0.01f - pen_dot(mapped, wo);
	if (shortfall > 0.0f)
		mapped = pen_normalize(pen_madd(mapped, shortfall, wo));
	/* false for what is no number, too */
	return pen_dot(mapped, wo) > 0.0f ? mapped : normal;
}

static float alpha_of(float roughness)
{
	return pen_max(roughness * roughness, PEN_ALPHA_MIN);
}

static void set_color(struct pen_points *points, int lane, const struct pen_material *material,
	struct pen_texel texel, struct pen_texel vertex)
{
	points->red[lane] = material->color[0] * texel.red * vertex.red;
	points->green[lane] = material->color[1] * texel.green * vertex.green;
	points->blue[lane] = material->color[2] * texel.blue * vertex.blue;
}

static void set_glow(struct pen_points *points, int lane, struct pen_vec3 glow)
{
	points->glow_red[lane] = glow.x;
	points->glow_green[lane] = glow.y;
	points->glow_blue[lane] = glow.z;
}

static void set_coat(const struct site *site, const struct pen_material *material,
	const struct coordinates *at, struct pen_points *points, int lane, struct pen_vec3 normal,
	struct pen_vec3 wo)
{
	const struct pen_texture *inputs = material->inputs;
	const struct pen_vec3 coat_normal = mapped_normal(site, &inputs[PEN_INPUT_CLEARCOAT_NORMAL],
		material->clearcoat_normal_scale, at, normal, points->backside[lane] != 0, wo);

	points->coat[lane] = material->clearcoat * read_number(&inputs[PEN_INPUT_CLEARCOAT], at);
	points->coat_alpha[lane] =
		alpha_of(material->clearcoat_roughness *
			 read_number(&inputs[PEN_INPUT_CLEARCOAT_ROUGHNESS], at));
	points->coat_x[lane] = coat_normal.x;
	points->coat_y[lane] = coat_normal.y;
	points->coat_z[lane] = coat_normal.z;
}

/* What only principled has; its normal has been found. */
static void set_principled(const struct pen_render_scene *scene,
	const struct pen_material *material, const struct coordinates *at,
	struct pen_points *points, int lane, float roughness, struct pen_vec3 wo)
{
	const struct pen_texture *inputs = material->inputs;
	const struct pen_vec3 n = {
		points->normal_x[lane], points->normal_y[lane], points->normal_z[lane]};
	const struct pen_texel glow = read_input(&inputs[PEN_INPUT_EMISSION], at);

	points->additive[lane] = material->is_additive ? UINT32_MAX : 0;
	points->alpha[lane] = alpha_of(roughness);
	points->f0[lane] = material->f0;
	points->metallic[lane] = material->metallic * read_number(&inputs[PEN_INPUT_METALLIC], at);
	points->transmission[lane] =
		material->transmission * read_number(&inputs[PEN_INPUT_TRANSMISSION], at);
	points->albedo[lane] =
		pen_albedo_of(scene->albedo, material->f0, roughness, pen_dot(n, wo));
	set_glow(points, lane,
		pen_vec3(material->emission[0] * glow.red, material->emission[1] * glow.green,
			material->emission[2] * glow.blue));
}

static void find_at(const struct pen_render_scene *scene, const struct site *site,
	const struct pen_paths *paths, struct pen_points *points, int lane)
{
	const struct pen_material *material = &scene->materials[site->shape->surface];
	const struct pen_texture *inputs = material->inputs;
	const struct pen_rays *rays = &paths->packet.rays;
	const struct pen_vec3 wo = {
		-rays->direction_x[lane], -rays->direction_y[lane], -rays->direction_z[lane]};
	const struct pen_vec3 normal = {
		points->normal_x[lane], points->normal_y[lane], points->normal_z[lane]};
	struct pen_vec3 major, minor, mapped;
	struct coordinates at = {.uv = {{0.0f, 0.0f}}};
	float roughness;

	if (material->has_textures) {
		find_axes(paths, points, lane, &major, &minor);
		find_coordinates(site, major, minor, &at);
	}
	set_color(points, lane, material, read_input(&inputs[PEN_INPUT_COLOR], &at),
		vertex_color(site));
	set_glow(points, lane, pen_vec3(0.0f, 0.0f, 0.0f));
	if (material->is_unlit) {
		set_glow(points, lane,
			pen_vec3(points->red[lane], points->green[lane], points->blue[lane]));
		return;
	}
	mapped = mapped_normal(site, &inputs[PEN_INPUT_NORMAL], material->normal_scale, &at, normal,
		points->backside[lane] != 0, wo);
	points->normal_x[lane] = mapped.x;
	points->normal_y[lane] = mapped.y;
	points->normal_z[lane] = mapped.z;
	roughness = material->roughness * read_number(&inputs[PEN_INPUT_ROUGHNESS], &at);
	if (points->kind[lane] == PEN_KIND_GLOSSY)
		points->alpha[lane] = alpha_of(roughness);
	if (!material->is_principled)
		return;
	set_principled(scene, material, &at, points, lane, roughness, wo);
	set_coat(site, material, &at, points, lane, normal, wo);
}

/* The sphere that a site is on, and which way its point lies from the centre. */
static void find_sphere(struct site *site, struct pen_vec3 p)
{
	const struct pen_spheres spheres = {site->geometry->spheres + site->model->first,
		site->model->count, site->model->step_count};
	const struct pen_sphere sphere =
		pen_sphere_at(&spheres, (int32_t)site->primitive, site->time);

	if (site->world) {
		const float(*m)[4] = site->world;

		p = pen_linear_inverse(m, pen_vec3(p.x - m[0][3], p.y - m[1][3], p.z - m[2][3]));
	}
	site->out = pen_normalize(pen_sub(p, pen_vec3(sphere.x, sphere.y, sphere.z)));
	site->radius = sphere.radius;
}

static void find_lane(const struct pen_render_scene *scene, const struct pen_paths *paths,
	struct pen_points *points, int lane)
{
	const struct pen_hits *hits = &paths->packet.hits;
	const uint32_t placed = hits->instance[lane];
	const uint32_t id = placed != PEN_NO_INDEX ? placed : hits->geometry[lane];
	const struct pen_shape *shape;
	struct site site;
	float moving[3][4];

	if (id == PEN_NO_INDEX)
		return;
	shape = &scene->geometry.shapes[id];
	if ((scene->surfaces[shape->surface].kinds & PEN_KIND_DETAILED) == 0)
		return;
	site = (struct site){
		.geometry = &scene->geometry,
		.shape = shape,
		.model = &scene->geometry.models[shape->model],
		.world = shape->placement_count > 0 ? shape->world : NULL,
		.primitive = hits->primitive[lane],
		.u = hits->u[lane],
		.v = hits->v[lane],
		.time = paths->packet.rays.time[lane],
	};
	if (shape->placement_count > 1) {
		pen_trace_placement(scene->trace, id, site.time, moving);
		site.world = (const float(*)[4])moving;
	}
	if (site.model->type == PEN_MODEL_SPHERES)
		find_sphere(&site, pen_vec3(points->x[lane], points->y[lane], points->z[lane]));
	points->solid[lane] = scene->solids[id] ? UINT32_MAX : 0;
	find_at(scene, &site, paths, points, lane);
}

/* Lanes that are no principled surface are computed along with those that are: with this. */
static void clear_principled(struct pen_points *points)
{
	for (int i = 0; i < PEN_LANES; i++) {
		points->glow_red[i] = points->glow_green[i] = points->glow_blue[i] = 0.0f;
		points->f0[i] = points->metallic[i] = points->transmission[i] = 0.0f;
		points->albedo[i] = points->coat[i] = 0.0f;
		points->coat_alpha[i] = 1.0f;
		points->coat_x[i] = points->smooth_x[i] = points->normal_x[i];
		points->coat_y[i] = points->smooth_y[i] = points->normal_y[i];
		points->coat_z[i] = points->smooth_z[i] = points->normal_z[i];
		points->solid[i] = points->additive[i] = 0;
	}
}

void pen_detail_find(
	const struct pen_pass *pass, const struct pen_paths *paths, struct pen_points *points)
{
	clear_principled(points);
	for (int i = 0; i < PEN_LANES; i++)
		find_lane(pass->scene, paths, points, i);
}

/* Texture coordinates of a site without a footprint. */
static struct coordinates find_center(const struct site *site)
{
	struct coordinates at = {.uv = {{0.0f, 0.0f}}};

	if (site->model->type == PEN_MODEL_SPHERES)
		at.uv[0] = at.uv[1] = sphere_uv(pen_normalize(site->out));
	for (int set = 0; set < 2 && site->model->type == PEN_MODEL_TRIANGLES; set++) {
		const float *uv[3];

		if (site->model->uv_offsets[set] == PEN_NO_INDEX)
			continue;
		load_corners(site, site->geometry->uvs, site->model->uv_offsets[set], 2, uv);
		at.uv[set] = (struct pen_vec2){blend(site, uv[0][0], uv[1][0], uv[2][0]),
			blend(site, uv[0][1], uv[1][1], uv[2][1])};
	}
	return at;
}

static float opacity_at(
	const struct pen_material *material, const struct site *site, const struct coordinates *at)
{
	return material->opacity * vertex_color(site).alpha *
	       read_input(&material->inputs[PEN_INPUT_COLOR], at).alpha;
}

static struct site site_of(const struct pen_render_scene *scene, uint32_t shape, uint32_t primitive,
	float u, float v, struct pen_vec3 normal)
{
	const struct pen_shape *of = &scene->geometry.shapes[shape];

	return (struct site){
		.geometry = &scene->geometry,
		.shape = of,
		.model = &scene->geometry.models[of->model],
		.primitive = primitive,
		.u = u,
		.v = v,
		.out = normal,
	};
}

float pen_detail_opacity(const struct pen_render_scene *scene, uint32_t shape, uint32_t primitive,
	float u, float v, struct pen_vec3 normal)
{
	const struct site site = site_of(scene, shape, primitive, u, v, normal);
	const struct pen_material *material = &scene->materials[site.shape->surface];
	const struct coordinates at = material->inputs[PEN_INPUT_COLOR].mipmap
					      ? find_center(&site)
					      : (struct coordinates){.uv = {{0.0f, 0.0f}}};

	return opacity_at(material, &site, &at);
}

struct pen_vec3 pen_detail_emission(const struct pen_render_scene *scene, uint32_t shape,
	uint32_t primitive, float u, float v, struct pen_vec3 normal, float cosine)
{
	const struct site site = site_of(scene, shape, primitive, u, v, normal);
	const struct pen_material *material = &scene->materials[site.shape->surface];
	const float *e = material->emission;
	const struct pen_texture *inputs = material->inputs;
	struct coordinates at = {.uv = {{0.0f, 0.0f}}};
	struct pen_texel glow;
	float passed = 1.0f;

	if (material->has_textures)
		at = find_center(&site);
	if (material->alpha_mode == PEN_ALPHA_BLEND)
		passed = pen_clamp(opacity_at(material, &site, &at), 0.0f, 1.0f);
	else if (material->alpha_mode == PEN_ALPHA_MASK)
		passed = opacity_at(material, &site, &at) >= material->alpha_cutoff ? 1.0f : 0.0f;
	if (material->clearcoat > 0.0f && !material->is_additive)
		passed *= 1.0f -
			  pen_coat_fresnel(material->clearcoat *
						   read_number(&inputs[PEN_INPUT_CLEARCOAT], &at),
				  cosine);
	glow = read_input(&inputs[PEN_INPUT_EMISSION], &at);
	return pen_scale(pen_vec3(e[0] * glow.red, e[1] * glow.green, e[2] * glow.blue), passed);
}
