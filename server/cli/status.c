/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/cli.h"
#include "server/cli/print.h"
#include "server/cli/renders.h"
#include "server/cli/session.h"

static const char status_help[] =
	"usage: penumbra status [OPTION…] [ID]\n"
	"\n"
	"Shows a render or, without an id, the farm.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const char list_help[] =
	"usage: penumbra list [OPTION…]\n"
	"\n"
	"Shows the renders, newest first.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const char workers_help[] =
	"usage: penumbra workers [OPTION…]\n"
	"\n"
	"Shows the workers that are connected.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const struct option options[] = {
	{"json", no_argument, NULL, PEN_OPTION_JSON},
	PEN_SERVER_OPTIONS,
	{"help", no_argument, NULL, PEN_OPTION_HELP},
	{0},
};

static const struct pen_usage status_usage = {
	.command = "status",
	.help = status_help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_OPTIONAL,
};

static const struct pen_usage list_usage = {
	.command = "list",
	.help = list_help,
	.letters = ":h",
	.options = options,
};

static const struct pen_usage workers_usage = {
	.command = "workers",
	.help = workers_help,
	.letters = ":h",
	.options = options,
};

int pen_cli_status(int argc, char **argv)
{
	struct pen_resource resource;
	struct pen_session session;
	int code, r;

	if (!pen_session_open(&session, &status_usage, argc, argv, &code))
		return code;
	if (session.options.operand)
		r = pen_renders_get(
			session.client, session.options.operand, &resource, &session.err);
	else
		r = pen_client_call(session.client, "GET", "/v1/farm", NULL, 0, &session.err);
	if (r == 0 && session.options.json)
		pen_print_json(pen_client_answer(session.client));
	else if (r == 0) {
		pen_print_members(pen_client_answer(session.client));
		pen_print_errors(pen_client_answer(session.client), stdout);
		pen_print_warnings(pen_client_answer(session.client), "warning: ", stdout);
	}
	return pen_session_close(&session, r);
}

/* Gets path and shows the array under its member rows. */
static int show_table(struct pen_session *session, const char *path, const char *rows,
	const char *const *keys, size_t key_count)
{
	json_t *answer;
	int r = pen_client_call(session->client, "GET", path, NULL, 0, &session->err);

	if (r < 0)
		return r;
	answer = pen_client_answer(session->client);
	if (session->options.json)
		pen_print_json(answer);
	else
		pen_print_table(json_object_get(answer, rows), keys, key_count);
	return 0;
}

int pen_cli_list(int argc, char **argv)
{
	static const char *const keys[] = {"id", "state", "progress", "created", "seconds", "name"};
	struct pen_session session;
	int code, r;

	if (!pen_session_open(&session, &list_usage, argc, argv, &code))
		return code;
	r = show_table(&session, "/v1/renders", "renders", keys, sizeof keys / sizeof *keys);
	return pen_session_close(&session, r);
}

int pen_cli_workers(int argc, char **argv)
{
	static const char *const keys[] = {
		"id", "name", "address", "processes", "state", "rate", "class"};
	struct pen_session session;
	int code, r;

	if (!pen_session_open(&session, &workers_usage, argc, argv, &code))
		return code;
	r = show_table(&session, "/v1/workers", "workers", keys, sizeof keys / sizeof *keys);
	return pen_session_close(&session, r);
}
