/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_BSDF_H
#define PEN_RENDER_BSDF_H

#include "core/render/vec.h"
#include "core/render/warp.h"

#include <stdbool.h>

/*
 * Surfaces, per lane, in world space. All directions are unit vectors that point away from the
 * surface: wo to where the path came from, wi to where it goes on. n is the unit shading normal
 * on wo's side. Colours are left out: multiply by the material's.
 */

/* Below this alpha a lobe is smooth: a delta, which eval and MIS leave out. */
#define PEN_ALPHA_MIN 1e-3f

/* A sampled direction. Its contribution: color * weight * radiance from there. */
struct pen_lobe {
	struct pen_vec3 direction;
	float weight; /* bsdf * |cos| / pdf; 0 when the direction is lost */
	float pdf;    /* by solid angle; 0 for a smooth lobe */
};

/* What a lobe makes of a direction that something else sampled. */
struct pen_lobe_value {
	float value; /* bsdf * |cos| */
	float pdf;   /* with which the lobe's own sampling gives it */
};

/* ---- matte: Lambert, 1 / pi ---- */

PEN_LANE struct pen_lobe pen_matte_sample(struct pen_vec3 n, float u, float v)
{
	const struct pen_basis basis = pen_basis(n);
	const struct pen_vec3 local = pen_warp_cosine(u, v);

	return (struct pen_lobe){
		.direction = pen_to_world(&basis, local),
		.weight = 1.0f,
		.pdf = local.z * PEN_INV_PI,
	};
}

PEN_LANE struct pen_lobe_value pen_matte_eval(struct pen_vec3 n, struct pen_vec3 wi)
{
	const float value = pen_max(pen_dot(n, wi), 0.0f) * PEN_INV_PI;

	return (struct pen_lobe_value){.value = value, .pdf = value};
}

/*
 * GGX (Trowbridge-Reitz), in a frame whose z is the surface normal.
 */

/* Density of microfacet normals m, projected: its integral times m.z is 1 (Walter et al. 2007). */
PEN_LANE float pen_ggx_density(float alpha, struct pen_vec3 m)
{
	const float a2 = alpha * alpha;
	const float d = m.x * m.x + m.y * m.y + a2 * m.z * m.z;

	return a2 * PEN_INV_PI / (d * d);
}

/* sqrt(z^2 + alpha^2 sin^2): half the denominator of Smith's masking less z. */
PEN_LANE float pen_ggx_stretch(float alpha, float z)
{
	return sqrtf(z * z + alpha * alpha * pen_max(1.0f - z * z, 0.0f));
}

/* Smith's masking of a direction at cosine z > 0. */
PEN_LANE float pen_ggx_masking(float alpha, float z)
{
	return 2.0f * z / (z + pen_ggx_stretch(alpha, z));
}

/*
 * A normal visible from wo (Dupuy, Benyoub 2023, "Sampling visible GGX normals with spherical
 * caps"). bound 1 gives them all; pen_ggx_bound only (nearly) those that reflect upwards.
 */
PEN_LANE struct pen_vec3 pen_ggx_sample(
	float alpha, struct pen_vec3 wo, float bound, float u, float v)
{
	const struct pen_vec3 w = pen_normalize(pen_vec3(alpha * wo.x, alpha * wo.y, wo.z));
	const float b = bound * w.z;
	const float z = (1.0f - u) * (1.0f + b) - b;
	const float r = pen_sqrt_clamped(1.0f - z * z);
	const struct pen_sincos phi = pen_sincos_turns(v);

	return pen_normalize(
		pen_vec3(alpha * (w.x + r * phi.cos), alpha * (w.y + r * phi.sin), w.z + z));
}

/* k of Eto and Tokuyoshi 2023, "Bounded VNDF sampling for Smith-GGX reflections", equation 5. */
PEN_LANE float pen_ggx_bound(float alpha, struct pen_vec3 wo)
{
	const float a2 = alpha * alpha;
	const float s = 1.0f + sqrtf(wo.x * wo.x + wo.y * wo.y);
	const float s2 = s * s;

	return (1.0f - a2) * s2 / (s2 + a2 * wo.z * wo.z);
}

/* A direction in the frame, lifted off the horizon when interpolated normals put it below. */
PEN_LANE struct pen_vec3 pen_ggx_local(const struct pen_basis *basis, struct pen_vec3 w)
{
	struct pen_vec3 local = pen_to_local(basis, w);

	local.z = pen_max(local.z, 1e-5f);
	return local;
}

