/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/lights.h"
#include "core/render/render.h"
#include "core/scene/parse.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { TEXT_MAX = 1 << 16, WIDTH = 32, HEIGHT = 16, SAMPLES = 64 };

#define GLOW                                                                                       \
	"\"glow\": {\"type\": \"principled\", \"base_color\": [0, 0, 0], \"emission\": [5, 4, 3]}"

/* Seen from above: a floor that shines back a little, and what is over it. */
#define HEAD                                                                                       \
	"{\"version\": 1, \"image\": {\"width\": 32, \"height\": 16},"                             \
	"\"sampling\": {\"samples\": 64}, \"integrator\": {\"type\": \"path\"},"                   \
	"\"camera\": {\"position\": [0, 1, 6], \"look_at\": [0, 0, 0], \"horizontal_fov\": 60,"    \
	"  \"shutter\": {\"open\": 0, \"close\": 1}},"                                             \
	"\"background\": {\"color\": [0, 0, 0]}, \"materials\": {"                                 \
	"\"floor\": {\"type\": \"principled\", \"base_color\": [0.6, 0.6, 0.6],"                   \
	"  \"metallic\": 0.5, \"roughness\": 0.3},"

#define FLOOR                                                                                      \
	"{\"type\": \"mesh\", \"material\": \"floor\", \"indices\": [0, 1, 2, 0, 2, 3],"           \
	" \"vertices\": [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]}"

struct text {
	char at[TEXT_MAX];
	size_t length;
};

static __attribute__((format(printf, 2, 3))) void add(struct text *text, const char *format, ...)
{
	va_list list;

	va_start(list, format);
	text->length += (size_t)vsnprintf(
		text->at + text->length, sizeof text->at - text->length, format, list);
	va_end(list);
	assert_true(text->length < sizeof text->at);
}

struct made {
	struct pen_scene *scene;
	struct pen_render_scene *ready;
};

/* Of the last material the sides are said. */
static struct made make(const char *text, bool is_one_sided)
{
	static struct pen_scene_errors errors;
	struct pen_error err = PEN_ERROR_INIT;
	struct made made = {.scene = NULL};
	json_t *tree = NULL;

	assert_int_equal(pen_json_parse(text, strlen(text), &tree, &err), 0);
	if (pen_scene_parse(tree, &made.scene, &errors, &err) < 0)
		fail_msg("%s %s", errors.items[0].pointer, errors.items[0].detail);
	json_decref(tree);
	made.scene->materials[made.scene->material_count - 1].is_one_sided = is_one_sided;
	if (pen_render_scene_create(made.scene, NULL, 1, pen_isa_best(), &made.ready, &err) < 0)
		fail_msg("%s", err.text);
	return made;
}

static void unmake(struct made *made)
{
	pen_render_scene_destroy(made->ready);
	pen_scene_destroy(made->scene);
}

/* A square of 2 x 2 over the floor, facing it, in 2 * columns * columns triangles. */
struct square {
	int columns;
	const char *more; /* members of the mesh */
	const char *glow; /* the material; NULL: GLOW */
	bool shares;	  /* corners are one vertex for all triangles */
	bool is_one_sided;
	float bend;	     /* the middle is so much lower */
	int missing, turned; /* a triangle; -1: none */
	int repeated;	     /* the triangle that is there in the missing one's stead */
	int sheared;	     /* one that has lost its shape but not its area */
};

static const struct square PLAIN = {.columns = 4,
	.more = "",
	.shares = true,
	.missing = -1,
	.turned = -1,
	.repeated = -1,
	.sheared = -1};

static void corner_of(const struct square *square, int triangle, int k, int ret[2])
{
	static const int steps[2][3][2] = {{{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 1}, {0, 1}}};
	const int cell = triangle / 2;

	ret[0] = cell % square->columns + steps[triangle % 2][k][0];
	ret[1] = cell / square->columns + steps[triangle % 2][k][1];
}

static void add_vertex(
	struct text *text, const struct square *square, const int at[2], double aside, bool comma)
{
	const int n = square->columns;
	const bool is_middle = 2 * at[0] == n && 2 * at[1] == n;

	add(text, "%s[%.9g, %.9g, %.9g]", comma ? "," : "", 2.0 * at[0] / n - 1.0 + aside,
		2.0 - (is_middle ? (double)square->bend : 0.0), 2.0 * at[1] / n - 1.0 + aside);
}

