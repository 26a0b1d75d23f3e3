/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/render.h"
#include "core/scene/parse.h"
#include "core/scene/planes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 24, HEIGHT = 16, EYE = 5 };

static const double TAN_HALF_FOV = 0.5; /* horizontal */

#define HEAD(aovs)                                                                                 \
	"{\"version\": 1, \"image\": {\"width\": 24, \"height\": 16, \"aovs\": [" aovs "]},"       \
	"\"sampling\": {\"samples\": 40}, \"integrator\": {\"type\": \"path\"},"                   \
	"\"camera\": {\"position\": [0, 0, 5], \"look_at\": [0, 0, 0],"                            \
	"  \"horizontal_fov\": 53.130102354155978},"

#define ALL "\"albedo\", \"normal\", \"depth\""

struct made {
	struct pen_scene *scene;
	struct pen_render_scene *ready;
	struct pen_renderer *renderer;
	struct pen_film film;
};

static struct made make(const char *text)
{
	static struct pen_scene_errors errors;
	struct pen_error err = PEN_ERROR_INIT;
	struct made made = {.scene = NULL};
	json_t *tree = NULL;

	assert_int_equal(pen_json_parse(text, strlen(text), &tree, &err), 0);
	if (pen_scene_parse(tree, &made.scene, &errors, &err) < 0)
		fail_msg("%s %s", errors.items[0].pointer, errors.items[0].detail);
	json_decref(tree);
	if (pen_render_scene_create(made.scene, NULL, 1, pen_isa_best(), &made.ready, &err) < 0)
		fail_msg("%s", err.text);
	assert_int_equal(pen_renderer_create(made.ready, &made.renderer, &err), 0);
	made.film = pen_scene_film(made.scene);
	return made;
}

static void unmake(struct made *made)
{
	pen_renderer_destroy(made->renderer);
	pen_render_scene_destroy(made->ready);
	pen_scene_destroy(made->scene);
}

/* One sample of each pixel, through its centre. */
static float *render_centres(const struct made *made)
{
	const struct pen_unit unit = {
		.rect = {0, 0, WIDTH, HEIGHT}, .frame = 1, .sample_end = 1, .at_centre = 1};
	float *pixels = calloc((size_t)WIDTH * HEIGHT * made->film.channels, sizeof *pixels);

	assert_non_null(pixels);
	pen_renderer_unit(made->renderer, &unit, pixels, NULL, NULL);
	return pixels;
}

/* The ray through a pixel's centre, as long as it is to the plane at distance 1 from the eye. */
static void direction_of(int x, int y, double ret[3])
{
	ret[0] = (2.0 * (x + 0.5) / WIDTH - 1.0) * TAN_HALF_FOV;
	ret[1] = (1.0 - 2.0 * (y + 0.5) / HEIGHT) * TAN_HALF_FOV * HEIGHT / WIDTH;
	ret[2] = -1.0;
}

static void check3(const float *found, double x, double y, double z)
{
	assert_float_equal(found[0], x, 2e-5);
	assert_float_equal(found[1], y, 2e-5);
	assert_float_equal(found[2], z, 2e-5);
}

/* Breaks when depth is measured along the ray, or a normal does not face the camera. */
static void test_plane(void **state)
{
	/* Wound so that its own normal looks away. */
	struct made made = make(HEAD(
		ALL) "\"materials\": {\"m\": {\"type\": \"matte\", \"color\": [0.25, 0.5, 0.75]}},"
		     "\"objects\": [{\"type\": \"mesh\", \"material\": \"m\", \"indices\": [0, 2, "
		     "1],"
		     "  \"vertices\": [[-50, -50, 1], [50, -50, 1], [0, 90, 1]]}]}");
	float *pixels = render_centres(&made);
	const float *pixel = pixels;

	(void)state;
	for (int i = 0; i < WIDTH * HEIGHT; i++, pixel += made.film.channels) {
		assert_float_equal(pixel[3], 1.0, 0.0);
		check3(pixel + made.film.albedo, 0.25, 0.5, 0.75);
		check3(pixel + made.film.normal, 0.0, 0.0, 1.0);
		assert_float_equal(pixel[made.film.depth], EYE - 1, 2e-5);
		assert_float_equal(pixel[made.film.depth + 1], 1.0, 0.0);
	}
	free(pixels);
	unmake(&made);
}

