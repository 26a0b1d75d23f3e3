/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/digest.h"
#include "core/render/pictures.h"
#include "core/render/render.h"
#include "core/scene/parse.h"
#include "core/scene/planes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/*
 * Caches and farms hold that equal classes give equal bits. A change of the renderer that alters
 * any bit must therefore raise PEN_RENDER_ABI; this test knows the bits of the present one.
 */

/* Every light, material, motion and way through the tracer, and most of the camera. */
static const char everything[] =
	"{\"version\": 1, \"image\": {\"width\": 48, \"height\": 32,"
	"  \"filter\": {\"type\": \"mitchell\", \"width\": 4}},"
	"\"camera\": {\"position\": [0, 2, 9], \"look_at\": [0, 1, 0], \"horizontal_fov\": 45,"
	"  \"aperture_radius\": 0.1, \"focus_distance\": 9, \"focal_surface\": \"sphere\","
	"  \"blades\": 5, \"blade_rotation\": 10, \"shutter\": {\"open\": 0, \"close\": 1},"
	"  \"keyframes\": [{\"time\": 0, \"position\": [0, 2, 9], \"look_at\": [0, 1, 0]},"
	"    {\"time\": 1, \"position\": [0.2, 2, 9], \"look_at\": [0, 1.1, 0]}]},"
	"\"background\": {\"color\": [0.3, 0.4, 0.5]}, \"sampling\": {\"samples\": 20},"
	"\"integrator\": {\"type\": \"%s\", \"max_depth\": 6},"
	"\"materials\": {\"matte\": {\"type\": \"matte\", \"color\": [0.6, 0.5, 0.4]},"
	"  \"satin\": {\"type\": \"glossy\", \"color\": [0.8, 0.8, 0.8], \"roughness\": 0.3},"
	"  \"mirror\": {\"type\": \"glossy\", \"color\": [0.9, 0.9, 0.9], \"roughness\": 0},"
	"  \"clear\": {\"type\": \"glass\", \"color\": [1, 1, 1], \"ior\": 1.5, \"roughness\": 0},"
	"  \"frosted\": {\"type\": \"glass\", \"color\": [1, 1, 1], \"ior\": 1.5,"
	"    \"roughness\": 0.3}},"
	"\"objects\": ["
	"  {\"type\": \"mesh\", \"material\": \"matte\", \"indices\": [0, 1, 2, 0, 2, 3],"
	"   \"vertices\": [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]},"
	"  {\"type\": \"sphere\", \"material\": \"clear\", \"center\": [0, 0, 0], \"radius\": 1,"
	"   \"keyframes\": [{\"time\": 0, \"translate\": [-2, 1, 0]},"
	"     {\"time\": 1, \"translate\": [-1.5, 1.4, 0]}]},"
	"  {\"type\": \"sphere\", \"material\": \"mirror\", \"center\": [3, 1, -1], \"radius\": 1},"
	"  {\"type\": \"sphere\", \"material\": \"satin\", \"center\": [0, 0, 0], \"radius\": 0.7,"
	"   \"transform\": {\"translate\": [1.8, 1, 0], \"scale\": [1, 1.5, 0.6]}},"
	"  {\"type\": \"mesh\", \"material\": \"frosted\", \"name\": \"bar\","
	"   \"indices\": [0, 1, 2, 0, 2, 3],"
	"   \"vertices\": [[-1.6, -0.2, 0], [1.6, -0.2, 0], [1.6, 0.2, 0], [-1.6, 0.2, 0]],"
	"   \"keyframes\": [{\"time\": 0, \"translate\": [0, 2, 1], \"rotate\": [0, 0, 0, 1]},"
	"     {\"time\": 1, \"translate\": [0, 2, 1], \"rotate\": [0, 0, 0.5, 0.8660254]}]},"
	"  {\"type\": \"instance\", \"of\": \"bar\", \"material\": \"matte\","
	"   \"transform\": {\"translate\": [0, 2.5, -2], \"scale\": [1, 2, 1]}},"
	"  {\"type\": \"mesh\", \"material\": \"satin\", \"indices\": [0, 1, 2],"
	"   \"vertices_at\": [{\"time\": 0, \"vertices\": [[2, 0, 2], [3, 0, 2], [2.5, 1, 2]]},"
	"     {\"time\": 1, \"vertices\": [[2, 0, 2], [3, 0, 2], [2.9, 1.3, 2]]}]}],"
	"\"lights\": ["
	"  {\"type\": \"rectangle\", \"corner\": [-3, 5, -1], \"edge_u\": [2, 0, 0],"
	"   \"edge_v\": [0, 0, 2], \"radiance\": [9, 9, 9]},"
	"  {\"type\": \"triangle\", \"vertices\": [[3, 4, 0], [4.5, 4, -0.5], [4, 4, 1.5]],"
	"   \"radiance\": [4, 5, 7]},"
	"  {\"type\": \"sphere\", \"center\": [3, 3, 2], \"radius\": 0.4, \"radiance\": [8, 7, 5]},"
	"  {\"type\": \"disk\", \"center\": [-4, 1, 0], \"normal\": [1, 0, 0], \"radius\": 0.5,"
	"   \"radiance\": [6, 5, 4]},"
	"  {\"type\": \"point\", \"position\": [-3, 2, 3], \"intensity\": [2, 2, 2]},"
	"  {\"type\": \"spot\", \"position\": [0, 4, 3], \"direction\": [0, -1, -0.5],"
	"   \"intensity\": [5, 4, 5], \"cone_angle\": 40, \"blend\": 0.2},"
	"  {\"type\": \"directional\", \"direction\": [0.2, -1, -1], \"irradiance\": [0.5, 0.5, "
	"0.4],"
	"   \"angle\": 2}]}";