/*
 * glossy: a GGX reflector with Smith's masking of both directions, single scattering, no Fresnel
 * term. The masking is separable, G1(wo) G1(wi): see deploy/decisions/0004-separable-masking.md.
 */

PEN_LANE struct pen_vec3 pen_reflect(struct pen_vec3 wo, struct pen_vec3 m)
{
	return pen_sub(pen_scale(m, 2.0f * pen_dot(wo, m)), wo);
}

/* alpha = roughness 0: a mirror. */
PEN_LANE struct pen_lobe pen_mirror_sample(struct pen_vec3 n, struct pen_vec3 wo)
{
	return (struct pen_lobe){.direction = pen_reflect(wo, n), .weight = 1.0f, .pdf = 0.0f};
}

PEN_LANE struct pen_lobe pen_glossy_sample(
	float alpha, struct pen_vec3 n, struct pen_vec3 wo, float u, float v)
{
	const struct pen_basis basis = pen_basis(n);
	const struct pen_vec3 o = pen_ggx_local(&basis, wo);
	const float bound = pen_ggx_bound(alpha, o);
	const struct pen_vec3 m = pen_ggx_sample(alpha, o, bound, u, v);
	const struct pen_vec3 i = pen_reflect(o, m);
	const float stretch = pen_ggx_stretch(alpha, o.z);
	const float cap = bound * o.z + stretch;
	const bool up = i.z > 0.0f;

	return (struct pen_lobe){
		.direction = pen_to_world(&basis, i),
		.weight = up ? pen_ggx_masking(alpha, i.z) * cap / (o.z + stretch) : 0.0f,
		.pdf = 0.5f * pen_ggx_density(alpha, m) / cap,
	};
}

PEN_LANE struct pen_lobe_value pen_glossy_eval(
	float alpha, struct pen_vec3 n, struct pen_vec3 wo, struct pen_vec3 wi)
{
	const struct pen_basis basis = pen_basis(n);
	const struct pen_vec3 o = pen_ggx_local(&basis, wo);
	const struct pen_vec3 i = pen_to_local(&basis, wi);
	const bool up = i.z > 0.0f;
	const float density = pen_ggx_density(alpha, pen_normalize(pen_add(o, i)));
	const float stretch = pen_ggx_stretch(alpha, o.z);
	const float masking = pen_ggx_masking(alpha, pen_max(i.z, 0.0f)) / (o.z + stretch);
	const float cap = pen_ggx_bound(alpha, o) * o.z + stretch;

	return (struct pen_lobe_value){
		.value = up ? 0.5f * density * masking : 0.0f,
		.pdf = up ? 0.5f * density / cap : 0.0f,
	};
}

/*
 * glass: a dielectric. eta is the index of the medium behind the surface over that of the medium
 * wo lies in: ior when entering, 1 / ior when leaving. Reflection and refraction are chosen by the
 * Fresnel term; radiance is not scaled by eta^2.
 */

/* Whether refraction hardly spreads; then the lobe counts as smooth. */
PEN_LANE bool pen_glass_is_smooth(float alpha, float eta)
{
	return alpha < PEN_ALPHA_MIN || fabsf(eta - 1.0f) < 1e-4f;
}

/* Exact unpolarised reflectance at cosine c >= 0; 1 in total reflection. */
PEN_LANE float pen_fresnel(float c, float eta)
{
	const float cos2 = 1.0f - (1.0f - c * c) / (eta * eta);
	const float t = pen_sqrt_clamped(cos2);
	const float s = (c - eta * t) / (c + eta * t);
	const float p = (eta * c - t) / (eta * c + t);

	return cos2 > 0.0f ? 0.5f * (s * s + p * p) : 1.0f;
}

/* wo refracted at a facet m on its side; meaningless in total reflection. */
PEN_LANE struct pen_vec3 pen_refract(struct pen_vec3 wo, struct pen_vec3 m, float eta)
{
	const float inv_eta = 1.0f / eta;
	const float c = pen_dot(wo, m);
	const float t = pen_sqrt_clamped(1.0f - (1.0f - c * c) * inv_eta * inv_eta);

	return pen_sub(pen_scale(m, c * inv_eta - t), pen_scale(wo, inv_eta));
}