/* Breaks when a miss counts as a hit or leaves anything, or a sphere's normal is not its radius. */
static void test_sphere(void **state)
{
	struct made made = make(HEAD(
		ALL) "\"materials\": {\"m\": {\"type\": \"principled\", \"base_color\": [0.5, 0.6, "
		     "0.7],"
		     "  \"metallic\": 0.5, \"emission\": [3, 3, 3]}},"
		     "\"objects\": [{\"type\": \"sphere\", \"material\": \"m\", \"center\": [0, 0, "
		     "0],"
		     "  \"radius\": 1}], \"background\": {\"color\": [1, 1, 1]}}");
	float *pixels = render_centres(&made);
	int hits = 0;

	(void)state;
	for (int i = 0; i < WIDTH * HEIGHT; i++) {
		const float *pixel = pixels + (size_t)i * made.film.channels;
		double d[3], a, discriminant, t;

		direction_of(i % WIDTH, i / WIDTH, d);
		a = d[0] * d[0] + d[1] * d[1] + 1.0;
		discriminant = EYE * EYE - a * (EYE * EYE - 1.0);
		if (discriminant < 0.0) {
			for (uint32_t c = made.film.albedo; c < made.film.channels; c++)
				assert_float_equal(pixel[c], 0.0, 0.0);
			continue;
		}
		t = (EYE - sqrt(discriminant)) / a;
		hits++;
		check3(pixel + made.film.albedo, 0.5, 0.6, 0.7);
		check3(pixel + made.film.normal, t * d[0], t * d[1], EYE - t);
		assert_float_equal(pixel[made.film.depth], t, 2e-5);
		assert_float_equal(pixel[made.film.depth + 1], 1.0, 0.0);
	}
	assert_in_range(hits, 20, WIDTH * HEIGHT - 20);
	free(pixels);
	unmake(&made);
}

/* Breaks when a light that the camera sees is taken for background, or for a white surface. */
static void test_light_is_a_black_hit(void **state)
{
	struct made made =
		make(HEAD(ALL) "\"lights\": [{\"type\": \"rectangle\", \"corner\": [-50, -50, -1],"
			       "  \"edge_u\": [100, 0, 0], \"edge_v\": [0, 100, 0], \"radiance\": "
			       "[2, 2, 2]}]}");
	float *pixels = render_centres(&made);
	const float *pixel = pixels;

	(void)state;
	for (int i = 0; i < WIDTH * HEIGHT; i++, pixel += made.film.channels) {
		assert_float_equal(pixel[0], 2.0, 0.0);
		check3(pixel + made.film.albedo, 0.0, 0.0, 0.0);
		check3(pixel + made.film.normal, 0.0, 0.0, 1.0);
		assert_float_equal(pixel[made.film.depth], EYE + 1, 2e-5);
		assert_float_equal(pixel[made.film.depth + 1], 1.0, 0.0);
	}
	free(pixels);
	unmake(&made);
}

/* Breaks when colours or normals of vertices do not reach the planes. */
static void test_vertex_attributes(void **state)
{
	struct made made = make(
		HEAD(ALL) "\"materials\": {\"m\": {\"type\": \"matte\", \"color\": [1, 0.5, 1]}},"
			  "\"objects\": [{\"type\": \"mesh\", \"material\": \"m\", \"indices\": "
			  "[0, 1, 2],"
			  "  \"vertices\": [[-40, -20, 0], [40, -20, 0], [0, 60, 0]],"
			  "  \"normals\": [[0.6, 0, 0.8], [0.6, 0, 0.8], [0.6, 0, 0.8]]}]}");
	float *pixels = render_centres(&made);

	(void)state;
	for (int i = 0; i < WIDTH * HEIGHT; i++)
		check3(pixels + (size_t)i * made.film.channels + made.film.normal, 0.6, 0.0, 0.8);
	free(pixels);
	unmake(&made);
}

/* Breaks when depth is along the axis that the camera has as the shutter opens. */
static void test_depth_of_a_turning_camera(void **state)
{
	struct made made = make(
		"{\"version\": 1, \"image\": {\"width\": 24, \"height\": 16,"
		"  \"aovs\": [\"depth\"]}, \"sampling\": {\"samples\": 16},"
		"\"camera\": {\"horizontal_fov\": 30, \"shutter\": {\"open\": 0, \"close\": 1},"
		"  \"keyframes\": [{\"time\": 0, \"position\": [0, 0, 0], \"look_at\": [-1, 0, "
		"-2]},"
		"    {\"time\": 1, \"position\": [0, 0, 0], \"look_at\": [1, 0, -2]}]},"
		"\"materials\": {\"m\": {\"type\": \"matte\", \"color\": [1, 1, 1]}},"
		"\"objects\": [{\"type\": \"sphere\", \"material\": \"m\", \"center\": [0, 0, 0],"
		"  \"radius\": 3}]}");
	const struct pen_unit unit = {.rect = {12, 8, 13, 9}, .frame = 1, .sample_end = 16};
	float pixel[PEN_CHANNELS_MAX];

	(void)state;
	assert_int_equal(made.film.channels, PEN_CHANNELS_MIN + 2);
	pen_renderer_unit(made.renderer, &unit, pixel, NULL, NULL);
	assert_float_equal(pixel[made.film.depth + 1], 16.0, 0.0);
	/* The image's middle looks along the axis at all times, but for a pixel's width. */
	assert_float_equal(pixel[made.film.depth], 16 * 3, 0.2);
	unmake(&made);
}

