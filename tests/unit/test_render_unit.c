/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "core/base/mask.h"
#include "core/base/tile.h"
#include "core/render/render.h"
#include "core/scene/parse.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Everything whose result could depend on companions: ties, motion, instances, every material. */
static const char everything[] =
	"{\"version\": 1, \"image\": {\"width\": 61, \"height\": 45},"
	"\"camera\": {\"position\": [0, 2, 9], \"look_at\": [0, 1, 0], \"horizontal_fov\": 45,"
	"  \"aperture_radius\": 0.1, \"focus_distance\": 9, \"shutter\": {\"open\": 0, \"close\": "
	"1}},"
	"\"background\": {\"color\": [0.3, 0.4, 0.5]}, \"sampling\": {\"samples\": 40},"
	"\"integrator\": {\"type\": \"%s\", \"max_depth\": 5},"
	"\"materials\": {\"m\": {\"type\": \"matte\", \"color\": [0.6, 0.5, 0.4]},"
	"  \"g\": {\"type\": \"glossy\", \"color\": [0.8, 0.8, 0.8], \"roughness\": 0.3},"
	"  \"c\": {\"type\": \"glass\", \"color\": [1, 1, 1], \"ior\": 1.5, \"roughness\": 0},"
	"  \"f\": {\"type\": \"glass\", \"color\": [1, 1, 1], \"ior\": 1.5, \"roughness\": 0.3}},"
	"\"objects\": ["
	"  {\"type\": \"mesh\", \"material\": \"m\", \"indices\": [0, 1, 2, 0, 2, 3],"
	"   \"vertices\": [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]},"
	"  {\"type\": \"mesh\", \"material\": \"g\", \"indices\": [0, 1, 2, 0, 2, 3],"
	"   \"vertices\": [[-4, 0, 4], [4, 0, 4], [4, 0, -4], [-4, 0, -4]]},"
	"  {\"type\": \"sphere\", \"material\": \"c\", \"center\": [0, 0, 0], \"radius\": 1,"
	"   \"keyframes\": [{\"time\": 0, \"translate\": [-2, 1, 0]},"
	"                 {\"time\": 1, \"translate\": [-1.5, 1.4, 0]}]},"
	"  {\"type\": \"sphere\", \"material\": \"g\", \"center\": [0, 0, 0], \"radius\": 0.7,"
	"   \"transform\": {\"translate\": [1.8, 1, 0], \"scale\": [1, 1.5, 0.6]}},"
	"  {\"type\": \"mesh\", \"material\": \"f\", \"name\": \"bar\", \"indices\": [0, 1, 2, 0, "
	"2, 3],"
	"   \"vertices\": [[-1.6, -0.2, 0], [1.6, -0.2, 0], [1.6, 0.2, 0], [-1.6, 0.2, 0]],"
	"   \"keyframes\": [{\"time\": 0, \"translate\": [0, 2, 1], \"rotate\": [0, 0, 0, 1]},"
	"     {\"time\": 1, \"translate\": [0, 2, 1], \"rotate\": [0, 0, 0.5, 0.8660254]}]},"
	"  {\"type\": \"instance\", \"of\": \"bar\", \"material\": \"m\","
	"   \"transform\": {\"translate\": [0, 2.5, -2], \"scale\": [1, 2, 1]}},"
	"  {\"type\": \"mesh\", \"material\": \"m\", \"indices\": [0, 1, 2],"
	"   \"vertices_at\": [{\"time\": 0, \"vertices\": [[2, 0, 2], [3, 0, 2], [2.5, 1, 2]]},"
	"     {\"time\": 1, \"vertices\": [[2, 0, 2], [3, 0, 2], [2.9, 1.3, 2]]}]}],"
	"\"lights\": ["
	"  {\"type\": \"rectangle\", \"corner\": [-3, 5, -1], \"edge_u\": [2, 0, 0],"
	"   \"edge_v\": [0, 0, 2], \"radiance\": [9, 9, 9]},"
	"  {\"type\": \"sphere\", \"center\": [3, 3, 2], \"radius\": 0.4, \"radiance\": [8, 7, 5]},"
	"  {\"type\": \"disk\", \"center\": [0, 4, 2], \"normal\": [0, -1, 0], \"radius\": 0.5,"
	"   \"radiance\": [4, 5, 6]},"
	"  {\"type\": \"disk\", \"center\": [-4, 1, 0], \"normal\": [1, 0, 0], \"radius\": 0.5,"
	"   \"radiance\": [6, 5, 4]},"
	"  {\"type\": \"point\", \"position\": [-3, 2, 3], \"intensity\": [2, 2, 2]}]}";

