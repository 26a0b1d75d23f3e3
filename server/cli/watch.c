/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/cli.h"
#include "server/cli/print.h"
#include "server/cli/renders.h"
#include "server/cli/session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { INTERVAL_MS = 200, PATIENCE_MS = 30000, PRIORITY_MAX = 100 };

static const char watch_help[] =
	"usage: penumbra watch [OPTION…] ID\n"
	"\n"
	"Follows a render until it ends; fails when it does not end well. Ctrl-C stops watching, "
	"not\n"
	"the render. A server that goes away is waited for, half a minute long.\n"
	"\n"
	"  --quiet         no progress\n"
	"  --json               print the render in the end as JSON\n" PEN_SERVER_OPTIONS_HELP;

static const char cancel_help[] =
	"usage: penumbra cancel [OPTION…] ID\n"
	"\n"
	"Stops a render. What is rendered of its image stays.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const char pause_help[] =
	"usage: penumbra pause [OPTION…] ID\n"
	"\n"
	"Has a render wait, without giving up what is rendered, until it is resumed.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const char resume_help[] =
	"usage: penumbra resume [OPTION…] ID\n"
	"\n"
	"Has a paused render go on.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const char priority_help[] =
	"usage: penumbra priority [OPTION…] ID N\n"
	"\n"
	"Has a render go before those of lower priority: 0 to 100, 50 when nobody says.\n"
	"\n"
	"  --json               print the server's whole answer\n" PEN_SERVER_OPTIONS_HELP;

static const struct option options[] = {
	{"json", no_argument, NULL, PEN_OPTION_JSON},
	PEN_SERVER_OPTIONS,
	{"help", no_argument, NULL, PEN_OPTION_HELP},
	{"quiet", no_argument, NULL, PEN_OPTION_QUIET},
	{0},
};

static const struct pen_usage watch_usage = {
	.command = "watch",
	.help = watch_help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "ID",
};

static const struct pen_usage cancel_usage = {
	.command = "cancel",
	.help = cancel_help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "ID",
};

static const struct pen_usage pause_usage = {
	.command = "pause",
	.help = pause_help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "ID",
};

static const struct pen_usage resume_usage = {
	.command = "resume",
	.help = resume_help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "ID",
};

static const struct pen_usage priority_usage = {
	.command = "priority",
	.help = priority_help,
	.letters = ":h",
	.options = options,
	.operand = PEN_OPERAND_REQUIRED,
	.operand_name = "ID",
	.value_name = "N",
};

static int follow(struct pen_session *session, struct pen_resource *resource)
{
	struct pen_progress progress;
	const struct pen_follow manner = {
		.interval_ms = INTERVAL_MS, .patience_ms = PATIENCE_MS, .progress = &progress};
	const char *id = session->options.operand;
	int r = pen_renders_get(session->client, id, resource, &session->err);

	if (r < 0)
		return r;
	pen_progress_init(&progress, session->options.quiet);
	r = pen_renders_follow(session->client, &manner, resource, &session->err);
	pen_progress_finish(&progress);
	return r < 0 ? r : pen_renders_outcome(session->client, resource, &session->err);
}

int pen_cli_watch(int argc, char **argv)
{
	struct pen_resource resource;
	struct pen_session session;
	int code, r;

	if (!pen_session_open(&session, &watch_usage, argc, argv, &code))
		return code;
	r = follow(&session, &resource);
	if (r == 0 && !session.options.quiet)
		pen_print_warnings(
			pen_client_answer(session.client), "penumbra: warning: ", stderr);
	if (session.options.json && pen_client_answer(session.client))
		pen_print_json(pen_client_answer(session.client));
	else if (r == 0)
		(void)printf("%s: done in %.2f s\n", resource.id, resource.seconds);
	return pen_session_close(&session, r);
}

static int change_state(const struct pen_usage *usage, const char *state, int argc, char **argv)
{
	struct pen_resource resource;
	struct pen_session session;
	int code, r;

	if (!pen_session_open(&session, usage, argc, argv, &code))
		return code;
	r = pen_renders_set_state(
		session.client, session.options.operand, state, &resource, &session.err);
	if (r == 0 && session.options.json)
		pen_print_json(pen_client_answer(session.client));
	else if (r == 0)
		(void)printf("%s: %s\n", resource.id, resource.state);
	return pen_session_close(&session, r);
}

int pen_cli_cancel(int argc, char **argv)
{
	return change_state(&cancel_usage, "cancelled", argc, argv);
}

int pen_cli_pause(int argc, char **argv)
{
	return change_state(&pause_usage, "paused", argc, argv);
}

int pen_cli_resume(int argc, char **argv)
{
	return change_state(&resume_usage, "running", argc, argv);
}

/* text is one to three digits, nothing else. */
static bool priority_parse(const char *text, unsigned *ret_priority)
{
	size_t length = strspn(text, "0123456789");

	if (length == 0 || length > 3 || text[length] != '\0')
		return false;
	*ret_priority = (unsigned)strtoul(text, NULL, 10);
	return *ret_priority <= PRIORITY_MAX;
}

int pen_cli_priority(int argc, char **argv)
{
	struct pen_resource resource;
	struct pen_session session;
	unsigned priority;
	int code, r;

	if (!pen_session_open(&session, &priority_usage, argc, argv, &code))
		return code;
	if (!priority_parse(session.options.value, &priority)) {
		code = pen_cli_usage(
			"priority", "'%s' is no priority from 0 to 100", session.options.value);
		(void)pen_session_close(&session, 0);
		return code;
	}
	r = pen_renders_set_priority(
		session.client, session.options.operand, priority, &resource, &session.err);
	if (r == 0 && session.options.json)
		pen_print_json(pen_client_answer(session.client));
	else if (r == 0)
		(void)printf("%s: priority %u\n", resource.id, priority);
	return pen_session_close(&session, r);
}