/* Everything that moves, hides or lets through, so that samples of a pixel differ. */
static const char busy[] = HEAD(
	ALL) "\"materials\": {\"m\": {\"type\": \"principled\", \"base_color\": [0.8, 0.5, 0.2]},"
	     "  \"veil\": {\"type\": \"principled\", \"base_color\": [0.1, 0.2, 0.9], \"opacity\": "
	     "0.4,"
	     "    \"alpha_mode\": \"blend\"}},"
	     "\"objects\": [{\"type\": \"sphere\", \"material\": \"m\", \"center\": [0, 0, 0],"
	     "  \"radius\": 1, \"keyframes\": [{\"time\": 0, \"translate\": [-1, 0, 0]},"
	     "    {\"time\": 1, \"translate\": [1, 0, 0]}]},"
	     "  {\"type\": \"mesh\", \"material\": \"veil\", \"indices\": [0, 1, 2],"
	     "   \"vertices\": [[-2, -2, 2], [2, -2, 2.5], [0, 2, 1.5]]}],"
	     "\"lights\": [{\"type\": \"disk\", \"center\": [2, 1, 0], \"normal\": [0, 0, 1],"
	     "  \"radius\": 1, \"radiance\": [1, 1, 1]}]}";

static void add_unit(
	const struct made *made, struct pen_rect rect, uint32_t first, uint32_t end, float *image)
{
	const struct pen_unit unit = {
		.rect = rect, .frame = 1, .sample_first = first, .sample_end = end};
	const uint32_t channels = made->film.channels;
	float *tile = calloc(pen_rect_area(rect) * channels, sizeof *tile);
	const float *from = tile;

	assert_non_null(tile);
	pen_renderer_unit(made->renderer, &unit, tile, NULL, NULL);
	for (uint32_t y = rect.y0; y < rect.y1; y++)
		for (uint32_t c = 0; c < pen_rect_width(rect) * channels; c++)
			image[(y * WIDTH + rect.x0) * channels + c] += *from++;
	free(tile);
}

/*
 * Breaks when the planes' sums depend on how samples are dealt out to units of whole blocks, on
 * tiles, or on their order; or when the planes change the image.
 */
static void test_planes_are_a_pure_function(void **state)
{
	struct made made = make(busy), plain;
	const uint32_t channels = made.film.channels;
	const size_t size = (size_t)WIDTH * HEIGHT * channels * sizeof(float);
	float *expected = calloc(1, size), *other = calloc(1, size);
	char text[sizeof busy];
	float *image = calloc(1, (size_t)WIDTH * HEIGHT * PEN_CHANNELS_MIN * sizeof *image);

	(void)state;
	assert_true(expected && other && image);
	add_unit(&made, (struct pen_rect){0, 0, WIDTH, HEIGHT}, 0, 40, expected);
	for (uint32_t first = 0; first < 40; first += 16) {
		const uint32_t end = first + 16 < 40 ? first + 16 : 40;

		add_unit(&made, (struct pen_rect){9, 0, WIDTH, HEIGHT}, first, end, other);
		add_unit(&made, (struct pen_rect){0, 5, 9, HEIGHT}, first, end, other);
		add_unit(&made, (struct pen_rect){0, 0, 9, 5}, first, end, other);
	}
	assert_memory_equal(expected, other, size);
	(void)snprintf(text, sizeof text, HEAD("") "%s", busy + sizeof HEAD(ALL) - 1);
	plain = make(text);
	assert_int_equal(plain.film.channels, PEN_CHANNELS_MIN);
	add_unit(&plain, (struct pen_rect){0, 0, WIDTH, HEIGHT}, 0, 40, image);
	for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++)
		assert_memory_equal(expected + i * channels, image + i * PEN_CHANNELS_MIN,
			PEN_CHANNELS_MIN * sizeof *image);
	free(image);
	free(other);
	free(expected);
	unmake(&plain);
	unmake(&made);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_plane),
		cmocka_unit_test(test_sphere),
		cmocka_unit_test(test_light_is_a_black_hit),
		cmocka_unit_test(test_vertex_attributes),
		cmocka_unit_test(test_depth_of_a_turning_camera),
		cmocka_unit_test(test_planes_are_a_pure_function),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