#define IMAGE                                                                                      \
	"\"image\": \"sha256:0000000000000000000000000000000000000000000000000000000000000000\""

/* Pictures as colour, normals, roughness and environment; every lobe; what is looked through. */
static const char surfaces[] =
	"{\"version\": 1, \"image\": {\"width\": 48, \"height\": 32,"
	"  \"aovs\": [\"albedo\", \"normal\", \"depth\"]},"
	"\"camera\": {\"position\": [0, 2, 9], \"look_at\": [0, 1, 0], \"horizontal_fov\": 45},"
	"\"background\": {" IMAGE ", \"rotation\": 30}, \"sampling\": {\"samples\": 20},"
	"\"integrator\": {\"type\": \"%s\", \"max_depth\": 6},"
	"\"textures\": {\"t\": {" IMAGE ", \"color_space\": \"linear\"},"
	"  \"m\": {" IMAGE ", \"wrap_u\": \"mirror\", \"wrap_v\": \"clamp\"}},"
	"\"materials\": {\"floor\": {\"type\": \"matte\", \"color\": {\"texture\": \"m\","
	"    \"transform\": {\"scale\": [40, 40], \"rotation\": 20}}},"
	"  \"paint\": {\"type\": \"principled\", \"base_color\": {\"texture\": \"t\","
	"    \"transform\": {\"scale\": [8, 4]}}, \"roughness\": {\"texture\": \"t\"}, "
	"\"metallic\": 0.5,"
	"    \"normal\": {\"texture\": \"t\"}, \"clearcoat\": 0.7, \"clearcoat_roughness\": 0.1},"
	"  \"lamp\": {\"type\": \"principled\", \"emission\": [2, 1, 0.5]},"
	"  \"body\": {\"type\": \"principled\", \"transmission\": 1, \"roughness\": 0.2,"
	"    \"base_color\": [0.9, 0.9, 0.6]},"
	"  \"sheet\": {\"type\": \"principled\", \"transmission\": 0.8, \"double_sided\": false},"
	"  \"veil\": {\"type\": \"principled\", \"opacity\": 0.4, \"alpha_mode\": \"blend\","
	"    \"base_color\": [0.2, 0.3, 0.9]},"
	"  \"sign\": {\"type\": \"principled\", \"unlit\": true, \"base_color\": [0, 0.7, 0]}},"
	"\"objects\": ["
	"  {\"type\": \"mesh\", \"material\": \"floor\", \"indices\": [0, 1, 2, 0, 2, 3],"
	"   \"vertices\": [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]],"
	"   \"uvs\": [[0, 0], [1, 0], [1, 1], [0, 1]]},"
	"  {\"type\": \"sphere\", \"material\": \"paint\", \"center\": [0, 0, 0], \"radius\": 1,"
	"   \"keyframes\": [{\"time\": 0, \"translate\": [-2, 1, 0]},"
	"     {\"time\": 1, \"translate\": [-1.5, 1.4, 0]}]},"
	"  {\"type\": \"sphere\", \"material\": \"body\", \"center\": [0, 1, 1], \"radius\": 0.9},"
	"  {\"type\": \"sphere\", \"material\": \"lamp\", \"center\": [3, 1, -1], \"radius\": 1},"
	"  {\"type\": \"mesh\", \"material\": \"paint\", \"name\": \"tile\", \"indices\": [0, 1, "
	"2],"
	"   \"vertices\": [[1, 0, 2], [2, 0, 2.5], [1.5, 1, 2]],"
	"   \"uvs\": [[0, 0], [0.2, 0], [0.1, 0.3]]},"
	"  {\"type\": \"instance\", \"of\": \"tile\", \"material\": \"sheet\","
	"   \"transform\": {\"translate\": [0, 0.5, 2], \"scale\": [1, 2, 1]}},"
	"  {\"type\": \"instance\", \"of\": \"tile\", \"material\": \"veil\","
	"   \"transform\": {\"translate\": [-3, 1, 2], \"scale\": [2, 2, 1]}},"
	"  {\"type\": \"instance\", \"of\": \"tile\", \"material\": \"sign\","
	"   \"transform\": {\"translate\": [-2, 2, 0]}}],"
	"\"lights\": ["
	"  {\"type\": \"rectangle\", \"corner\": [-3, 5, -1], \"edge_u\": [2, 0, 0],"
	"   \"edge_v\": [0, 0, 2], \"radiance\": [9, 9, 9]}]}";

