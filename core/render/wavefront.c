/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/wavefront.h"

#include "core/base/limits.h"
#include "core/base/mask.h"
#include "core/render/detail.h"
#include "core/render/direct.h"
#include "core/render/generate.h"
#include "core/render/point.h"

#include <assert.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

/*
 * What is summed together: samples [first, end) of one aligned block of sixteen, either of one
 * pixel, all in one packet, or of a 4x4 block of pixels, a packet for each sample. x and y are the
 * pixel's or the first pixel's.
 */
struct task {
	uint32_t x, y;
	uint32_t first, end;
	uint32_t packet; /* first of the batch */
	bool is_grid;
};

/* A unit on its way. */
struct progress {
	struct pen_wavefront *wavefront;
	const struct pen_unit *unit;
	float *pixels;
	struct pen_render_stats stats;
	_Atomic uint64_t *finished;
	struct task tasks[PEN_BATCH_PACKETS];
	uint32_t task_count, packet_count;
};

/* Fewer samples than this of a block are traced by 4x4 pixels: fewer rays are wasted. */
enum { BLOCK_SAMPLES_MIN = 12, BLOCK_SAMPLES = PEN_LANES };

static uint32_t dropped_slot(const struct pen_wavefront *wavefront)
{
	return wavefront->packets_max * PEN_LANES;
}

static bool has_firsts(const struct pen_film *film)
{
	return (film->albedo | film->normal | film->depth) != 0;
}

/* Notes what camera rays met. */
static void keep_firsts(const struct pen_wavefront *wavefront, const struct pen_paths *paths,
	const struct pen_points *points)
{
	const struct pen_rays *rays = &paths->packet.rays;

	for (int i = 0; i < PEN_LANES; i++) {
		struct pen_first *first = &wavefront->firsts[paths->slot[i]];
		const struct pen_vec3 direction = {
			rays->direction_x[i], rays->direction_y[i], rays->direction_z[i]};
		const struct pen_vec3 axis =
			pen_camera_axis(&wavefront->scene->camera, rays->time[i]);
		const bool is_black = points->kind[i] == PEN_KIND_LIGHT;

		*first = (struct pen_first){.hits = 0.0f};
		if (points->kind[i] == PEN_KIND_NOTHING)
			continue;
		*first = (struct pen_first){
			.albedo = {is_black ? 0.0f : points->red[i],
				is_black ? 0.0f : points->green[i],
				is_black ? 0.0f : points->blue[i]},
			.normal = {points->normal_x[i], points->normal_y[i], points->normal_z[i]},
			.depth = rays->tfar[i] * pen_dot(direction, axis),
			.hits = 1.0f,
		};
	}
}

static void add_to_slots(
	float *radiance, const struct pen_paths *paths, const struct pen_gathered *sum)
{
	for (int i = 0; i < PEN_LANES; i++) {
		float *to = radiance + 3 * (size_t)paths->slot[i];

		to[0] += sum->red[i];
		to[1] += sum->green[i];
		to[2] += sum->blue[i];
	}
}

static void clear(struct pen_gathered *sum)
{
	for (int i = 0; i < PEN_LANES; i++)
		sum->red[i] = sum->green[i] = sum->blue[i] = 0.0f;
}

/* One step of sixteen paths: to what they hit, its light, and on. */
static void step_packet(
	struct pen_wavefront *wavefront, struct pen_pass *pass, struct pen_paths *paths)
{
	const struct pen_render_scene *scene = wavefront->scene;
	struct pen_gathered sum;
	struct pen_points points;
	const struct pen_sieve sieve = {pass, paths->key, paths->index, false};

	clear(&sum);
	pass->rays_dropped +=
		pen_trace_closest(scene->trace, pass->is_coherent, &sieve, &paths->packet);
	pen_points_find(scene, &paths->packet, &points);
	if (points.kinds & PEN_KIND_DETAILED)
		pen_detail_find(pass, paths, &points);
	if (pass->depth == 0 && has_firsts(&wavefront->film))
		keep_firsts(wavefront, paths, &points);
	if (points.kinds & (PEN_KIND_NOTHING | PEN_KIND_LIGHT | PEN_KIND_GLOWING))
		pen_direct_seen(pass, paths, &points, &sum);
	/* From max_depth a path still looks where its lobe leads, but only for light. */
	if (pass->depth <= scene->desc->integrator.max_depth) {
		pen_direct_add(pass, paths, &points, &sum);
		pen_scatter(pass, paths, &points, dropped_slot(wavefront), &wavefront->next);
	}
	add_to_slots(wavefront->radiance, paths, &sum);
}