/* A white body alone in a white world; the sphere fills the image. */
static const char furnace[] =
	"{\"version\": 1, \"image\": {\"width\": 16, \"height\": 16},"
	"\"camera\": {\"position\": [0, 0, 3], \"look_at\": [0, 0, 0], \"horizontal_fov\": 20},"
	"\"background\": {\"color\": [1, 1, 1]}, \"sampling\": {\"samples\": 16},"
	"\"integrator\": {\"type\": \"%s\", \"max_depth\": 8},"
	"\"materials\": {\"m\": {\"type\": \"%s\", \"color\": [1, 1, 1]%s}},"
	"\"objects\": [{\"type\": \"sphere\", \"material\": \"m\", \"center\": [0, 0, 0],"
	"  \"radius\": 1}]}";

struct made {
	struct pen_scene *scene;
	struct pen_render_scene *ready;
	struct pen_renderer *renderer;
};

static struct pen_scene *parse(const char *text)
{
	static struct pen_scene_errors errors;
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_scene *scene = NULL;
	json_t *tree = NULL;

	assert_int_equal(pen_json_parse(text, strlen(text), &tree, &err), 0);
	if (pen_scene_parse(tree, &scene, &errors, &err) < 0)
		fail_msg("%s %s", errors.items[0].pointer, errors.items[0].detail);
	json_decref(tree);
	return scene;
}

static struct made make(const char *text, enum pen_isa isa)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct made made = {.scene = parse(text)};

	if (pen_render_scene_create(made.scene, NULL, 1, isa, &made.ready, &err) < 0)
		fail_msg("%s", err.text);
	assert_int_equal(pen_renderer_create(made.ready, &made.renderer, &err), 0);
	return made;
}

static void unmake(struct made *made)
{
	pen_renderer_destroy(made->renderer);
	pen_render_scene_destroy(made->ready);
	pen_scene_destroy(made->scene);
}

static void add_tile(float *image, struct pen_rect crop, struct pen_rect rect, const float *tile)
{
	for (uint32_t y = rect.y0; y < rect.y1; y++)
		for (uint32_t x = rect.x0; x < rect.x1; x++)
			for (uint32_t c = 0; c < PEN_CHANNELS_MIN; c++)
				image[PEN_CHANNELS_MIN * ((y - crop.y0) * pen_rect_width(crop) +
								 (x - crop.x0)) +
					c] += *tile++;
}

/* Every round in turn, its tiles from first to last or from last to first. */
static float *render(const struct made *made, struct pen_rect crop, uint32_t tile_px, bool reverse)
{
	const struct pen_rounds rounds =
		pen_rounds_of(PEN_ROUNDS_UNIFORM, made->scene->sampling.samples, 0);
	float *image = calloc(PEN_CHANNELS_MIN * pen_rect_area(crop), sizeof *image);
	float *tile = calloc(PEN_CHANNELS_MIN * (size_t)tile_px * tile_px, sizeof *tile);
	struct pen_tiling tiling;

	assert_non_null(image);
	assert_non_null(tile);
	pen_tiling_init(&tiling, crop, tile_px);
	for (uint32_t r = 0; r < pen_round_count(&rounds); r++)
		for (uint32_t i = 0; i < tiling.count; i++) {
			const struct pen_round round = pen_round_get(&rounds, r);
			const struct pen_unit unit = {
				.rect = pen_tiling_rect(
					&tiling, reverse ? tiling.count - 1 - i : i),
				.frame = 1,
				.sample_first = round.first,
				.sample_end = round.end,
			};

			pen_renderer_unit(made->renderer, &unit, tile, NULL, NULL);
			add_tile(image, crop, unit.rect, tile);
		}
	free(tile);
	return image;
}

