/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_PRINCIPLED_H
#define PEN_RENDER_PRINCIPLED_H

#include "core/render/bsdf.h"

/*
 * principled: glTF 2.0's metallic-roughness model (its appendix B) with KHR_materials_ior,
 * _transmission and _clearcoat, per lane:
 *
 *   coat(mix(fresnel_mix(mix(diffuse, transmission), specular), conductor, metallic), specular)
 *
 * GGX with separable Smith masking, and Schlick's Fresnel term at the half vector. Three things are
 * decided here, see deploy/decisions/0007-principled.md: transmission through a closed mesh
 * refracts, by the exact Fresnel term; what the specular layer returns of a white world is never
 * given to the diffuse base as well, which near grazing glTF's mix would do; and the diffuse base
 * grows dark towards the terminator of the surface that a normal map bends.
 *
 * An additive surface is Blender 3's Principled BSDF instead: the lobes are added up, the coat with
 * a quarter of its strength; Fresnel terms are exact ones; and the diffuse lobe is Burley's
 * ("Physically Based Shading at Disney", 2012, section 5.3).
 */

struct pen_principled {
	struct pen_vec3 color;
	float alpha; /* >= PEN_ALPHA_MIN */
	float eta;   /* as of glass; of what is solid */
	float f0;
	float metallic, transmission;
	int is_additive;
	int is_solid; /* transmission refracts; else it goes straight through a thin wall */
	float albedo; /* of the specular layer of a dielectric, seen from wo */
	float coat;   /* strength */
	float coat_alpha;
	struct pen_vec3 coat_normal;
	struct pen_vec3 smooth_normal; /* n before a normal map bent it */
};

/* bsdf * |cos| by parts, and densities of the lobes by themselves. */
struct pen_principled_value {
	struct pen_vec3 diffuse, others;
	float diffuse_pdf, specular_pdf, transmission_pdf, coat_pdf;
};

/* How likely each lobe is sampled: their sum is 1. */
struct pen_principled_chances {
	float coat, specular, transmission, diffuse;
};

PEN_LANE float pen_schlick_weight(float c)
{
	const float m = 1.0f - pen_clamp(c, 0.0f, 1.0f);
	const float m2 = m * m;

	return m2 * m2 * m;
}

PEN_LANE float pen_brightest(struct pen_vec3 v)
{
	return pen_max(pen_max(v.x, v.y), v.z);
}

/* Exact reflectance at a cosine of what returns f0 head-on. */
PEN_LANE float pen_fresnel_of(float f0, float c)
{
	const float root = sqrtf(f0);
	const float eta = pen_max((1.0f + root) / pen_max(1.0f - root, 1e-3f), 1.001f);

	return pen_fresnel(pen_clamp(c, 0.0f, 1.0f), eta);
}

/* How far a metal's reflectance has come from its colour to 1. */
PEN_LANE float pen_grazing_weight(const struct pen_principled *p, float c)
{
	const float exact = (pen_fresnel_of(p->f0, c) - p->f0) / (1.0f - p->f0);

	return p->is_additive ? pen_max(exact, 0.0f) : pen_schlick_weight(c);
}

/* Reflectance of the dielectric at a cosine. */
PEN_LANE float pen_principled_fresnel(const struct pen_principled *p, float c)
{
	const float schlick = p->is_additive ? pen_fresnel_of(p->f0, c)
					     : p->f0 + (1.0f - p->f0) * pen_schlick_weight(c);
	const float exact = pen_fresnel(pen_clamp(c, 0.0f, 1.0f), p->eta);

	return p->is_solid ? schlick + p->transmission * (exact - schlick) : schlick;
}

/* What a coat of a strength reflects at a cosine. */
PEN_LANE float pen_coat_fresnel(float strength, float cosine)
{
	return strength * (0.04f + 0.96f * pen_schlick_weight(fabsf(cosine)));
}

/* How much the coat reflects: by the cosine of the view, as glTF has it, or of a facet. */
PEN_LANE float pen_coat_share(const struct pen_principled *p, struct pen_vec3 wo, float half_cos)
{
	return p->is_additive ? 0.25f * p->coat * pen_fresnel_of(0.04f, half_cos)
			      : pen_coat_fresnel(p->coat, pen_dot(p->coat_normal, wo));
}

/* What a coat leaves for what is below it. */
PEN_LANE float pen_below_coat(const struct pen_principled *p, float coat)
{
	return p->is_additive ? 1.0f : 1.0f - coat;
}

