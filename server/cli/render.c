/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "server/cli/cli.h"
#include "server/cli/interrupt.h"
#include "server/cli/options.h"
#include "server/cli/output.h"
#include "server/cli/print.h"
#include "server/cli/private_farm.h"
#include "server/cli/renders.h"
#include "server/cli/source.h"
#include "server/cli/upload.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { INTERVAL_MS = 20, URL_SIZE = 32 };

static const char help[] =
	"usage: penumbra render [OPTION…] SCENE -o FILE [-o FILE…]\n"
	"\n"
	"Renders the scene on this machine, with a coordinator and workers of its own, and writes\n"
	"the image. The extension decides the format: .png .exr .jpg .hdr.\n"
	"\n"
	"SCENE is a scene in JSON, a .glb or a .gltf (\"-\": standard input); files that it names\n"
	"by relative paths are uploaded.\n"
	"\n"
	"  -o, --output FILE    where to; may be given up to 8 times\n" PEN_SCENE_OPTIONS_HELP
	"  --processes N        render processes; default: one per core\n"
	"  --isa NAME           instruction set: v2, v3 or v4; default: the best there is\n"
	"  --quiet              print nothing but errors\n"
	"  --json               print the finished render as JSON\n"
	"\n"
	"Exit codes: 0 done, 1 failed, 2 wrong usage, 4 scene refused, 130 interrupted.\n";

static const struct option options_table[] = {
	{"output", required_argument, NULL, PEN_OPTION_OUTPUT},
	PEN_SCENE_OPTIONS,
	{"processes", required_argument, NULL, PEN_OPTION_PROCESSES},
	{"isa", required_argument, NULL, PEN_OPTION_ISA},
	{"quiet", no_argument, NULL, PEN_OPTION_QUIET},
	{"json", no_argument, NULL, PEN_OPTION_JSON},
	{"help", no_argument, NULL, PEN_OPTION_HELP},
	{0},
};

static const struct pen_usage usage = {
	.command = "render",
	.help = help,
	.letters = ":ho:",
	.options = options_table,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "SCENE",
};

/* All that a run holds; outputs up to output_count are open. */
struct run {
	const struct pen_options *options;
	struct pen_source source;
	struct pen_output outputs[PEN_OUTPUTS_MAX];
	size_t output_count;
	struct pen_private_farm farm;
	struct pen_client *client;
	struct pen_resource resource;
	uint32_t frames_written;
	json_t *finished; /* the render in the end, as the server tells it */
	struct pen_error err;
};

/* Those of single frames are opened one by one. */
static int outputs_open(struct run *run)
{
	for (; run->output_count < run->options->output_count; run->output_count++) {
		const char *path = run->options->outputs[run->output_count];
		struct pen_output *output = &run->outputs[run->output_count];
		int r = 0;

		*output = (struct pen_output){.path = path, .fd = -1};
		if (!pen_output_has_frames(path))
			r = pen_output_open(output, path, &run->err);

		if (r < 0)
			return r;
	}
	return 0;
}

static int farm_open(struct run *run)
{
	const struct pen_private_farm_options options = {
		.processes = run->options->processes,
		.isa = run->options->isa,
	};
	char url[URL_SIZE];
	int r = pen_private_farm_start(&run->farm, &options, &run->err);

	if (r < 0)
		return r;
	(void)snprintf(url, sizeof url, "http://127.0.0.1:%u", run->farm.port);
	return pen_client_create(url, NULL, &run->client, &run->err);
}

static int download(struct run *run, struct pen_output *output, uint32_t frame)
{
	int r = pen_renders_download(
		run->client, run->resource.id, frame, output->format, output->fd, &run->err);

	return r < 0 ? r : pen_output_commit(output, &run->err);
}

static int frame_write(struct run *run, const char *pattern, uint32_t frame)
{
	char *path = pen_output_frame_path(pattern, frame);
	struct pen_output output = {.fd = -1};
	int r;

	if (!path)
		return pen_error_memory(&run->err);
	r = pen_output_open(&output, path, &run->err);
	if (r == 0)
		r = download(run, &output, frame);
	pen_output_finish(&output);
	free(path);
	return r;
}