static void check_purity(enum pen_isa isa, const char *integrator)
{
	char text[sizeof everything + 32];
	const struct pen_rect whole = {0, 0, 61, 45}, part = {13, 7, 50, 38};
	struct made made;
	float *expected, *other, *cropped;

	(void)snprintf(text, sizeof text, everything, integrator);
	made = make(text, isa);
	expected = render(&made, whole, 16, false);
	for (uint32_t tile_px = 48; tile_px <= 64; tile_px += 16) {
		other = render(&made, whole, tile_px, true);
		assert_memory_equal(
			expected, other, PEN_CHANNELS_MIN * pen_rect_area(whole) * sizeof *other);
		free(other);
	}
	cropped = render(&made, part, 32, false);
	for (uint32_t y = part.y0; y < part.y1; y++)
		assert_memory_equal(expected + PEN_CHANNELS_MIN * (y * 61 + part.x0),
			cropped + PEN_CHANNELS_MIN * (y - part.y0) * pen_rect_width(part),
			PEN_CHANNELS_MIN * pen_rect_width(part) * sizeof *cropped);
	free(cropped);
	free(expected);
	unmake(&made);
}

/*
 * Breaks when any result depends on batch, tile, order or companions: a packet that is coherent
 * without being canonical, a sum in another order, state carried from unit to unit.
 */
static void test_pixels_are_a_pure_function(void **state)
{
	static const char *const integrators[] = {"distribution", "path", "whitted"};

	(void)state;
	for (enum pen_isa isa = PEN_ISA_V2; isa < PEN_ISA_COUNT; isa++)
		for (size_t i = 0; i < 3 && pen_isa_supported(isa); i++)
			check_purity(isa, integrators[i]);
}

/* A pixel's values depend on the mask in no other way than that it is on it. */
static void check_mask(const struct made *made, uint32_t first, uint32_t end)
{
	const struct pen_unit all = {
		.rect = {13, 9, 50, 40}, .frame = 1, .sample_first = first, .sample_end = end};
	const size_t area = pen_rect_area(all.rect), channels = PEN_CHANNELS_MIN;
	float *expected = calloc(area * channels, sizeof *expected);
	float *pixels = calloc(area * channels, sizeof *pixels);
	uint8_t *mask = calloc(1, pen_mask_bytes(all.rect));
	struct pen_render_stats stats;
	struct pen_unit some = all;

	some.mask = mask;
	for (size_t i = 0; i < area; i++)
		if (i * i % 7 == 2)
			pen_mask_add(mask, i);
	pen_renderer_unit(made->renderer, &all, expected, NULL, NULL);
	pen_renderer_unit(made->renderer, &some, pixels, &stats, NULL);
	assert_int_equal(stats.samples, pen_mask_count(mask, all.rect) * (end - first));
	for (size_t i = 0; i < area; i++) {
		if (!pen_mask_has(mask, i))
			memset(expected + i * channels, 0, channels * sizeof *expected);
		assert_memory_equal(
			expected + i * channels, pixels + i * channels, channels * sizeof *pixels);
	}
	free(mask);
	free(pixels);
	free(expected);
}

/* Breaks when a masked pixel is rendered in another packet than without the mask, or left out. */
static void test_mask(void **state)
{
	char text[sizeof everything + 32];

	(void)state;
	(void)snprintf(text, sizeof text, everything, "path");
	for (enum pen_isa isa = PEN_ISA_V2; isa < PEN_ISA_COUNT; isa++) {
		struct made made;

		if (!pen_isa_supported(isa))
			continue;
		made = make(text, isa);
		check_mask(&made, 0, 1);
		check_mask(&made, 16, 32);
		check_mask(&made, 32, 40);
		unmake(&made);
	}
}

/* The mean of all channels of a 16x16 image. */
static double furnace_mean(const char *integrator, const char *material, const char *more)
{
	char text[sizeof furnace + 64];
	double sum = 0.0;
	struct made made;
	float *image;

	(void)snprintf(text, sizeof text, furnace, integrator, material, more);
	made = make(text, pen_isa_best());
	image = render(&made, (struct pen_rect){0, 0, 16, 16}, 16, false);
	for (size_t i = 0; i < 16 * 16 * PEN_CHANNELS_MIN; i++)
		sum += i % PEN_CHANNELS_MIN == 3 ? 0.0 : (double)image[i];
	free(image);
	unmake(&made);
	return sum / (16.0 * 16.0 * 3.0 * 16.0);
}

