/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/generate.h"

#include "core/render/camera.h"
#include "core/render/filter.h"

#include <string.h>

/* From the samples and the pixels' corners in film_x, film_y to rays. */
static void generate(const struct pen_pass *pass, const struct pen_camera_samples *samples,
	float film_x[PEN_LANES], float film_y[PEN_LANES], struct pen_paths *ret)
{
	const struct pen_render_scene *scene = pass->scene;
	const bool is_whitted = scene->desc->integrator.type == PEN_INTEGRATOR_WHITTED;
	struct pen_rays *rays = &ret->packet.rays;
	const struct pen_camera_rays to = {rays->origin_x, rays->origin_y, rays->origin_z,
		rays->direction_x, rays->direction_y, rays->direction_z};
	/* A pixel's height seen from the eye, as far as one sample stands for it. */
	const float spread = scene->camera.tan_y * scene->camera.pixel_y * scene->sample_share;
	_Alignas(64) float dx[PEN_LANES];
	_Alignas(64) float dy[PEN_LANES];

	pen_filter_sample(&scene->filter, PEN_LANES, samples->x, samples->y, dx, dy, ret->red);
	for (int i = 0; i < PEN_LANES && pass->at_centre; i++) {
		dx[i] = dy[i] = 0.0f;
		ret->red[i] = 1.0f;
	}
	if (is_whitted)
		memset(rays->time, 0, sizeof rays->time);
	else
		memcpy(rays->time, samples->time, sizeof rays->time);
#pragma omp simd
	for (int i = 0; i < PEN_LANES; i++) {
		film_x[i] += 0.5f + dx[i];
		film_y[i] += 0.5f + dy[i];
		ret->green[i] = ret->red[i];
		ret->blue[i] = ret->red[i];
		ret->lobe_pdf[i] = 0.0f;
		ret->width[i] = 0.0f;
		ret->spread[i] = spread;
		rays->tnear[i] = 0.0f;
		rays->tfar[i] = INFINITY;
	}
	pen_camera_generate(
		&scene->camera, PEN_LANES, film_x, film_y, samples->u, samples->v, rays->time, &to);
}

void pen_generate_block(
	const struct pen_pass *pass, uint32_t x, uint32_t y, uint32_t first, struct pen_paths *ret)
{
	const uint32_t key = pen_sampler_key(pass->sampler, x, y);
	const uint32_t share = pen_sampler_share(pass->sampler, x, y);
	struct pen_camera_samples samples;
	_Alignas(64) float film_x[PEN_LANES];
	_Alignas(64) float film_y[PEN_LANES];

	pen_sampler_block(pass->sampler, x, y, first, &samples);
	for (uint32_t i = 0; i < PEN_LANES; i++) {
		film_x[i] = (float)x;
		film_y[i] = (float)y;
		ret->key[i] = key;
		ret->index[i] = share + first + i;
	}
	generate(pass, &samples, film_x, film_y, ret);
}

void pen_generate_grid(
	const struct pen_pass *pass, uint32_t x, uint32_t y, uint32_t index, struct pen_paths *ret)
{
	struct pen_camera_samples samples;
	_Alignas(64) float film_x[PEN_LANES];
	_Alignas(64) float film_y[PEN_LANES];

	pen_sampler_grid(pass->sampler, x, y, index, &samples);
	for (uint32_t i = 0; i < PEN_LANES; i++) {
		const uint32_t pixel_x = x + i % 4, pixel_y = y + i / 4;

		film_x[i] = (float)pixel_x;
		film_y[i] = (float)pixel_y;
		ret->key[i] = pen_sampler_key(pass->sampler, pixel_x, pixel_y);
		ret->index[i] = pen_sampler_share(pass->sampler, pixel_x, pixel_y) + index;
	}
	generate(pass, &samples, film_x, film_y, ret);
}