static void add_square(struct text *text, const struct square *square)
{
	const int n = square->columns, count = 2 * n * n;
	bool comma = false;

	add(text, "{\"type\": \"mesh\", \"material\": \"glow\" %s, \"vertices\": [", square->more);
	for (int i = 0; square->shares && i <= n; i++)
		for (int k = 0; k <= n; k++)
			add_vertex(text, square, (const int[2]){k, i}, 0.0, i + k > 0);
	for (int i = 0; !square->shares && i < 3 * count; i++) {
		int at[2];

		corner_of(square, i / 3, i % 3, at);
		add_vertex(text, square, at, i == 3 * square->sheared + 1 ? -0.2 : 0.0, i > 0);
	}
	add(text, "], \"indices\": [");
	for (int i = 0; i < count; i++) {
		const int triangle = i == square->missing ? square->repeated : i;

		for (int k = 0; k < 3 && triangle >= 0; k++) {
			const int from = triangle == square->turned ? 2 - k : k;
			int at[2];

			corner_of(square, triangle, from, at);
			add(text, "%s%d", comma ? ", " : "",
				square->shares ? at[0] + at[1] * (n + 1) : 3 * triangle + from);
			comma = true;
		}
	}
	add(text, "]}");
}

static struct made make_square(const struct square *square)
{
	static struct text text;

	text.length = 0;
	add(&text, HEAD "%s}, \"objects\": [" FLOOR ", ", square->glow ? square->glow : GLOW);
	add_square(&text, square);
	add(&text, "], \"lights\": []}");
	return make(text.at, square->is_one_sided);
}

static void expect(const struct square *square, uint32_t panels, uint32_t emitters)
{
	struct made made = make_square(square);
	const struct pen_lights *lights = made.ready->lights;

	assert_int_equal(lights->count, panels);
	assert_int_equal(lights->emitters.count, emitters);
	unmake(&made);
}

/* Breaks when a corner, a side or the way that a panel faces is lost. */
static void a_tiled_square_is_one_light(void **state)
{
	struct square square = PLAIN;
	const struct pen_light *light;
	struct made made;

	(void)state;
	expect(&square, 1, 0);
	square.shares = false;
	expect(&square, 1, 0);
	square.columns = 1;
	expect(&square, 1, 0);
	made = make_square(&square);
	light = made.ready->lights->items;
	assert_int_equal(light->type, PEN_LIGHT_RECTANGLE);
	assert_true(fabsf(light->area - 4.0f) < 1e-4f);
	assert_true(fabsf(light->axis.y + 1.0f) < 1e-5f);
	assert_true(light->color.x == 5.0f && light->color.y == 4.0f && light->color.z == 3.0f);
	unmake(&made);
}

/* Breaks when a panel is left where its mesh was made, or is turned inside out by a mirror. */
static void it_goes_where_its_mesh_goes(void **state)
{
	struct square square = PLAIN;
	const struct pen_light *light;
	struct made made;

	(void)state;
	square.more = ", \"transform\": {\"translate\": [0, 1, 0], \"scale\": [-2, 1, 1]}";
	made = make_square(&square);
	assert_int_equal(made.ready->lights->count, 1);
	light = made.ready->lights->items;
	assert_true(fabsf(light->area - 8.0f) < 1e-4f);
	assert_true(fabsf(light->axis.y + 1.0f) < 1e-5f);
	assert_true(fabsf(light->origin.y - 3.0f) < 1e-4f);
	unmake(&made);
	square.more = ", \"transform\": {\"rotate\": [0.1830127, 0.3, 0.5, 0.8], \"translate\":"
		      " [11, 7, -5]}";
	expect(&square, 1, 0);
}

/* Breaks when what has a hole, a fold, a bend or an overlap is taken for a whole rectangle. */
static void others_stay_triangles(void **state)
{
	struct square square = PLAIN;

	(void)state;
	square.missing = 13; /* inside */
	expect(&square, 0, 31);
	square.repeated = 18; /* the hole's area lies twice elsewhere */
	expect(&square, 0, 32);
	square = PLAIN;
	square.missing = 0; /* a corner */
	expect(&square, 0, 31);
	square = PLAIN;
	square.turned = 12;
	expect(&square, 0, 32);
	square = PLAIN;
	square.shares = false;
	square.more = ", \"transform\": {\"scale\": [3, 1, 1]}";
	square.sheared = 12; /* its second corner goes along its third side, a diagonal */
	expect(&square, 0, 32);
	square = PLAIN;
	square.bend = 0.01f;
	expect(&square, 0, 32);
	square = PLAIN;
	square.more = ", \"keyframes\": [{\"time\": 0, \"translate\": [0, 0, 0]},"
		      " {\"time\": 1, \"translate\": [1, 0, 0]}]";
	expect(&square, 0, 32);
}