/* Takes the batch's paths to their ends. */
static void trace_batch(struct progress *p)
{
	struct pen_wavefront *wavefront = p->wavefront;
	struct pen_pass pass = {
		.scene = wavefront->scene,
		.sampler = &wavefront->sampler,
		.is_coherent = true,
	};

	wavefront->now.count = p->packet_count * PEN_LANES;
	memset(wavefront->radiance, 0,
		3 * (dropped_slot(wavefront) + 1ul) * sizeof *wavefront->radiance);
	while (wavefront->now.count > 0) {
		const uint32_t packets = (wavefront->now.count + PEN_LANES - 1) / PEN_LANES;
		const struct pen_path_queue done = wavefront->now;

		pass.rays += wavefront->now.count;
		wavefront->next.count = 0;
		for (uint32_t i = 0; i < packets; i++)
			step_packet(wavefront, &pass, &wavefront->now.packets[i]);
		pen_path_queue_close(&wavefront->next);
		wavefront->now = wavefront->next;
		wavefront->next = done;
		pass.is_coherent = false;
		pass.depth++;
	}
	p->stats.rays += pass.rays;
	p->stats.rays_dropped += pass.rays_dropped;
}

static void add_sample(struct progress *p, const float *radiance, float sum[3])
{
	p->stats.samples++;
	if (!isfinite(radiance[0] + radiance[1] + radiance[2])) {
		p->stats.samples_black++;
		return;
	}
	for (int c = 0; c < 3; c++)
		sum[c] += radiance[c];
}

static void add_first(const struct pen_first *first, struct pen_first *sum)
{
	for (int c = 0; c < 3; c++) {
		sum->albedo[c] += first->albedo[c];
		sum->normal[c] += first->normal[c];
	}
	sum->depth += first->depth;
	sum->hits += first->hits;
}

static bool is_finite(const struct pen_first *first)
{
	return isfinite(first->albedo[0] + first->albedo[1] + first->albedo[2] + first->normal[0] +
			first->normal[1] + first->normal[2] + first->depth);
}

/* The same for the planes of first hits. */
static void add_firsts(const struct progress *p, const struct task *task, uint32_t place,
	uint32_t stride, float *pixel)
{
	const struct pen_film *film = &p->wavefront->film;
	struct pen_first sum = {.hits = 0.0f};

	for (uint32_t i = task->first; i < task->end; i++, place += stride)
		if (is_finite(&p->wavefront->firsts[place]))
			add_first(&p->wavefront->firsts[place], &sum);
	for (uint32_t c = 0; c < 3 && film->albedo; c++)
		pixel[film->albedo + c] += sum.albedo[c];
	for (uint32_t c = 0; c < 3 && film->normal; c++)
		pixel[film->normal + c] += sum.normal[c];
	if (film->depth) {
		pixel[film->depth] += sum.depth;
		pixel[film->depth + 1] += sum.hits;
	}
}

/* What the halves of a block say of its variance. */
static void add_moments(const float half[3], const float whole[3], float *moments)
{
	for (int c = 0; c < 3; c++) {
		const float a = pen_max(half[c], 0.0f), b = pen_max(whole[c] - half[c], 0.0f);
		const float difference =
			0.5f * (a / (BLOCK_SAMPLES / 2 + a) - b / (BLOCK_SAMPLES / 2 + b));

		moments[c] += difference * difference;
	}
}

/* Sums a pixel's samples of a task in the order of their indices, then adds the block. */
static void add_pixel(struct progress *p, const struct task *task, uint32_t x, uint32_t y)
{
	const struct pen_film *film = &p->wavefront->film;
	const struct pen_rect rect = p->unit->rect;
	const uint32_t lane =
		task->is_grid ? (y - task->y) * 4 + (x - task->x) : task->first % BLOCK_SAMPLES;
	const uint32_t stride = task->is_grid ? PEN_LANES : 1;
	const uint32_t place = task->packet * PEN_LANES + lane;
	const float *from = p->wavefront->radiance + 3 * (size_t)place;
	float *pixel = p->pixels + film->channels * ((size_t)(y - rect.y0) * pen_rect_width(rect) +
							    (x - rect.x0));
	float sum[3] = {0}, half[3] = {0};

	for (uint32_t i = task->first; i < task->end; i++, from += 3 * (size_t)stride) {
		if (i % BLOCK_SAMPLES == BLOCK_SAMPLES / 2)
			memcpy(half, sum, sizeof half);
		add_sample(p, from, sum);
	}
	for (int c = 0; c < 3; c++)
		pixel[c] += sum[c];
	pixel[PEN_CHANNEL_COUNT] += (float)(task->end - task->first);
	if (film->moments && task->end - task->first == BLOCK_SAMPLES)
		add_moments(half, sum, pixel + film->moments);
	if (has_firsts(film))
		add_firsts(p, task, place, stride, pixel);
}