/* choice in [0,1) decides between reflection and refraction. */
PEN_LANE struct pen_lobe pen_glass_smooth_sample(
	float eta, struct pen_vec3 n, struct pen_vec3 wo, float choice)
{
	const bool reflects = choice < pen_fresnel(pen_max(pen_dot(wo, n), 0.0f), eta);
	const struct pen_vec3 r = pen_reflect(wo, n);
	const struct pen_vec3 t = pen_refract(wo, n, eta);

	return (struct pen_lobe){
		.direction = {reflects ? r.x : t.x, reflects ? r.y : t.y, reflects ? r.z : t.z},
		.weight = 1.0f,
		.pdf = 0.0f,
	};
}

/*
 * Density of the half vector's share of the solid angle of a refracted wi, |wi.m| eta^2 /
 * (wo.m + eta wi.m)^2 (Walter et al. 2007, equation 17); dot_i < 0.
 */
PEN_LANE float pen_refract_jacobian(float dot_o, float dot_i, float eta)
{
	const float d = dot_o + eta * dot_i;

	return -dot_i * eta * eta / (d * d);
}

/* The same with rough facets, for which Fresnel's term holds at the facet. */
PEN_LANE struct pen_lobe pen_glass_sample(float alpha, float eta, struct pen_vec3 n,
	struct pen_vec3 wo, float u, float v, float choice)
{
	const struct pen_basis basis = pen_basis(n);
	const struct pen_vec3 o = pen_ggx_local(&basis, wo);
	const struct pen_vec3 m = pen_ggx_sample(alpha, o, 1.0f, u, v);
	const float dot_o = pen_max(pen_dot(o, m), 1e-7f);
	const float fresnel = pen_fresnel(dot_o, eta);
	const bool reflects = choice < fresnel;
	const struct pen_vec3 r = pen_reflect(o, m);
	const struct pen_vec3 t = pen_refract(o, m, eta);
	const struct pen_vec3 i = {
		reflects ? r.x : t.x, reflects ? r.y : t.y, reflects ? r.z : t.z};
	const float cos_i = reflects ? i.z : -i.z;
	const float spread =
		reflects ? 0.25f * fresnel / dot_o
			 : (1.0f - fresnel) * pen_refract_jacobian(dot_o, pen_dot(i, m), eta);
	const float visible =
		2.0f * dot_o * pen_ggx_density(alpha, m) / (o.z + pen_ggx_stretch(alpha, o.z));

	return (struct pen_lobe){
		.direction = pen_to_world(&basis, i),
		.weight = cos_i > 0.0f ? pen_ggx_masking(alpha, cos_i) : 0.0f,
		.pdf = visible * spread,
	};
}

PEN_LANE struct pen_lobe_value pen_glass_eval(
	float alpha, float eta, struct pen_vec3 n, struct pen_vec3 wo, struct pen_vec3 wi)
{
	const struct pen_basis basis = pen_basis(n);
	const struct pen_vec3 o = pen_ggx_local(&basis, wo);
	const struct pen_vec3 i = pen_to_local(&basis, wi);
	const bool reflects = i.z > 0.0f;
	const struct pen_vec3 half = pen_normalize(pen_madd(o, reflects ? 1.0f : eta, i));
	const struct pen_vec3 m = half.z < 0.0f ? pen_neg(half) : half;
	const float dot_o = pen_dot(o, m);
	const float dot_i = pen_dot(i, m);
	/* Both sides of a facet must show what both sides of the surface do. */
	const bool possible = dot_o > 0.0f && (reflects ? dot_i > 0.0f : dot_i < 0.0f);
	const float safe_o = pen_max(dot_o, 1e-7f);
	const float fresnel = pen_fresnel(safe_o, eta);
	const float spread = reflects ? 0.25f * fresnel / safe_o
				      : (1.0f - fresnel) * pen_refract_jacobian(safe_o, dot_i, eta);
	const float visible =
		2.0f * safe_o * pen_ggx_density(alpha, m) / (o.z + pen_ggx_stretch(alpha, o.z));
	const float pdf = possible ? visible * spread : 0.0f;

	return (struct pen_lobe_value){
		.value = pdf * pen_ggx_masking(alpha, fabsf(i.z)),
		.pdf = pdf,
	};
}

#endif