/* Burley's diffuse lobe over Lambert's. */
PEN_LANE float pen_burley(
	float roughness, struct pen_vec3 n, struct pen_vec3 wo, struct pen_vec3 wi)
{
	const float rise = roughness * (1.0f + pen_dot(wo, wi)) - 0.5f;

	return (1.0f + rise * pen_schlick_weight(pen_dot(n, wo))) *
	       (1.0f + rise * pen_schlick_weight(pen_dot(n, wi)));
}

/*
 * How much of the light from wi reaches a diffuse surface whose normal smooth is bent to n: 1 where
 * the bent surface is turned away from the light more than the smooth one; else it fades to nothing
 * where the smooth surface turns dark, and not at once (Chiang, Li, Burley 2019, "Taming the shadow
 * terminator").
 */
PEN_LANE float pen_terminator(struct pen_vec3 smooth, struct pen_vec3 n, struct pen_vec3 wi)
{
	const float bent = pen_dot(n, wi) * pen_max(pen_dot(n, smooth), PEN_TINY);
	const float g = pen_clamp(pen_dot(smooth, wi) / pen_max(bent, PEN_TINY), 0.0f, 1.0f);

	return g * (1.0f + g * (1.0f - g));
}

/* The other side of the surface: where light through a thin wall would have been reflected to. */
PEN_LANE struct pen_vec3 pen_flip(struct pen_vec3 w, struct pen_vec3 n)
{
	return pen_madd(w, -2.0f * pen_dot(w, n), n);
}

/* Refraction alone through facets on wo's side; without the Fresnel term. wi below. */
PEN_LANE struct pen_lobe_value pen_refraction_eval(
	float alpha, float eta, struct pen_vec3 n, struct pen_vec3 wo, struct pen_vec3 wi)
{
	const struct pen_basis basis = pen_basis(n);
	const struct pen_vec3 o = pen_ggx_local(&basis, wo);
	const struct pen_vec3 i = pen_to_local(&basis, wi);
	const struct pen_vec3 half = pen_normalize(pen_madd(o, eta, i));
	const struct pen_vec3 m = half.z < 0.0f ? pen_neg(half) : half;
	const float dot_o = pen_dot(o, m);
	const float dot_i = pen_dot(i, m);
	const bool possible = dot_o > 0.0f && dot_i < 0.0f && i.z < 0.0f;
	const float safe_o = pen_max(dot_o, 1e-7f);
	const float visible =
		2.0f * safe_o * pen_ggx_density(alpha, m) / (o.z + pen_ggx_stretch(alpha, o.z));
	const float pdf = possible ? visible * pen_refract_jacobian(safe_o, dot_i, eta) : 0.0f;

	return (struct pen_lobe_value){
		.value = pdf * pen_ggx_masking(alpha, fabsf(i.z)) *
			 (1.0f - pen_fresnel(pen_min(safe_o, 1.0f), eta)),
		.pdf = pdf,
	};
}

PEN_LANE struct pen_principled_chances pen_principled_chances(
	const struct pen_principled *p, struct pen_vec3 n, struct pen_vec3 wo, float diffuse_max)
{
	const float c = pen_max(pen_dot(n, wo), 0.0f);
	const float dielectric = 1.0f - p->metallic;
	const float bright = pen_brightest(p->color);
	const float fresnel = pen_principled_fresnel(p, c);
	const float metal = bright + (1.0f - bright) * pen_grazing_weight(p, c);
	const float layer = pen_max(fresnel, p->albedo);
	const float coat = pen_coat_share(p, wo, pen_dot(p->coat_normal, wo));
	const float specular = dielectric * layer + p->metallic * metal;
	const float through = dielectric * p->transmission * (1.0f - fresnel) * bright;
	const float diffuse = dielectric * (1.0f - p->transmission) * (1.0f - p->albedo) * bright;
	const float below = pen_below_coat(p, coat);
	const float sum = pen_max(coat + below * (specular + through + diffuse), PEN_TINY);
	const float diffuse_chance = pen_min(below * diffuse / sum, diffuse_max);
	const float others = coat + below * (specular + through);
	const float rest = (1.0f - diffuse_chance) / pen_max(others, PEN_TINY);

	return (struct pen_principled_chances){
		.coat = coat * rest,
		.specular = below * specular * rest,
		.transmission = below * through * rest,
		.diffuse = diffuse_chance,
	};
}

