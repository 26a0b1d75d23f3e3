/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "server/cli/cli.h"
#include "server/cli/print.h"
#include "server/cli/renders.h"
#include "server/cli/scene_text.h"
#include "server/cli/session.h"

#include <stdio.h>

static const char help[] =
	"usage: penumbra submit [OPTION…] SCENE.json\n"
	"\n"
	"Hands the scene (\"-\": standard input) to a running server and prints the render's id.\n"
	"\n"
	"  --samples N       samples per pixel, instead of the scene's\n"
	"  --size WxH        image size in pixels, instead of the scene's\n"
	"  --crop L,T,R,B    render these pixels only (right and bottom excluded)\n"
	"  --seed N          seed of the samples, instead of the scene's\n"
	"  --json            print the server's whole answer\n"
	"  --server URL      default: $PENUMBRA_SERVER or http://127.0.0.1:8080\n";

static const struct option options[] = {
	{"samples", required_argument, NULL, PEN_OPTION_SAMPLES},
	{"size", required_argument, NULL, PEN_OPTION_SIZE},
	{"crop", required_argument, NULL, PEN_OPTION_CROP},
	{"seed", required_argument, NULL, PEN_OPTION_SEED},
	{"json", no_argument, NULL, PEN_OPTION_JSON},
	{"server", required_argument, NULL, PEN_OPTION_SERVER},
	{"help", no_argument, NULL, PEN_OPTION_HELP},
	{0},
};

static const struct pen_usage usage = {
	.command = "submit",
	.help = help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "SCENE.json",
};

int pen_cli_submit(int argc, char **argv)
{
	struct pen_resource resource;
	struct pen_session session;
	struct pen_buf scene;
	int code, r;

	if (!pen_session_open(&session, &usage, argc, argv, &code))
		return code;
	pen_buf_init(&scene, PEN_SCENE_BYTES_MAX);
	r = pen_scene_text_read(session.options.operand, &scene, &session.err);
	if (r == 0)
		r = pen_renders_submit(
			session.client, &scene, session.options.override, &resource, &session.err);
	pen_buf_finish(&scene);
	if (r == 0 && session.options.json)
		pen_print_json(pen_client_answer(session.client));
	else if (r == 0)
		(void)printf("%s\n", resource.id);
	return pen_session_close(&session, r);
}
