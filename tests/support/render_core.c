/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/clock.h"
#include "core/base/tile.h"
#include "core/render/pictures.h"
#include "core/render/render.h"
#include "core/scene/parse.h"
#include "core/scene/planes.h"
#include "tests/support/load.h"

#include <getopt.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

/*
 * The renderer without a farm: units of a scene, in any order, by any number of forked processes,
 * merged as the coordinator merges them. Writes "x0 y0 x1 y1\n" and then the film's floats a
 * pixel, in the machine's byte order.
 */
static const char usage[] =
	"usage: render-core SCENE.json OUT.f32 [--isa v2|v3|v4] [--tile PX] [--rect X0,Y0,X1,Y1]\n"
	"       [--samples N] [--processes N] [--shuffle SEED] [--frame N] [--time]\n"
	"       [--assets DIRECTORY]\n"
	"--shuffle renders the units in another order; --time prints samples per second;\n"
	"DIRECTORY holds assets as files named by their SHA-256\n";

struct options {
	const char *scene_path, *out_path, *assets_path;
	enum pen_isa isa;
	uint32_t tile_px, samples, processes, shuffle, frame;
	struct pen_rect rect;
	bool has_rect, has_time;
};

/* A unit and where its pixels go among all results. */
struct item {
	struct pen_unit unit;
	size_t offset; /* floats */
};

struct plan {
	struct item *items; /* tile by tile, the rounds of each in order */
	uint32_t *order;
	uint32_t count;
	size_t floats;
	uint32_t channels;
};

static uint32_t number(const char *text)
{
	char *end;
	const unsigned long value = strtoul(text, &end, 10);

	if (*text == '\0' || *end != '\0' || value > UINT32_MAX)
		load_fail(usage);
	return (uint32_t)value;
}

static void set_option(struct options *options, int option)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_rect *rect = &options->rect;

	switch (option) {
	case 'i':
		if (pen_isa_parse(optarg, &options->isa, &err) < 0)
			load_fail(err.text);
		break;
	case 't': options->tile_px = number(optarg); break;
	case 's': options->samples = number(optarg); break;
	case 'p': options->processes = number(optarg); break;
	case 'o': options->shuffle = number(optarg); break;
	case 'f': options->frame = number(optarg); break;
	case 'r':
		options->has_rect = true;
		if (sscanf(optarg, "%u,%u,%u,%u", &rect->x0, &rect->y0, &rect->x1, &rect->y1) != 4)
			load_fail(usage);
		break;
	case 'c': options->has_time = true; break;
	case 'a': options->assets_path = optarg; break;
	default: load_fail(usage);
	}
}

static void read_options(int argc, char **argv, struct options *ret_options)
{
	static const struct option names[] = {
		{"isa", required_argument, NULL, 'i'},
		{"tile", required_argument, NULL, 't'},
		{"rect", required_argument, NULL, 'r'},
		{"samples", required_argument, NULL, 's'},
		{"processes", required_argument, NULL, 'p'},
		{"shuffle", required_argument, NULL, 'o'},
		{"frame", required_argument, NULL, 'f'},
		{"time", no_argument, NULL, 'c'},
		{"assets", required_argument, NULL, 'a'},
		{NULL, 0, NULL, 0},
	};
	int option;

	*ret_options =
		(struct options){.isa = pen_isa_best(), .tile_px = 64, .processes = 1, .frame = 1};
	while ((option = getopt_long(argc, argv, "", names, NULL)) != -1)
		set_option(ret_options, option);
	if (optind + 2 != argc || ret_options->processes == 0)
		load_fail(usage);
	ret_options->scene_path = argv[optind];
	ret_options->out_path = argv[optind + 1];
}

static void shuffle(uint32_t *order, uint32_t count, uint32_t seed)
{
	for (uint32_t i = 0; i < count; i++)
		order[i] = i;
	for (uint32_t i = count; i > 1 && seed != 0; i--) {
		seed = seed * 1664525u + 1013904223u;

		const uint32_t other = (seed >> 8) % i;
		const uint32_t swapped = order[i - 1];

		order[i - 1] = order[other];
		order[other] = swapped;
	}
}

static struct plan make_plan(const struct pen_tiling *tiling, uint32_t channels,
	const struct pen_rounds *all, const struct options *options)
{
	const uint32_t rounds = pen_round_count(all);
	struct plan plan = {.count = tiling->count * rounds, .channels = channels};

	plan.items = load_allocate(plan.count, sizeof *plan.items);
	plan.order = load_allocate(plan.count, sizeof *plan.order);
	for (uint32_t i = 0; i < plan.count; i++) {
		const struct pen_round round = pen_round_get(all, i % rounds);
		const struct pen_rect rect = pen_tiling_rect(tiling, i / rounds);

		plan.items[i] = (struct item){
			.unit = {.rect = rect,
				.frame = options->frame,
				.sample_first = round.first,
				.sample_end = round.end},
			.offset = plan.floats,
		};
		plan.floats += plan.channels * pen_rect_area(rect);
	}
	shuffle(plan.order, plan.count, options->shuffle);
	return plan;
}