PEN_LANE struct pen_principled_value pen_principled_eval(
	const struct pen_principled *p, struct pen_vec3 n, struct pen_vec3 wo, struct pen_vec3 wi)
{
	const bool up = pen_dot(n, wi) > 0.0f;
	const struct pen_vec3 mirrored = up ? wi : pen_flip(wi, n);
	const float half_cos = pen_min(0.5f * pen_length(pen_add(wo, mirrored)), 1.0f);
	const float grazing = pen_grazing_weight(p, half_cos);
	const float fresnel = pen_principled_fresnel(p, half_cos);
	const float dielectric = 1.0f - p->metallic;
	const struct pen_lobe_value facet = pen_glossy_eval(p->alpha, n, wo, mirrored);
	const struct pen_lobe_value bent = pen_refraction_eval(p->alpha, p->eta, n, wo, wi);
	const struct pen_lobe_value coat = pen_glossy_eval(p->coat_alpha, p->coat_normal, wo, wi);
	const struct pen_lobe_value base = pen_matte_eval(n, wi);
	const float coat_share = pen_coat_share(p, wo, half_cos);
	const float below = pen_below_coat(p, coat_share);
	const float to_base = p->is_additive ? pen_burley(sqrtf(p->alpha), n, wo, wi)
					     : pen_min(1.0f - fresnel, 1.0f - p->albedo);
	const float lit = base.value * pen_terminator(p->smooth_normal, n, wi);
	const float diffuse = below * dielectric * (1.0f - p->transmission) * to_base * lit;
	const float thin = up ? 0.0f : facet.value * (1.0f - fresnel);
	const float through =
		below * dielectric * p->transmission * (p->is_solid ? bent.value : thin);
	const float gloss = up ? below * facet.value : 0.0f;
	const float white =
		gloss * (dielectric * fresnel + p->metallic * grazing) + coat_share * coat.value;
	const float tinted = gloss * p->metallic * (1.0f - grazing) + through;

	return (struct pen_principled_value){
		.diffuse = pen_scale(p->color, diffuse),
		.others = {white + tinted * p->color.x, white + tinted * p->color.y,
			white + tinted * p->color.z},
		.diffuse_pdf = base.pdf,
		.specular_pdf = up ? facet.pdf : 0.0f,
		.transmission_pdf = p->is_solid ? bent.pdf
				    : up	? 0.0f
						: facet.pdf,
		.coat_pdf = coat.pdf,
	};
}

/* The density of all lobes together, but for the diffuse one when it is not followed. */
PEN_LANE float pen_principled_pdf(const struct pen_principled_value *value,
	const struct pen_principled_chances *chances, bool follows_diffuse)
{
	const float diffuse = follows_diffuse ? chances->diffuse * value->diffuse_pdf : 0.0f;

	return chances->coat * value->coat_pdf + chances->specular * value->specular_pdf +
	       chances->transmission * value->transmission_pdf + diffuse;
}

/*
 * A direction of a lobe that choice in [0,1) picks; the zero vector for a diffuse lobe that is not
 * followed and for directions that are lost. Weigh it by pen_principled_eval.
 */
PEN_LANE struct pen_vec3 pen_principled_sample(const struct pen_principled *p,
	const struct pen_principled_chances *chances, struct pen_vec3 n, struct pen_vec3 wo,
	float u, float v, float choice, bool follows_diffuse)
{
	const int is_coat = choice < chances->coat;
	const float above_coat = choice - chances->coat;
	const int is_specular = !is_coat & (above_coat < chances->specular);
	const float above_specular = above_coat - chances->specular;
	const int is_through = !is_coat & !is_specular & (above_specular < chances->transmission);
	const int is_diffuse = !is_coat & !is_specular & !is_through;
	const struct pen_vec3 normal = is_coat ? p->coat_normal : n;
	const float alpha = is_coat ? p->coat_alpha : p->alpha;
	const struct pen_lobe facet = pen_glossy_sample(alpha, normal, wo, u, v);
	const struct pen_lobe base = pen_matte_sample(n, u, v);
	const struct pen_basis basis = pen_basis(n);
	const struct pen_vec3 o = pen_ggx_local(&basis, wo);
	const struct pen_vec3 m = pen_ggx_sample(p->alpha, o, 1.0f, u, v);
	const struct pen_vec3 bent = pen_to_world(&basis, pen_refract(o, m, p->eta));
	const bool possible = pen_fresnel(pen_clamp(pen_dot(o, m), 0.0f, 1.0f), p->eta) < 1.0f;
	const struct pen_vec3 nowhere = {0.0f, 0.0f, 0.0f};
	const struct pen_vec3 reflected = facet.weight > 0.0f ? facet.direction : nowhere;
	const struct pen_vec3 solid = possible ? bent : nowhere;
	const struct pen_vec3 through = p->is_solid ? solid : pen_flip(reflected, n);
	const struct pen_vec3 diffuse = follows_diffuse ? base.direction : nowhere;

	return is_diffuse ? diffuse : is_through ? through : reflected;
}

#endif
