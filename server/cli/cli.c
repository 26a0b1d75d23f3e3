/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/cli.h"

#include "server/cli/interrupt.h"
#include "server/cli/print.h"

#include <jansson.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static int version_main(int argc, char **argv)
{
	(void)argc;
	(void)argv;
	(void)printf("penumbra %s\n", PEN_VERSION);
	return PEN_EXIT_OK;
}

static const struct pen_command commands[] = {
	{"render", "render a scene on this machine and write the image", pen_cli_render},
	{"submit", "hand a scene to a server and print the render's id", pen_cli_submit},
	{"status", "show a render, or the whole farm", pen_cli_status},
	{"list", "show the renders, newest first", pen_cli_list},
	{"watch", "follow a render until it ends", pen_cli_watch},
	{"cancel", "stop a render; its partial image stays", pen_cli_cancel},
	{"pause", "have a render wait", pen_cli_pause},
	{"resume", "have a paused render go on", pen_cli_resume},
	{"priority", "have a render go before others, or after them", pen_cli_priority},
	{"workers", "show the workers", pen_cli_workers},
	{"drain", "give a worker no more work", pen_cli_drain},
	{"reset", "give a worker work again, its strikes forgiven", pen_cli_reset},
	{"version", "print the version", version_main},
};

enum { COMMAND_COUNT = sizeof commands / sizeof *commands };

static void help_print(FILE *out, const struct pen_command *more)
{
	(void)fprintf(out, "usage: penumbra COMMAND [OPTION…]\n\n");
	for (size_t i = 0; i < COMMAND_COUNT; i++)
		(void)fprintf(out, "  %-8s  %s\n", commands[i].name, commands[i].help);
	for (; more->name; more++)
		(void)fprintf(out, "  %-8s  %s\n", more->name, more->help);
	(void)fprintf(out, "\n`penumbra COMMAND --help` shows a command's options.\n");
}

static const struct pen_command *command_find(const char *name, const struct pen_command *more)
{
	for (; more->name; more++)
		if (strcmp(name, more->name) == 0)
			return more;
	if (strcmp(name, "--version") == 0)
		name = "version";
	for (size_t i = 0; i < COMMAND_COUNT; i++)
		if (strcmp(name, commands[i].name) == 0)
			return &commands[i];
	return NULL;
}

int pen_cli_main(int argc, char **argv, const struct pen_command *more)
{
	const struct pen_command *command;

	if (argc < 2) {
		help_print(stderr, more);
		return PEN_EXIT_USAGE;
	}
	if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "help") == 0) {
		help_print(stdout, more);
		return PEN_EXIT_OK;
	}
	command = command_find(argv[1], more);
	if (!command) {
		(void)fprintf(stderr, "penumbra: no command '%s'\n\n", argv[1]);
		help_print(stderr, more);
		return PEN_EXIT_USAGE;
	}
	return command->main(argc - 1, argv + 1);
}

int pen_cli_usage(const char *command, const char *format, ...)
{
	va_list args;

	(void)fputs("penumbra: ", stderr);
	va_start(args, format);
	(void)vfprintf(stderr, format, args);
	va_end(args);
	(void)fprintf(stderr, "\nSee `penumbra %s --help`.\n", command);
	return PEN_EXIT_USAGE;
}

int pen_cli_fail(const struct pen_client *client, const struct pen_error *err)
{
	if (pen_interrupted()) {
		(void)fprintf(stderr, "penumbra: interrupted\n");
		return PEN_EXIT_INTERRUPTED;
	}
	(void)fprintf(stderr, "penumbra: %s\n", err->text);
	if (client)
		pen_print_errors(pen_client_answer(client), stderr);
	switch (err->code) {
	case PEN_ECLOSED: return PEN_EXIT_UNREACHABLE;
	case PEN_EINVALID:
	case PEN_ELIMIT: return PEN_EXIT_REFUSED;
	default: return PEN_EXIT_FAILED;
	}
}