/* One process's share: the next unit, until none is left. */
static void render_share(const struct pen_render_scene *scene, const struct plan *plan,
	_Atomic uint32_t *next, float *results, struct pen_render_stats *ret_total)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_renderer *renderer;
	uint32_t i;

	if (pen_renderer_create(scene, &renderer, &err) < 0)
		load_fail(err.text);
	while ((i = atomic_fetch_add(next, 1)) < plan->count) {
		const struct item *item = &plan->items[plan->order[i]];
		struct pen_render_stats stats;

		pen_renderer_unit(renderer, &item->unit, results + item->offset, &stats, NULL);
		ret_total->rays += stats.rays;
		ret_total->samples += stats.samples;
		ret_total->rays_dropped += stats.rays_dropped;
		ret_total->samples_black += stats.samples_black;
	}
	pen_renderer_destroy(renderer);
}

static void *shared_memory(size_t size)
{
	void *memory = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);

	if (memory == MAP_FAILED)
		load_fail("out of memory");
	return memory;
}

static void render(const struct pen_render_scene *scene, const struct plan *plan,
	uint32_t processes, float *results, struct pen_render_stats *totals)
{
	_Atomic uint32_t *next = shared_memory(sizeof *next);

	for (uint32_t i = 0; i < processes; i++) {
		const pid_t pid = fork();

		if (pid < 0)
			load_fail("cannot fork");
		if (pid == 0) {
			render_share(scene, plan, next, results, &totals[i]);
			_exit(0);
		}
	}
	for (uint32_t i = 0; i < processes; i++) {
		int status;

		if (wait(&status) < 0 || status != 0)
			load_fail("a render process failed");
	}
}

static void merge(const struct plan *plan, struct pen_rect crop, const float *results, float *image)
{
	for (uint32_t i = 0; i < plan->count; i++) {
		const struct pen_rect rect = plan->items[i].unit.rect;
		const float *from = results + plan->items[i].offset;
		const size_t row = plan->channels * pen_rect_width(rect);

		for (uint32_t y = rect.y0; y < rect.y1; y++, from += row) {
			float *to = image +
				    plan->channels * ((size_t)(y - crop.y0) * pen_rect_width(crop) +
							     rect.x0 - crop.x0);

			for (size_t k = 0; k < row; k++)
				to[k] += from[k];
		}
	}
}

static void write_image(
	const char *path, struct pen_rect crop, uint32_t channels, const float *image)
{
	const size_t count = channels * pen_rect_area(crop);
	FILE *file = fopen(path, "wb");

	if (!file || fprintf(file, "%u %u %u %u\n", crop.x0, crop.y0, crop.x1, crop.y1) < 0 ||
		fwrite(image, sizeof *image, count, file) != count || fclose(file) != 0)
		load_fail("cannot write the image");
}

static void print_speed(
	const struct pen_render_stats *totals, uint32_t processes, int64_t duration_us)
{
	const double us = (double)duration_us * processes;
	struct pen_render_stats sum = {0};

	for (uint32_t i = 0; i < processes; i++) {
		sum.rays += totals[i].rays;
		sum.samples += totals[i].samples;
		sum.rays_dropped += totals[i].rays_dropped;
		sum.samples_black += totals[i].samples_black;
	}
	(void)printf("%.3f s, %.3f Msamples/s and %.3f Mrays/s a process, "
		     "%llu rays dropped, %llu samples black\n",
		(double)duration_us * 1e-6, (double)sum.samples / us, (double)sum.rays / us,
		(unsigned long long)sum.rays_dropped, (unsigned long long)sum.samples_black);
}

int main(int argc, char **argv)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_pictures *pictures = NULL;
	struct pen_render_stats *totals;
	struct pen_render_scene *ready;
	struct options options;
	struct pen_scene *scene;
	struct pen_tiling tiling;
	struct pen_rounds rounds;
	struct plan plan;
	float *results, *image;
	int64_t start_us;

	read_options(argc, argv, &options);
	scene = load_scene(options.scene_path);
	if (options.samples != 0)
		scene->sampling.samples = options.samples;
	if (options.has_rect)
		scene->image.crop = options.rect;
	pictures = load_assets(scene, options.assets_path);
	if (pen_render_scene_create(scene, pictures, options.frame, options.isa, &ready, &err) < 0)
		load_fail(err.text);
	pen_tiling_init(&tiling, scene->image.crop, options.tile_px);
	rounds = pen_rounds_of(PEN_ROUNDS_UNIFORM, scene->sampling.samples, 0);
	plan = make_plan(&tiling, pen_scene_film(scene).channels, &rounds, &options);
	results = shared_memory((plan.floats + 1) * sizeof *results);
	totals = shared_memory(options.processes * sizeof *totals);
	image = load_allocate(plan.channels * pen_rect_area(tiling.crop), sizeof *image);
	start_us = pen_clock_us();
	render(ready, &plan, options.processes, results, totals);
	if (options.has_time)
		print_speed(totals, options.processes, pen_clock_us() - start_us);
	merge(&plan, tiling.crop, results, image);
	write_image(options.out_path, tiling.crop, plan.channels, image);
	pen_render_scene_destroy(ready);
	pen_pictures_destroy(pictures);
	pen_scene_destroy(scene);
	free(image);
	free(plan.order);
	free(plan.items);
	return 0;
}
