/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/cli.h"
#include "server/cli/print.h"
#include "server/cli/session.h"

#include <stdio.h>
#include <string.h>

enum { ID_MAX = 20, PATH_SIZE = 64 };

static const char drain_help[] =
	"usage: penumbra drain [OPTION…] WORKER\n"
	"\n"
	"Gives a worker no more work; what it has begun it finishes. WORKER is an id that\n"
	"`penumbra workers` shows.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const char reset_help[] =
	"usage: penumbra reset [OPTION…] WORKER\n"
	"\n"
	"Gives a worker work again that was drained, or is in quarantine, and forgives its "
	"strikes.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const struct option options[] = {
	{"json", no_argument, NULL, PEN_OPTION_JSON},
	PEN_SERVER_OPTIONS,
	{"help", no_argument, NULL, PEN_OPTION_HELP},
	{0},
};

static const struct pen_usage drain_usage = {
	.command = "drain",
	.help = drain_help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "WORKER",
};

static const struct pen_usage reset_usage = {
	.command = "reset",
	.help = reset_help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "WORKER",
};

/* Only an id that is one becomes part of a path. */
static bool id_valid(const char *id)
{
	size_t length = strlen(id);

	return length >= 1 && length <= ID_MAX && strspn(id, "0123456789") == length;
}

static int post(struct pen_session *session, const char *verb)
{
	static const char letters[] = "abcdefghijklmnopqrstuvwxyz";
	const char *id = session->options.operand;
	char path[PATH_SIZE];
	const char *state;
	json_t *answer;
	int r;

	if (!id_valid(id))
		return pen_error_set(&session->err, PEN_ENOTFOUND, "'%.80s' is no worker's id", id);
	(void)snprintf(path, sizeof path, "/v1/workers/%s/%s", id, verb);
	r = pen_client_call(session->client, "POST", path, NULL, 0, &session->err);
	if (r < 0)
		return r;
	answer = pen_client_answer(session->client);
	state = json_string_value(json_object_get(answer, "state"));
	if (!state || strspn(state, letters) != strlen(state))
		return pen_error_set(&session->err, PEN_EIO, "the server's answer is no worker");
	if (session->options.json)
		pen_print_json(answer);
	else
		(void)printf("%s: %s\n", id, state);
	return 0;
}

static int change(const struct pen_usage *usage, int argc, char **argv)
{
	struct pen_session session;
	int code;

	if (!pen_session_open(&session, usage, argc, argv, &code))
		return code;
	return pen_session_close(&session, post(&session, usage->command));
}

int pen_cli_drain(int argc, char **argv)
{
	return change(&drain_usage, argc, argv);
}

int pen_cli_reset(int argc, char **argv)
{
	return change(&reset_usage, argc, argv);
}
