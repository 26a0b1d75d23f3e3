/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/tile.h"
#include "core/render/render.h"
#include "core/render/trace.h"
#include "core/scene/parse.h"
#include "core/scene/planes.h"
#include "tests/support/load.h"

#include <embree3/rtcore.h>

#include <getopt.h>
#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/*
 * How far the renderer is from the bare traversal of its rays: records the packets of a render, and
 * replays them in the same order through rtcIntersect16 and rtcOccluded16 on a scene that has
 * everything in Embree's trees. Of the processor time of a whole render (sampling, camera, shading,
 * tracing, sums), of the bare calls and of the renderer's own tracing alone, which tests a handful
 * of large primitives without Embree, the medians of alternating runs are printed:
 *
 *     samples rays packets renderer_s bare_s own_s renderer/bare least greatest
 *
 * With --copies the recorded calls are instead replayed bare by pinned processes, as often as
 * asked: each line "COPIES FIRST_CORE SECONDS" that is read is answered by the calls a second of
 * all.
 *
 * The linker sends the renderer's calls of these functions through the wrappers below.
 */
static const char usage[] = "usage: limit SCENE.json [--assets DIRECTORY] [--samples N]\n"
			    "             [--scale DIVISOR] [--runs N | --copies]\n";

enum { RUNS_MAX = 99, TILE_PX = 64 };

/* One call: sixteen rays before they are traced. */
struct call {
	struct pen_rays rays;
	_Alignas(64) int32_t valid[PEN_LANES];
	bool is_shadow, coherent;
};

static struct {
	struct call *calls;
	size_t count, capacity;
	bool is_on;
	const struct pen_trace *trace;
} record;

static struct {
	bool skips_handful;
	RTCScene committed; /* the last one: what is placed in it comes before */
} build;

void __wrap_rtcCommitScene(RTCScene scene);
void __real_rtcCommitScene(RTCScene scene);
bool __wrap_pen_handful_take(
	struct pen_handful *handful, const struct pen_geometry *geometry, uint32_t shape);
bool __real_pen_handful_take(
	struct pen_handful *handful, const struct pen_geometry *geometry, uint32_t shape);
uint32_t __wrap_pen_trace_closest(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_packet *packet);
uint32_t __real_pen_trace_closest(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_packet *packet);
uint32_t __wrap_pen_trace_occluded(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_rays *rays);
uint32_t __real_pen_trace_occluded(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_rays *rays);

void __wrap_rtcCommitScene(RTCScene scene)
{
	__real_rtcCommitScene(scene);
	build.committed = scene;
}

bool __wrap_pen_handful_take(
	struct pen_handful *handful, const struct pen_geometry *geometry, uint32_t shape)
{
	return !build.skips_handful && __real_pen_handful_take(handful, geometry, shape);
}

static void park(struct pen_rays *rays, int lane)
{
	rays->origin_x[lane] = rays->origin_y[lane] = rays->origin_z[lane] = 0.0f;
	rays->direction_x[lane] = rays->direction_y[lane] = 0.0f;
	rays->direction_z[lane] = 1.0f;
	rays->tnear[lane] = 1.0f;
	rays->tfar[lane] = 0.0f;
}

static void note(
	const struct pen_trace *trace, const struct pen_rays *rays, bool is_shadow, bool coherent)
{
	struct call *call;

	if (record.count == record.capacity) {
		struct call *grown;

		record.capacity = 2 * record.capacity + 65536;
		grown = aligned_alloc(64, record.capacity * sizeof *grown);
		if (!grown)
			load_fail("out of memory");
		if (record.count > 0)
			memcpy(grown, record.calls, record.count * sizeof *grown);
		free(record.calls);
		record.calls = grown;
	}
	record.trace = trace;
	call = &record.calls[record.count++];
	*call = (struct call){.rays = *rays, .is_shadow = is_shadow, .coherent = coherent};
	for (int i = 0; i < PEN_LANES; i++) {
		call->valid[i] = rays->tnear[i] <= rays->tfar[i] ? -1 : 0;
		call->rays.mask[i] = UINT32_MAX;
		call->rays.id[i] = call->rays.flags[i] = 0;
		if (!call->valid[i])
			park(&call->rays, i);
	}
}

uint32_t __wrap_pen_trace_closest(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_packet *packet)
{
	if (record.is_on)
		note(trace, &packet->rays, false, coherent);
	return __real_pen_trace_closest(trace, coherent, sieve, packet);
}

uint32_t __wrap_pen_trace_occluded(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_rays *rays)
{
	if (record.is_on)
		note(trace, rays, true, coherent);
	return __real_pen_trace_occluded(trace, coherent, sieve, rays);
}

