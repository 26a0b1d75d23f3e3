/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/clock.h"
#include "core/render/render.h"
#include "core/scene/parse.h"
#include "core/scene/planes.h"
#include "tests/support/load.h"

#include <embree3/rtcore.h>

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/*
 * From a scene file and its assets to the first rays, in seconds: of everything, of reading the
 * assets alone, and of Embree's own building within. The linker sends the commits here.
 */
static const char usage[] = "usage: first-ray SCENE.json DIRECTORY ASSET...\n";

static int64_t commit_us;

void __wrap_rtcCommitScene(RTCScene scene);
void __real_rtcCommitScene(RTCScene scene);

void __wrap_rtcCommitScene(RTCScene scene)
{
	const int64_t start = pen_clock_us();

	__real_rtcCommitScene(scene);
	commit_us += pen_clock_us() - start;
}

/* Into memory that is new, as whoever uses the bytes must. */
static void read_file(const char *directory, const char *name)
{
	char path[4096];
	off_t size;
	char *bytes;
	int file;

	(void)snprintf(path, sizeof path, "%s/%s", directory, name);
	file = open(path, O_RDONLY | O_CLOEXEC);
	size = file < 0 ? -1 : lseek(file, 0, SEEK_END);
	if (size < 0 || lseek(file, 0, SEEK_SET) < 0)
		load_fail("cannot open an asset");
	bytes = load_allocate((size_t)size, 1);
	for (off_t at = 0; at < size;) {
		const ssize_t count = read(file, bytes + at, (size_t)(size - at));

		if (count <= 0)
			load_fail("cannot read an asset");
		at += count;
	}
	free(bytes);
	(void)close(file);
}

static void trace_first(const struct pen_scene *desc, const struct pen_render_scene *scene)
{
	static float pixels[PEN_CHANNELS_MAX];
	const struct pen_rect crop = desc->image.crop;
	const struct pen_unit unit = {
		.rect = {crop.x0, crop.y0, crop.x0 + 1, crop.y0 + 1}, .frame = 1, .sample_end = 1};
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_renderer *renderer;

	if (pen_renderer_create(scene, &renderer, &err) < 0)
		load_fail(err.text);
	pen_renderer_unit(renderer, &unit, pixels, NULL, NULL);
	pen_renderer_destroy(renderer);
}

int main(int argc, char **argv)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_render_scene *ready;
	struct pen_pictures *pictures;
	struct pen_scene *scene;
	int64_t start, read, traced;

	if (argc < 4)
		load_fail(usage);
	if (pen_render_warm_up(pen_isa_best(), &err) < 0)
		load_fail(err.text);
	start = pen_clock_us();
	for (int i = 3; i < argc; i++)
		read_file(argv[2], argv[i]);
	read = pen_clock_us();
	scene = load_scene(argv[1]);
	pictures = load_assets(scene, argv[2]);
	if (pen_render_scene_create(scene, pictures, 1, pen_isa_best(), &ready, &err) < 0)
		load_fail(err.text);
	trace_first(scene, ready);
	traced = pen_clock_us();
	(void)printf("%.3f %.3f %.3f\n", 1e-6 * (double)(traced - read),
		1e-6 * (double)(read - start), 1e-6 * (double)commit_us);
	pen_render_scene_destroy(ready);
	pen_pictures_destroy(pictures);
	pen_scene_destroy(scene);
	return 0;
}