/* 4 by 2 texels of red, green, blue and the exponent that they share (Ward's RGBE). */
static const unsigned char picture[] =
	"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n"
	"\x80\x80\xf0\x80\xa0\x70\xe0\x80\x60\x90\xe8\x80\xc0\x30\xf8\x80"
	"\x10\xf0\xa0\x80\x80\x50\xff\x80\xf0\x98\xc0\x80\x20\x70\xd0\x80";

/* Of the PEN_RENDER_ABI that the digests below belong to. */
enum { GOLDEN_ABI = 7, INTEGRATORS = 3, SCENES = 2 };

static const char *const scenes[SCENES] = {everything, surfaces};
static const char *const integrators[INTEGRATORS] = {"distribution", "path", "whitted"};

/* By class without its ABI number; 0 where none is known. */
static const struct golden {
	const char *name;
	uint64_t digests[SCENES][INTEGRATORS];
} goldens[] = {
	{"x86-64-v2/embree-3.13.5/AuthenticAMD",
		{{0x6b51b1cda56081ed, 0x0e45d1afe3dfcfe6, 0xffffae0f11d83785},
			{0xc6ecf2f079329193, 0x12fd2977d3a31680, 0xd6413eef53132900}}},
	{"x86-64-v3/embree-3.13.5/AuthenticAMD",
		{{0x1e1b2a738fb30c10, 0x283ba0dafd9a7a99, 0x2aebc8ca2104ff83},
			{0x4a34add65325a436, 0xe480dd604be8b33a, 0xc10f54125a54292f}}},
	{"x86-64-v4/embree-3.13.5/AuthenticAMD",
		{{0xe3c4b4726281c03d, 0xeedc38c86b56c5c1, 0x7a2fe5b418a9363d},
			{0x2481e0f84f355230, 0xf6bf01e9810fc2d8, 0x55c51e63041d5553}}},
};

static struct pen_scene *parse(const char *format, const char *integrator)
{
	static struct pen_scene_errors errors;
	static char text[sizeof everything + sizeof surfaces];
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_scene *scene = NULL;
	json_t *tree = NULL;
	char *at;

	(void)snprintf(text, sizeof text, "%s", format);
	at = strstr(text, "%s");
	assert_non_null(at);
	(void)snprintf(at, sizeof text - (size_t)(at - text), "%s%s", integrator,
		strstr(format, "%s") + 2);
	assert_int_equal(pen_json_parse(text, strlen(text), &tree, &err), 0);
	if (pen_scene_parse(tree, &scene, &errors, &err) < 0)
		fail_msg("%s %s", errors.items[0].pointer, errors.items[0].detail);
	json_decref(tree);
	return scene;
}