static double processor_seconds(void)
{
	struct timespec now;

	(void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
	return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* What reading the calls costs by itself, which is no traversal. */
static void read_calls(void)
{
	for (size_t i = 0; i < record.count; i++) {
		struct pen_rays rays = record.calls[i].rays;

		__asm__ volatile("" : : "r"(&rays) : "memory");
	}
}

static void trace_bare(RTCScene scene)
{
	for (size_t i = 0; i < record.count; i++) {
		const struct call *call = &record.calls[i];
		struct RTCIntersectContext context;
		struct pen_packet packet;

		rtcInitIntersectContext(&context);
		context.flags = call->coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
					       : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
		packet.rays = call->rays;
		memset(packet.hits.geometry, 0xff, sizeof packet.hits.geometry);
		memset(packet.hits.instance, 0xff, sizeof packet.hits.instance);
		if (call->is_shadow)
			rtcOccluded16(call->valid, scene, &context,
				(struct RTCRay16 *)(void *)&packet.rays);
		else
			rtcIntersect16(call->valid, scene, &context,
				(struct RTCRayHit16 *)(void *)&packet);
	}
}

static void trace_own(void)
{
	for (size_t i = 0; i < record.count; i++) {
		const struct call *call = &record.calls[i];
		struct pen_packet packet;

		packet.rays = call->rays;
		if (call->is_shadow)
			(void)__real_pen_trace_occluded(
				record.trace, call->coherent, NULL, &packet.rays);
		else
			(void)__real_pen_trace_closest(record.trace, call->coherent, NULL, &packet);
	}
}

struct bench {
	struct pen_scene *desc;
	struct pen_renderer *renderer;
	struct pen_tiling tiling;
	float *pixels; /* of a tile */
};

static struct pen_render_stats render(const struct bench *bench)
{
	struct pen_render_stats sum = {0};

	for (uint32_t i = 0; i < bench->tiling.count; i++) {
		const struct pen_unit unit = {
			.rect = pen_tiling_rect(&bench->tiling, i),
			.frame = 1,
			.sample_end = bench->desc->sampling.samples,
		};
		struct pen_render_stats stats;

		pen_renderer_unit(bench->renderer, &unit, bench->pixels, &stats, NULL);
		sum.rays += stats.rays;
		sum.samples += stats.samples;
		sum.rays_dropped += stats.rays_dropped;
	}
	return sum;
}

static int compare(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

static double median(double *values, int count)
{
	qsort(values, (size_t)count, sizeof *values, compare);
	return values[count / 2];
}

static void measure(const struct bench *bench, RTCScene bare, int runs)
{
	double whole[RUNS_MAX], bares[RUNS_MAX], own[RUNS_MAX], ratios[RUNS_MAX];
	struct pen_render_stats stats;

	record.is_on = true;
	stats = render(bench);
	record.is_on = false;
	if (stats.rays_dropped > 0)
		load_fail("the scene has rays that Embree must not see");
	for (int run = 0; run < runs; run++) {
		const double start = processor_seconds();
		(void)render(bench);
		const double rendered = processor_seconds();
		read_calls();
		const double read = processor_seconds();
		trace_bare(bare);
		const double traced = processor_seconds();
		trace_own();

		whole[run] = rendered - start;
		bares[run] = traced - read - (read - rendered);
		own[run] = processor_seconds() - traced - (read - rendered);
		ratios[run] = whole[run] / bares[run];
	}
	printf("%llu %llu %zu %.3f %.3f %.3f ", (unsigned long long)stats.samples,
		(unsigned long long)stats.rays, record.count, median(whole, runs),
		median(bares, runs), median(own, runs));
	qsort(ratios, (size_t)runs, sizeof *ratios, compare);
	printf("%.3f %.3f %.3f\n", ratios[runs / 2], ratios[0], ratios[runs - 1]);
}

static double wall_seconds(void)
{
	struct timespec now;

	(void)clock_gettime(CLOCK_MONOTONIC, &now);
	return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Calls a second of one copy, into a pipe. */
_Noreturn static void copy(RTCScene bare, int core, double seconds, int to)
{
	const double start = wall_seconds();
	double rate, spent;
	uint64_t calls = 0;
	cpu_set_t cores;

	CPU_ZERO(&cores);
	CPU_SET((unsigned)core, &cores);
	if (sched_setaffinity(0, sizeof cores, &cores) < 0)
		load_fail("cannot be pinned");
	do {
		trace_bare(bare);
		calls += record.count;
		spent = wall_seconds() - start;
	} while (spent < seconds);
	rate = (double)calls / spent;
	_exit(write(to, &rate, sizeof rate) != sizeof rate);
}

/* Calls a second of so many copies together. */
static double copies_rate(RTCScene bare, int copies, int first_core, double seconds)
{
	const int cores = (int)sysconf(_SC_NPROCESSORS_ONLN);
	double sum = 0.0, rate;
	int ends[2];

	if (pipe(ends) < 0)
		load_fail("no pipe");
	for (int i = 0; i < copies; i++) {
		const pid_t pid = fork();

		if (pid < 0)
			load_fail("cannot fork");
		if (pid == 0)
			copy(bare, (first_core + i) % cores, seconds, ends[1]);
	}
	(void)close(ends[1]);
	while (read(ends[0], &rate, sizeof rate) == sizeof rate)
		sum += rate;
	(void)close(ends[0]);
	for (int i = 0; i < copies; i++) {
		int status;

		if (wait(&status) < 0 || status != 0)
			load_fail("a copy failed");
	}
	return sum;
}

static void answer_copies(const struct bench *bench, RTCScene bare)
{
	int copies, first_core;
	double seconds;

	record.is_on = true;
	(void)render(bench);
	record.is_on = false;
	while (scanf("%d %d %lf", &copies, &first_core, &seconds) == 3) {
		(void)printf("%.1f\n", copies_rate(bare, copies, first_core, seconds));
		(void)fflush(stdout);
	}
}

static struct pen_render_scene *build_scene(
	const struct pen_scene *desc, const struct pen_pictures *pictures, bool skips_handful)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_render_scene *scene;

	build.skips_handful = skips_handful;
	if (pen_render_scene_create(desc, pictures, 1, pen_isa_best(), &scene, &err) < 0)
		load_fail(err.text);
	return scene;
}

/* runs: 0 for copies. */
static void run(struct pen_scene *desc, const struct pen_pictures *pictures, int runs)
{
	struct pen_render_scene *bare = build_scene(desc, pictures, true);
	RTCScene embree = build.committed;
	struct pen_render_scene *scene = build_scene(desc, pictures, false);
	struct pen_error err = PEN_ERROR_INIT;
	struct bench bench = {.desc = desc};

	pen_tiling_init(&bench.tiling, desc->image.crop, TILE_PX);
	bench.pixels = load_allocate(
		(size_t)TILE_PX * TILE_PX * pen_scene_film(desc).channels, sizeof(float));
	if (pen_renderer_create(scene, &bench.renderer, &err) < 0)
		load_fail(err.text);
	if (runs > 0)
		measure(&bench, embree, runs);
	else
		answer_copies(&bench, embree);
	pen_renderer_destroy(bench.renderer);
	free(bench.pixels);
	free(record.calls);
	pen_render_scene_destroy(scene);
	pen_render_scene_destroy(bare);
}

static uint32_t number(const char *text)
{
	const long value = strtol(text, NULL, 10);

	if (value < 1 || value > 1 << 20)
		load_fail(usage);
	return (uint32_t)value;
}

static void shrink(struct pen_scene *scene, uint32_t divisor)
{
	struct pen_rect *crop = &scene->image.crop;

	scene->image.width /= divisor;
	scene->image.height /= divisor;
	*crop = (struct pen_rect){0, 0, scene->image.width, scene->image.height};
}

int main(int argc, char **argv)
{
	static const struct option names[] = {
		{"assets", required_argument, NULL, 'a'},
		{"samples", required_argument, NULL, 's'},
		{"scale", required_argument, NULL, 'd'},
		{"runs", required_argument, NULL, 'r'},
		{"copies", no_argument, NULL, 'c'},
		{NULL, 0, NULL, 0},
	};
	uint32_t samples = 16, divisor = 1, runs = 5;
	const char *assets = NULL;
	struct pen_pictures *pictures;
	struct pen_scene *scene;
	int option;

	while ((option = getopt_long(argc, argv, "", names, NULL)) != -1)
		switch (option) {
		case 'a': assets = optarg; break;
		case 's': samples = number(optarg); break;
		case 'd': divisor = number(optarg); break;
		case 'r': runs = number(optarg); break;
		case 'c': runs = 0; break;
		default: load_fail(usage);
		}
	if (optind + 1 != argc || runs > RUNS_MAX)
		load_fail(usage);
	scene = load_scene(argv[optind]);
	scene->sampling.samples = samples;
	shrink(scene, divisor);
	pictures = load_assets(scene, assets);
	run(scene, pictures, (int)runs);
	pen_pictures_destroy(pictures);
	pen_scene_destroy(scene);
	return 0;
}
