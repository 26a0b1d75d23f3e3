/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/sieve.h"

#include "core/render/detail.h"

/* Groups of sample dimensions above those of core/render/sequence.h: one for each primitive. */
#define SIEVE_GROUPS (1u << 31)

static uint32_t group_of(const struct pen_sieve *sieve, const struct pen_meeting *meeting)
{
	const uint32_t event = 2 * sieve->pass->depth + (sieve->is_shadow ? 1 : 0);

	return SIEVE_GROUPS |
	       pen_hash(pen_hash(pen_hash(event) ^ meeting->shape) ^ meeting->primitive);
}

bool pen_sieve_stops(const struct pen_sieve *sieve, const struct pen_meeting *meeting)
{
	const struct pen_render_scene *scene = sieve->pass->scene;
	const struct pen_material *material =
		&scene->materials[scene->geometry.shapes[meeting->shape].surface];
	float opacity, u, unused;

	if (material->is_one_sided && meeting->behind)
		return false;
	if (material->alpha_mode == PEN_ALPHA_OPAQUE)
		return true;
	opacity = pen_detail_opacity(
		scene, meeting->shape, meeting->primitive, meeting->u, meeting->v, meeting->normal);
	if (material->alpha_mode == PEN_ALPHA_MASK)
		return opacity >= material->alpha_cutoff;
	pen_sampler_pairs(sieve->pass->sampler, group_of(sieve, meeting), 1,
		&sieve->key[meeting->lane], &sieve->index[meeting->lane], &u, &unused);
	return u < opacity;
}
