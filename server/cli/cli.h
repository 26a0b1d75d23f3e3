/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_CLI_H
#define PEN_SERVER_CLI_CLI_H

#include "core/base/error.h"
#include "server/cli/client.h"

/* What the command ends with; deploy/man/penumbra.1 promises the same. */
enum pen_exit {
	PEN_EXIT_OK = 0,
	PEN_EXIT_FAILED = 1,
	PEN_EXIT_USAGE = 2,
	PEN_EXIT_UNREACHABLE = 3, /* no server answers */
	PEN_EXIT_REFUSED = 4,	  /* the scene is not accepted */
	PEN_EXIT_INTERRUPTED = 130
};

/* One word behind `penumbra`. main gets argv[0] = that word and returns an exit code. */
struct pen_command {
	const char *name;
	const char *help; /* one line */
	int (*main)(int argc, char **argv);
};

/*
 * The whole `penumbra` command: finds the word in argv[1] among the client's commands and more,
 * those of the coordinator, which are given from above because it is no business of the client.
 * more ends with a row of zeros.
 */
int pen_cli_main(int argc, char **argv, const struct pen_command *more);

int pen_cli_render(int argc, char **argv);
int pen_cli_submit(int argc, char **argv);
int pen_cli_status(int argc, char **argv);
int pen_cli_list(int argc, char **argv);
int pen_cli_watch(int argc, char **argv);
int pen_cli_cancel(int argc, char **argv);
int pen_cli_pause(int argc, char **argv);
int pen_cli_resume(int argc, char **argv);
int pen_cli_priority(int argc, char **argv);
int pen_cli_workers(int argc, char **argv);
int pen_cli_drain(int argc, char **argv);
int pen_cli_reset(int argc, char **argv);

/* Prints "penumbra: text" and how to get help on standard error; PEN_EXIT_USAGE. */
int pen_cli_usage(const char *command, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

/*
 * Prints err, and below it each offender that client's last answer lists, on standard error.
 * client may be NULL. Returns the exit code that fits, PEN_EXIT_INTERRUPTED after a signal.
 */
int pen_cli_fail(const struct pen_client *client, const struct pen_error *err);

#endif