/* Whether the unit is to render the pixel. */
static bool is_asked_for(const struct pen_unit *unit, uint32_t x, uint32_t y)
{
	const struct pen_rect rect = unit->rect;

	return x >= rect.x0 && x < rect.x1 && y >= rect.y0 && y < rect.y1 &&
	       (!unit->mask ||
		       pen_mask_has(unit->mask,
			       (size_t)(y - rect.y0) * pen_rect_width(rect) + (x - rect.x0)));
}

static void add_task(struct progress *p, const struct task *task)
{
	if (!task->is_grid) {
		add_pixel(p, task, task->x, task->y);
		return;
	}
	for (uint32_t i = 0; i < PEN_LANES; i++)
		if (is_asked_for(p->unit, task->x + i % 4, task->y + i / 4))
			add_pixel(p, task, task->x + i % 4, task->y + i / 4);
}

static void finish_batch(struct progress *p)
{
	if (p->task_count == 0)
		return;
	trace_batch(p);
	for (uint32_t i = 0; i < p->task_count; i++)
		add_task(p, &p->tasks[i]);
	if (p->finished)
		atomic_store_explicit(p->finished, p->stats.samples, memory_order_relaxed);
	p->task_count = 0;
	p->packet_count = 0;
}

static void generate_packet(
	struct progress *p, const struct pen_pass *pass, const struct task *task, uint32_t sample)
{
	const uint32_t packet = p->packet_count++;
	const uint32_t block = task->first & ~15u;
	struct pen_paths *to = &p->wavefront->now.packets[packet];

	if (task->is_grid)
		pen_generate_grid(pass, task->x, task->y, sample, to);
	else
		pen_generate_block(pass, task->x, task->y, block, to);
	for (uint32_t i = 0; i < PEN_LANES; i++) {
		const bool is_wanted =
			task->is_grid ? is_asked_for(p->unit, task->x + i % 4, task->y + i / 4)
				      : block + i >= task->first && block + i < task->end;

		to->slot[i] = is_wanted ? packet * PEN_LANES + i : dropped_slot(p->wavefront);
	}
}

static void add_to_batch(struct progress *p, struct task task)
{
	const struct pen_pass pass = {
		.scene = p->wavefront->scene,
		.sampler = &p->wavefront->sampler,
		.at_centre = p->unit->at_centre != 0,
	};
	const uint32_t packets = task.is_grid ? task.end - task.first : 1;

	if (p->packet_count + packets > p->wavefront->packets_max)
		finish_batch(p);
	task.packet = p->packet_count;
	p->tasks[p->task_count++] = task;
	for (uint32_t i = 0; i < packets; i++)
		generate_packet(p, &pass, &task, task.first + i);
}

static bool is_worth_a_task(const struct pen_unit *unit, uint32_t x, uint32_t y, uint32_t step)
{
	for (uint32_t i = 0; i < step * step; i++)
		if (is_asked_for(unit, x + i % step, y + i / step))
			return true;
	return false;
}

/* All pixels' share of one block of samples. */
static void render_block(struct progress *p, uint32_t first, uint32_t end)
{
	const struct pen_rect rect = p->unit->rect;
	const bool is_grid = end - first < BLOCK_SAMPLES_MIN;
	const uint32_t step = is_grid ? 4 : 1;

	for (uint32_t y = rect.y0 & ~(step - 1); y < rect.y1; y += step)
		for (uint32_t x = rect.x0 & ~(step - 1); x < rect.x1; x += step) {
			if (p->unit->mask && !is_worth_a_task(p->unit, x, y, step))
				continue;
			add_to_batch(p, (struct task){
						.x = x,
						.y = y,
						.first = first,
						.end = end,
						.is_grid = is_grid,
					});
		}
}

static void prepare_sampler(struct pen_wavefront *wavefront, uint32_t frame)
{
	if (wavefront->frame == frame)
		return;
	pen_sampler_init(&wavefront->sampler, &wavefront->scene->desc->sampling, frame);
	wavefront->frame = frame;
}

void pen_wavefront_unit(struct pen_wavefront *wavefront, const struct pen_unit *unit,
	float *ret_pixels, struct pen_render_stats *ret_stats, _Atomic uint64_t *progress)
{
	struct progress p = {
		.wavefront = wavefront,
		.unit = unit,
		.pixels = ret_pixels,
		.finished = progress,
	};
	uint32_t first = unit->sample_first;

	assert(pen_rect_valid(unit->rect) && first < unit->sample_end);
	prepare_sampler(wavefront, unit->frame);
	memset(ret_pixels, 0,
		pen_rect_area(unit->rect) * wavefront->film.channels * sizeof *ret_pixels);
	while (first < unit->sample_end) {
		const uint32_t block_end = (first & ~15u) + BLOCK_SAMPLES;
		const uint32_t end = block_end < unit->sample_end ? block_end : unit->sample_end;

		render_block(&p, first, end);
		first = end;
	}
	finish_batch(&p);
	if (ret_stats)
		*ret_stats = p.stats;
}