/* Breaks when energy is made or lost: self-shadowing, a wrong weight, a ray lost inside glass. */
static void test_white_furnaces(void **state)
{
	const double expected[] = {
		furnace_mean("distribution", "matte", ""),
		furnace_mean("path", "matte", ""),
		furnace_mean("distribution", "glossy", ", \"roughness\": 0"),
		furnace_mean("distribution", "glass", ", \"ior\": 1.5, \"roughness\": 0"),
		furnace_mean("whitted", "glass", ", \"ior\": 1.5, \"roughness\": 0"),
	};

	(void)state;
	for (size_t i = 0; i < sizeof expected / sizeof *expected; i++)
		if (expected[i] < 0.998 || expected[i] > 1.002)
			fail_msg("furnace %zu gives %f", i, expected[i]);
}

/* Breaks when counts are of rays or of traced lanes, or when progress is not raised to the end. */
static void test_counts_and_progress(void **state)
{
	char text[sizeof everything + 32];
	const struct pen_unit unit = {
		.rect = {16, 16, 29, 25}, .frame = 1, .sample_first = 1, .sample_end = 16};
	float pixels[13 * 9 * PEN_CHANNELS_MIN];
	struct pen_render_stats stats;
	_Atomic uint64_t progress = 0;
	struct made made;

	(void)state;
	(void)snprintf(text, sizeof text, everything, "distribution");
	made = make(text, pen_isa_best());
	pen_renderer_unit(made.renderer, &unit, pixels, &stats, &progress);
	assert_int_equal(stats.samples, 13 * 9 * 15);
	assert_int_equal(atomic_load(&progress), 13 * 9 * 15);
	assert_int_equal(stats.rays_dropped, 0);
	assert_int_equal(stats.samples_black, 0);
	assert_true(stats.rays > stats.samples);
	for (size_t i = 3; i < sizeof pixels / sizeof *pixels; i += PEN_CHANNELS_MIN)
		assert_true(pixels[i] == 15.0f);
	unmake(&made);
}

/* Breaks when a flattened instance reaches Embree, which aborts the process at it. */
static void test_singular_transform_is_refused_by_name(void **state)
{
	struct pen_scene *scene = NULL;
	struct pen_render_scene *ready = NULL;
	struct pen_error err = PEN_ERROR_INIT;
	char text[sizeof everything + 32];

	(void)state;
	(void)snprintf(text, sizeof text, everything, "path");
	scene = parse(text);
	scene->objects[4].keys[1].pose.scale[2] = 0.0;
	assert_int_equal(pen_render_scene_create(scene, NULL, 1, pen_isa_best(), &ready, &err),
		PEN_EINVALID);
	assert_non_null(strstr(err.text, "bar"));
	assert_null(ready);
	/* A scale that changes its sign is flat somewhere between the keys. */
	scene->objects[4].keys[1].pose.scale[2] = -1.0;
	assert_int_equal(pen_render_scene_create(scene, NULL, 1, pen_isa_best(), &ready, &err),
		PEN_EINVALID);
	pen_scene_destroy(scene);
}

/* Breaks when an empty Embree scene fails to build, or the background is not the background. */
static void test_empty_scene_is_background(void **state)
{
	struct made made = make("{\"version\": 1, \"image\": {\"width\": 5, \"height\": 3},"
				"\"sampling\": {\"samples\": 2},"
				"\"background\": {\"color\": [0.25, 0.5, 1]}}",
		PEN_ISA_V2);
	float *image = render(&made, (struct pen_rect){0, 0, 5, 3}, 16, false);

	(void)state;
	for (size_t i = 0; i < 15; i++) {
		assert_true(image[PEN_CHANNELS_MIN * i] == 0.5f);
		assert_true(image[PEN_CHANNELS_MIN * i + 2] == 2.0f);
	}
	free(image);
	unmake(&made);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_pixels_are_a_pure_function),
		cmocka_unit_test(test_mask),
		cmocka_unit_test(test_white_furnaces),
		cmocka_unit_test(test_counts_and_progress),
		cmocka_unit_test(test_singular_transform_is_refused_by_name),
		cmocka_unit_test(test_empty_scene_is_background),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
