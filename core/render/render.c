/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/render.h"

#include "core/render/isa.h"
#include "core/render/lights.h"
#include "core/render/wavefront.h"
#include "core/scene/planes.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

struct pen_renderer {
	struct pen_wavefront wavefront;
};

static int queue_create(struct pen_path_queue *queue, uint32_t packets, struct pen_error *err)
{
	const size_t size = packets * sizeof *queue->packets;

	queue->capacity = packets * PEN_LANES;
	queue->packets = aligned_alloc(_Alignof(struct pen_paths), size);
	if (!queue->packets)
		return pen_error_memory(err);
	memset(queue->packets, 0, size);
	return 0;
}

/* How many packets a packet of camera rays may become. */
static uint32_t growth_of(const struct pen_scene *desc)
{
	return desc->integrator.type == PEN_INTEGRATOR_WHITTED ? 1u << desc->integrator.max_depth
							       : 1u;
}

int pen_renderer_create(const struct pen_render_scene *scene, struct pen_renderer **ret_renderer,
	struct pen_error *err)
{
	const uint32_t growth = growth_of(scene->desc);
	const uint32_t packets = growth >= PEN_BATCH_PACKETS / PEN_BATCH_PACKETS_MIN
					 ? PEN_BATCH_PACKETS_MIN
					 : PEN_BATCH_PACKETS / growth;
	struct pen_renderer *renderer = calloc(1, sizeof *renderer);
	struct pen_wavefront *wavefront;
	int r;

	if (!renderer)
		return pen_error_memory(err);
	wavefront = &renderer->wavefront;
	wavefront->film = pen_scene_film(scene->desc);
	wavefront->packets_max = packets;
	pen_sampler_init(&wavefront->sampler, &scene->desc->sampling, 0);
	pen_renderer_set_scene(renderer, scene);
	r = queue_create(&wavefront->now, packets * growth, err);
	if (r == 0)
		r = queue_create(&wavefront->next, packets * growth, err);
	wavefront->now.has_cones = wavefront->next.has_cones = scene->has_cones;
	wavefront->now.has_receivers = wavefront->next.has_receivers = scene->lights->chooses;
	wavefront->now.sample_share = wavefront->next.sample_share = scene->sample_share;
	wavefront->radiance = calloc(3 * (packets * PEN_LANES + 1ul), sizeof(float));
	wavefront->firsts = calloc(packets * PEN_LANES + 1ul, sizeof *wavefront->firsts);
	if (r == 0 && (!wavefront->radiance || !wavefront->firsts))
		r = pen_error_memory(err);
	if (r < 0) {
		pen_renderer_destroy(renderer);
		return r;
	}
	(void)pen_isa_denormals_flush();
	*ret_renderer = renderer;
	return 0;
}

void pen_renderer_destroy(struct pen_renderer *renderer)
{
	if (!renderer)
		return;
	free(renderer->wavefront.firsts);
	free(renderer->wavefront.radiance);
	free(renderer->wavefront.next.packets);
	free(renderer->wavefront.now.packets);
	free(renderer);
}

void pen_renderer_set_scene(struct pen_renderer *renderer, const struct pen_render_scene *scene)
{
	renderer->wavefront.scene = scene;
}

void pen_renderer_unit(struct pen_renderer *renderer, const struct pen_unit *unit,
	float *ret_pixels, struct pen_render_stats *ret_stats, _Atomic uint64_t *progress)
{
	assert(unit->frame == renderer->wavefront.scene->frame);
	renderer->wavefront.scene->kernel->unit(
		&renderer->wavefront, unit, ret_pixels, ret_stats, progress);
}
