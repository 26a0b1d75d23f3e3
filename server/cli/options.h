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
	const char *server;		  /* URL */
	const char *token_file, *ca_file; /* NULL: not given */
	bool json, quiet;
	const char *outputs[PEN_OUTPUTS_MAX];
	size_t output_count;
	const char *processes, *isa; /* NULL: not given */
	double time, shutter;	     /* seconds; they are part of override in the end */
	json_t *override;	     /* merge patch onto the scene, or NULL */
	const char *operand;	     /* the first word that is no option, or NULL */
	const char *value;	     /* the second, or NULL */
};

/* What an option's val stands for in a command's table of struct option. */
enum pen_option {
	PEN_OPTION_HELP = 'h',
	PEN_OPTION_OUTPUT = 'o',
	PEN_OPTION_SERVER = 256,
	PEN_OPTION_TOKEN_FILE,
	PEN_OPTION_CA_FILE,
	PEN_OPTION_JSON,
	PEN_OPTION_QUIET,
	PEN_OPTION_PROCESSES,
	PEN_OPTION_ISA,
	PEN_OPTION_SAMPLES,
	PEN_OPTION_SIZE,
	PEN_OPTION_CROP,
	PEN_OPTION_FRAMES,
	PEN_OPTION_SEED,
	PEN_OPTION_MODE,
	PEN_OPTION_APERTURE_RADIUS,
	PEN_OPTION_FOCUS_DISTANCE,
	PEN_OPTION_TIME,
	PEN_OPTION_SHUTTER,
	PEN_OPTION_BACKGROUND
};

/* Options of whatever talks to a server: their rows in a command's table, their lines in its help.
 */
#define PEN_SERVER_OPTIONS                                                                         \
	{"server", required_argument, NULL, PEN_OPTION_SERVER},                                    \
		{"token-file", required_argument, NULL, PEN_OPTION_TOKEN_FILE},                    \
	{                                                                                          \
		"ca-file", required_argument, NULL, PEN_OPTION_CA_FILE                             \
	}
#define PEN_SERVER_OPTIONS_HELP                                                                    \
	"  --server URL         default: $PENUMBRA_SERVER or http://127.0.0.1:8080; or "           \
	"unix:PATH\n"                                                                              \
	"  --token-file FILE    what the server knows us by ($PENUMBRA_TOKEN_FILE, or the\n"       \
	"                       token itself in $PENUMBRA_TOKEN)\n"                                \
	"  --ca-file FILE       certificates to trust, or the server's own ($PENUMBRA_CA_FILE)\n"

/* Options that change the scene: their rows in a command's table, and their lines in its help. */
#define PEN_SCENE_OPTIONS                                                                          \
	{"samples", required_argument, NULL, PEN_OPTION_SAMPLES},                                  \
		{"size", required_argument, NULL, PEN_OPTION_SIZE},                                \
		{"crop", required_argument, NULL, PEN_OPTION_CROP},                                \
		{"seed", required_argument, NULL, PEN_OPTION_SEED},                                \
		{"frames", required_argument, NULL, PEN_OPTION_FRAMES},                            \
		{"mode", required_argument, NULL, PEN_OPTION_MODE},                                \
		{"aperture-radius", required_argument, NULL, PEN_OPTION_APERTURE_RADIUS},          \
		{"focus-distance", required_argument, NULL, PEN_OPTION_FOCUS_DISTANCE},            \
		{"time", required_argument, NULL, PEN_OPTION_TIME},                                \
		{"shutter", required_argument, NULL, PEN_OPTION_SHUTTER},                          \
	{                                                                                          \
		"background", required_argument, NULL, PEN_OPTION_BACKGROUND                       \
	}
#define PEN_SCENE_OPTIONS_HELP                                                                     \
	"  --samples N          samples per pixel, instead of the scene's\n"                       \
	"  --size WxH           image size in pixels, instead of the scene's\n"                    \
	"  --crop L,T,R,B       render these pixels only (right and bottom excluded)\n"            \
	"  --seed N             seed of the samples, instead of the scene's\n"                     \
	"  --frames A-B         frames A to B, instead of the scene's\n"                           \
	"  --mode NAME          uniform, edge, adaptive or interleaved\n"                          \
	"  --aperture-radius N  radius of the lens; 0 is a pinhole\n"                              \
	"  --focus-distance N   what lies there is sharp\n"                                        \
	"  --time N             second at which the shutter opens\n"                               \
	"  --shutter N          seconds that it stays open\n"                                      \
	"  --background R,G,B   radiance where nothing is, instead of the scene's background\n"

enum pen_operand { PEN_OPERAND_NONE, PEN_OPERAND_OPTIONAL, PEN_OPERAND_REQUIRED };

/* How one command is called. */
struct pen_usage {
	const char *command;
	const char *help;	      /* printed by --help */
	const char *letters;	      /* of the short options, as getopt takes them */
	const struct option *options; /* of the long ones; ends with {0} */
	enum pen_operand operand;
	const char *operand_name; /* "SCENE", for messages */
	const char *value_name;	  /* of a second operand, which is then required; NULL: none */
};

/*
 * Reads argv (argv[0] is the command). True: go on, and finish options in the end. False: the
 * command is over with *ret_exit, the help or the complaint is printed.
 */
bool pen_options_parse(struct pen_options *options, const struct pen_usage *usage, int argc,
	char **argv, int *ret_exit);

void pen_options_finish(struct pen_options *options);

#endif