static struct pen_pictures *load_pictures(const struct pen_scene *scene)
{
	const struct pen_blob blob = {picture, sizeof picture - 1};
	const struct pen_blob blobs[] = {blob, blob, blob};
	static struct pen_scene_errors errors;
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_pictures *pictures = NULL;

	assert_true(scene->asset_count <= sizeof blobs / sizeof *blobs);
	if (pen_pictures_load(scene, blobs, &errors, &pictures, &err) < 0)
		fail_msg("%s %s", errors.items[0].pointer, errors.items[0].detail);
	return pictures;
}

/* Of the image's middle: a block of sixteen samples, and four that are traced by pixels. */
static uint64_t digest_of(enum pen_isa isa, const char *format, const char *integrator)
{
	static float pixels[PEN_CHANNELS_MAX * 32 * 16];
	const struct pen_unit unit = {
		.rect = {8, 8, 40, 24}, .frame = 1, .sample_first = 0, .sample_end = 20};
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_scene *scene = parse(format, integrator);
	const uint32_t channels = pen_scene_film(scene).channels;
	struct pen_pictures *pictures = load_pictures(scene);
	struct pen_render_scene *ready = NULL;
	struct pen_renderer *renderer = NULL;

	if (pen_render_scene_create(scene, pictures, 1, isa, &ready, &err) < 0)
		fail_msg("%s", err.text);
	assert_int_equal(pen_renderer_create(ready, &renderer, &err), 0);
	pen_renderer_unit(renderer, &unit, pixels, NULL, NULL);
	pen_renderer_destroy(renderer);
	pen_render_scene_destroy(ready);
	pen_pictures_destroy(pictures);
	pen_scene_destroy(scene);
	return pen_xxh3(pixels, channels * pen_rect_area(unit.rect) * sizeof *pixels);
}

static const struct golden *find_golden(const char *class)
{
	const char *name = strchr(class, '/');

	assert_non_null(name);
	for (size_t i = 0; i < sizeof goldens / sizeof *goldens; i++)
		if (strcmp(goldens[i].name, name + 1) == 0)
			return &goldens[i];
	return NULL;
}

static void check_class(enum pen_isa isa)
{
	char class[PEN_CLASS_TEXT];
	const struct golden *golden;
	int changed = 0;

	if (!pen_isa_supported(isa)) {
		print_message("%s does not run here\n", pen_isa_name(isa));
		skip();
	}
	pen_class_format(isa, class);
	golden = find_golden(class);
	for (int i = 0; i < SCENES * INTEGRATORS; i++) {
		const char *integrator = integrators[i % INTEGRATORS];
		const uint64_t digest = digest_of(isa, scenes[i / INTEGRATORS], integrator);
		const uint64_t wanted =
			golden ? golden->digests[i / INTEGRATORS][i % INTEGRATORS] : 0;

		print_message("%s scene %d %s 0x%016llx\n", class, i / INTEGRATORS, integrator,
			(unsigned long long)digest);
		changed += wanted != 0 && digest != wanted;
	}
	if (changed > 0)
		fail_msg("images have changed: if that is intended, raise PEN_RENDER_ABI, and "
			 "GOLDEN_ABI with the digests printed here");
	if (!golden) {
		print_message("no digests are known of this class\n");
		skip();
	}
}

/* Breaks when PEN_RENDER_ABI is raised and the digests here are those of the one before. */
static void test_digests_are_of_this_abi(void **state)
{
	(void)state;
	assert_int_equal(GOLDEN_ABI, PEN_RENDER_ABI);
}

/* These break when any bit of an image changes. */
static void test_v2(void **state)
{
	(void)state;
	check_class(PEN_ISA_V2);
}

static void test_v3(void **state)
{
	(void)state;
	check_class(PEN_ISA_V3);
}

static void test_v4(void **state)
{
	(void)state;
	check_class(PEN_ISA_V4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_digests_are_of_this_abi),
		cmocka_unit_test(test_v2),
		cmocka_unit_test(test_v3),
		cmocka_unit_test(test_v4),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