/* Breaks when a panel's one color stands for what differs over it. */
static void what_shines_unevenly_stays_triangles(void **state)
{
	struct square square = PLAIN;

	(void)state;
	square.glow = "\"glow\": {\"type\": \"principled\", \"emission\": [5, 4, 3],"
		      " \"clearcoat\": 1}";
	expect(&square, 0, 32);
}

/* Breaks when sides that meet at an angle are one, or when many panels are not chosen from. */
static void a_box_has_six(void **state)
{
	static struct text text;
	struct made made;

	(void)state;
	for (int boxes = 1; boxes <= 2; boxes++) {
		text.length = 0;
		add(&text, HEAD GLOW "}, \"objects\": [" FLOOR);
		for (int i = 0; i < boxes; i++)
			add(&text,
				", {\"type\": \"mesh\", \"material\": \"glow\","
				"\"transform\": {\"translate\": [%d, 1, 0]}, \"vertices\":"
				"[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0],"
				" [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], \"indices\":"
				"[0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,"
				" 3, 7, 6, 3, 6, 2, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5]}",
				3 * i);
		add(&text, "], \"lights\": []}");
		made = make(text.at, false);
		assert_int_equal(made.ready->lights->count, 6 * boxes);
		assert_int_equal(made.ready->lights->emitters.count, 0);
		assert_int_equal(made.ready->lights->sampled_count, boxes == 1 ? 6 : 0);
		assert_int_equal(made.ready->lights->chooses, boxes > 1);
		unmake(&made);
	}
}

static double mean_of(const float *pixels)
{
	double sum = 0.0;

	for (int i = 0; i < WIDTH * HEIGHT; i++)
		sum += (double)(pixels[4 * i] / pixels[4 * i + 3]);
	return sum / (WIDTH * HEIGHT);
}

static void render(struct made *made, float *ret_pixels)
{
	const struct pen_unit unit = {
		.rect = {0, 0, WIDTH, HEIGHT}, .frame = 1, .sample_end = SAMPLES};
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_renderer *renderer = NULL;

	assert_int_equal(pen_renderer_create(made->ready, &renderer, &err), 0);
	pen_renderer_unit(renderer, &unit, ret_pixels, NULL, NULL);
	pen_renderer_destroy(renderer);
	unmake(made);
}

/*
 * A panel of both sides or of one, facing the floor or turned from it, against a sheet that is a
 * little bent and therefore lights by its triangles. Breaks when light is lost or counted twice
 * where a lobe finds a panel that is sampled too, and when its dark side shines.
 */
static void it_lights_as_its_triangles_do(void **state)
{
	static float whole[PEN_CHANNELS_MAX * WIDTH * HEIGHT];
	static float pieces[PEN_CHANNELS_MAX * WIDTH * HEIGHT];
	static const char *const upside_down =
		", \"transform\": {\"translate\": [0, 4, 0], \"rotate\": [0, 0, 1, 0]}";

	(void)state;
	for (int i = 0; i < 4; i++) {
		struct square square = PLAIN;
		struct made made;
		double mean, mean_of_pieces;

		square.is_one_sided = i % 2 == 1;
		square.more = i < 2 ? "" : upside_down;
		made = make_square(&square);
		render(&made, whole);
		square.bend = 1e-4f;
		made = make_square(&square);
		assert_int_equal(made.ready->lights->emitters.count, 32);
		render(&made, pieces);
		mean = mean_of(whole);
		mean_of_pieces = mean_of(pieces);
		print_message("%d: %g %g\n", i, mean, mean_of_pieces);
		assert_true(fabs(mean - mean_of_pieces) <= 0.01 * mean);
		assert_int_equal(mean > 0.01, i < 3);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_tiled_square_is_one_light),
		cmocka_unit_test(it_goes_where_its_mesh_goes),
		cmocka_unit_test(others_stay_triangles),
		cmocka_unit_test(what_shines_unevenly_stays_triangles),
		cmocka_unit_test(a_box_has_six),
		cmocka_unit_test(it_lights_as_its_triangles_do),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
