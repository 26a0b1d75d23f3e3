/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_OPTIONS_H
#define PEN_SERVER_CLI_OPTIONS_H

#include <getopt.h>
#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

enum { PEN_OUTPUTS_MAX = 8 };

/* The command line of any client command; what a command does not take stays at its default. */
struct pen_options {
	const char *server; /* URL */
	bool json, quiet;
	const char *outputs[PEN_OUTPUTS_MAX];
	size_t output_count;
	const char *processes, *isa; /* NULL: not given */
	json_t *override;	     /* merge patch onto the scene, or NULL */
	const char *operand;	     /* the one word that is no option, or NULL */
};

/* What an option's val stands for in a command's table of struct option. */
enum pen_option {
	PEN_OPTION_HELP = 'h',
	PEN_OPTION_OUTPUT = 'o',
	PEN_OPTION_SERVER = 256,
	PEN_OPTION_JSON,
	PEN_OPTION_QUIET,
	PEN_OPTION_PROCESSES,
	PEN_OPTION_ISA,
	PEN_OPTION_SAMPLES,
	PEN_OPTION_SIZE,
	PEN_OPTION_CROP,
	PEN_OPTION_SEED
};

enum pen_operand { PEN_OPERAND_NONE, PEN_OPERAND_OPTIONAL, PEN_OPERAND_REQUIRED };

/* How one command is called. */
struct pen_usage {
	const char *command;
	const char *help;	      /* printed by --help */
	const char *letters;	      /* of the short options, as getopt takes them */
	const struct option *options; /* of the long ones; ends with {0} */
	enum pen_operand operand;
	const char *operand_name; /* "SCENE", for messages */
};

/*
 * Reads argv (argv[0] is the command). True: go on, and finish options in the end. False: the
 * command is over with *ret_exit, the help or the complaint is printed.
 */
bool pen_options_parse(struct pen_options *options, const struct pen_usage *usage, int argc,
	char **argv, int *ret_exit);

void pen_options_finish(struct pen_options *options);

#endif
