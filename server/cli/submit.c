/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/cli.h"
#include "server/cli/print.h"
#include "server/cli/renders.h"
#include "server/cli/session.h"
#include "server/cli/source.h"
#include "server/cli/upload.h"

#include <stdio.h>

static const char help[] =
	"usage: penumbra submit [OPTION…] SCENE\n"
	"\n"
	"Hands the scene to a running server and prints the render's id.\n"
	"\n"
	"SCENE is a scene in JSON, a .glb or a .gltf (\"-\": standard input); files that it names\n"
	"by relative paths are uploaded.\n"
	"\n" PEN_SCENE_OPTIONS_HELP
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const struct option options[] = {
	PEN_SCENE_OPTIONS,
	{"json", no_argument, NULL, PEN_OPTION_JSON},
	PEN_SERVER_OPTIONS,
	{"help", no_argument, NULL, PEN_OPTION_HELP},
	{0},
};

static const struct pen_usage usage = {
	.command = "submit",
	.help = help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "SCENE",
};

int pen_cli_submit(int argc, char **argv)
{
	struct pen_resource resource;
	struct pen_progress progress;
	struct pen_session session;
	struct pen_source source;
	int code, r;

	if (!pen_session_open(&session, &usage, argc, argv, &code))
		return code;
	pen_source_init(&source);
	pen_progress_init(&progress, session.options.json);
	r = pen_source_read(&source, session.options.operand, &session.err);
	if (r == 0)
		r = pen_upload_missing(session.client, &source, &progress, &session.err);
	if (r == 0)
		r = pen_renders_submit(session.client, &source.text, session.options.override,
			&resource, &session.err);
	pen_source_finish(&source);
	if (r == 0 && session.options.json)
		pen_print_json(pen_client_answer(session.client));
	else if (r == 0)
		(void)printf("%s\n", resource.id);
	return pen_session_close(&session, r);
}