/* Frames that are done are written while later ones render. */
static int frames_write(void *user, const struct pen_resource *resource, struct pen_error *err)
{
	struct run *run = user;
	int r = 0;

	(void)err;
	while (r == 0 && run->frames_written < resource->frames_done) {
		uint32_t frame = resource->frame_first + run->frames_written;

		for (size_t i = 0; r == 0 && i < run->output_count; i++)
			if (pen_output_has_frames(run->outputs[i].path))
				r = frame_write(run, run->outputs[i].path, frame);
		run->frames_written += r == 0;
	}
	return r;
}

static int names_check(struct run *run)
{
	for (size_t i = 0; i < run->output_count; i++)
		if (run->resource.frames_total > 1 && !pen_output_has_frames(run->outputs[i].path))
			return pen_error_set(&run->err, PEN_EUNSUPPORTED,
				"%s: the scene is an animation of %u frames: write #### where the "
				"frame's number shall be, as in out.####.png",
				run->outputs[i].path, run->resource.frames_total);
	return 0;
}

static int render(struct run *run)
{
	struct pen_progress progress;
	const struct pen_follow manner = {.interval_ms = INTERVAL_MS,
		.progress = &progress,
		.news = frames_write,
		.user = run};
	int r;

	pen_progress_init(&progress, run->options->quiet);
	r = pen_upload_missing(run->client, &run->source, &progress, &run->err);
	if (r == 0)
		r = pen_renders_submit(run->client, &run->source.text, run->options->override,
			&run->resource, &run->err);
	if (r == 0)
		r = names_check(run);
	if (r == 0)
		r = pen_renders_follow(run->client, &manner, &run->resource, &run->err);
	pen_progress_finish(&progress);
	return r < 0 ? r : pen_renders_outcome(run->client, &run->resource, &run->err);
}

static int outputs_write(struct run *run)
{
	int r = frames_write(run, &run->resource, &run->err);

	for (size_t i = 0; r == 0 && i < run->output_count; i++)
		if (!pen_output_has_frames(run->outputs[i].path))
			r = download(run, &run->outputs[i], 0);
	return r;
}

static void outcome_print(const struct run *run)
{
	if (run->options->json) {
		pen_print_json(run->finished);
		return;
	}
	for (size_t i = 0; i < run->output_count && !run->options->quiet; i++)
		(void)printf(
			"%s: rendered in %.2f s\n", run->outputs[i].path, run->resource.seconds);
}

static int run_through(struct run *run)
{
	int r = pen_source_read(&run->source, run->options->operand, &run->err);

	if (r == 0)
		r = outputs_open(run);
	if (r == 0)
		r = farm_open(run);
	if (r == 0)
		r = render(run);
	if (r == 0)
		run->finished = json_incref(pen_client_answer(run->client));
	return r < 0 ? r : outputs_write(run);
}

static void run_finish(struct run *run)
{
	pen_private_farm_stop(&run->farm);
	pen_client_destroy(run->client);
	json_decref(run->finished);
	pen_source_finish(&run->source);
	for (size_t i = 0; i < run->output_count; i++)
		pen_output_finish(&run->outputs[i]);
}

int pen_cli_render(int argc, char **argv)
{
	struct pen_options options;
	struct run run = {.options = &options, .err = PEN_ERROR_INIT};
	int code;

	if (!pen_options_parse(&options, &usage, argc, argv, &code))
		return code;
	if (options.output_count == 0) {
		pen_options_finish(&options);
		return pen_cli_usage("render", "where to? -o FILE is missing");
	}
	pen_interrupt_catch();
	pen_source_init(&run.source);
	if (run_through(&run) == 0) {
		if (!options.quiet)
			pen_print_warnings(run.finished, "penumbra: warning: ", stderr);
		outcome_print(&run);
	} else {
		if (run.err.code == PEN_ECLOSED)
			pen_private_farm_explain(&run.farm, &run.err);
		code = pen_cli_fail(run.client, &run.err);
	}
	run_finish(&run);
	pen_options_finish(&options);
	return code;
}
