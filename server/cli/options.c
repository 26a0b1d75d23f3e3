/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/options.h"

#include "core/base/limits.h"
#include "core/base/text.h"
#include "server/cli/cli.h"
#include "server/cli/output.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char default_server[] = "http://127.0.0.1:8080";

/* Exactly count decimal numbers with the separator between them. */
static bool numbers_parse(const char *text, char separator, size_t count, uint32_t *ret_numbers)
{
	for (size_t i = 0; i < count; i++) {
		unsigned long long value;
		char *end;

		if (*text < '0' || *text > '9')
			return false;
		errno = 0;
		value = strtoull(text, &end, 10);
		if (errno || value > UINT32_MAX || *end != (i + 1 < count ? separator : '\0'))
			return false;
		ret_numbers[i] = (uint32_t)value;
		text = end + 1;
	}
	return true;
}

/* patch.section.key = value, which is consumed. */
static void override_set(
	struct pen_options *options, const char *section, const char *key, json_t *value)
{
	json_t *members;

	if (!options->override)
		options->override = json_object();
	members = json_object_get(options->override, section);
	if (!members) {
		members = json_object();
		(void)json_object_set_new(options->override, section, members);
	}
	(void)json_object_set_new(members, key, value);
}

static bool output_add(struct pen_options *options, const char *path)
{
	enum pen_image_format format;

	if (options->output_count == PEN_OUTPUTS_MAX || !pen_output_format(path, &format))
		return false;
	options->outputs[options->output_count++] = path;
	return true;
}

/* The scene's own background, whatever it is, gives way. */
static void background_set(struct pen_options *options, const double *color)
{
	override_set(
		options, "background", "color", json_pack("[f,f,f]", color[0], color[1], color[2]));
	override_set(options, "background", "image", json_null());
	override_set(options, "background", "intensity", json_null());
	override_set(options, "background", "rotation", json_null());
}

static void shutter_set(struct pen_options *options)
{
	override_set(options, "camera", "shutter",
		json_pack("{s:f,s:f}", "open", options->time, "close",
			options->time + options->shutter));
}

/* As override_read, of the options whose values are no whole numbers. */
static bool reals_read(struct pen_options *options, int option, const char *text)
{
	double n[3];

	if (!pen_text_reals(text, option == PEN_OPTION_BACKGROUND ? 3 : 1, n))
		return false;
	switch (option) {
	case PEN_OPTION_APERTURE_RADIUS:
		override_set(options, "camera", "aperture_radius", json_real(n[0]));
		break;
	case PEN_OPTION_FOCUS_DISTANCE:
		override_set(options, "camera", "focus_distance", json_real(n[0]));
		break;
	case PEN_OPTION_TIME:
		options->time = n[0];
		shutter_set(options);
		break;
	case PEN_OPTION_SHUTTER:
		options->shutter = n[0];
		shutter_set(options);
		break;
	default: background_set(options, n); break;
	}
	return true;
}

/* What the scene says for another mode gives way with it. */
static bool mode_read(struct pen_options *options, const char *text)
{
	static const struct {
		const char *name, *keys[4];
	} modes[] = {
		{"uniform", {NULL}},
		{"edge", {"threshold"}},
		{"adaptive", {"error", "confidence", "min_samples"}},
		{"interleaved", {"pattern"}},
	};
	bool found = false;

	for (size_t i = 0; i < sizeof modes / sizeof *modes; i++) {
		if (strcmp(text, modes[i].name) == 0) {
			override_set(options, "sampling", "mode", json_string(text));
			found = true;
			continue;
		}
		for (const char *const *key = modes[i].keys; *key; key++)
			override_set(options, "sampling", *key, json_null());
	}
	return found;
}

/* Numbers are only read here: whether they make sense together is the server's to say. */
static bool override_read(struct pen_options *options, int option, const char *text)
{
	uint32_t n[4];

	switch (option) {
	case PEN_OPTION_SAMPLES:
	case PEN_OPTION_SEED:
		if (!numbers_parse(text, '\0', 1, n))
			return false;
		override_set(options, "sampling", option == PEN_OPTION_SEED ? "seed" : "samples",
			json_integer(n[0]));
		return true;
	case PEN_OPTION_SIZE:
		if (!numbers_parse(text, 'x', 2, n))
			return false;
		override_set(options, "image", "width", json_integer(n[0]));
		override_set(options, "image", "height", json_integer(n[1]));
		return true;
	case PEN_OPTION_FRAMES:
		if (!numbers_parse(text, '-', 2, n))
			return false;
		override_set(options, "frames", "first", json_integer(n[0]));
		override_set(options, "frames", "last", json_integer(n[1]));
		return true;
	case PEN_OPTION_MODE: return mode_read(options, text);
	case PEN_OPTION_APERTURE_RADIUS:
	case PEN_OPTION_FOCUS_DISTANCE:
	case PEN_OPTION_TIME:
	case PEN_OPTION_SHUTTER:
	case PEN_OPTION_BACKGROUND: return reals_read(options, option, text);
	default:
		if (!numbers_parse(text, ',', 4, n))
			return false;
		override_set(options, "image", "crop",
			json_pack("[I,I,I,I]", (json_int_t)n[0], (json_int_t)n[1], (json_int_t)n[2],
				(json_int_t)n[3]));
		return true;
	}
}

static bool processes_valid(const char *text)
{
	uint32_t count;

	return numbers_parse(text, '\0', 1, &count) && count >= 1 && count <= PEN_PROCESSES_MAX;
}

static bool isa_valid(const char *text)
{
	return strcmp(text, "v2") == 0 || strcmp(text, "v3") == 0 || strcmp(text, "v4") == 0;
}

/* False: the value is no value of the option. */
static bool option_read(struct pen_options *options, int option, const char *value)
{
	switch (option) {
	case PEN_OPTION_SERVER: options->server = value; return *value != '\0';
	case PEN_OPTION_TOKEN_FILE: options->token_file = value; return *value != '\0';
	case PEN_OPTION_CA_FILE: options->ca_file = value; return *value != '\0';
	case PEN_OPTION_JSON: options->json = true; return true;
	case PEN_OPTION_QUIET: options->quiet = true; return true;
	case PEN_OPTION_OUTPUT: return output_add(options, value);
	case PEN_OPTION_PROCESSES: options->processes = value; return processes_valid(value);
	case PEN_OPTION_ISA: options->isa = value; return isa_valid(value);
	default: return override_read(options, option, value);
	}
}

static const char *expected(int option)
{
	switch (option) {
	case PEN_OPTION_OUTPUT: return "at most 8 files, each .png, .exr, .jpg or .hdr";
	case PEN_OPTION_PROCESSES: return "a number from 1 to 256";
	case PEN_OPTION_ISA: return "v2, v3 or v4";
	case PEN_OPTION_SIZE: return "WIDTHxHEIGHT in pixels";
	case PEN_OPTION_FRAMES: return "FIRST-LAST";
	case PEN_OPTION_CROP: return "LEFT,TOP,RIGHT,BOTTOM in pixels";
	case PEN_OPTION_SERVER: return "a URL";
	case PEN_OPTION_TOKEN_FILE:
	case PEN_OPTION_CA_FILE: return "a file";
	case PEN_OPTION_MODE: return "uniform, edge, adaptive or interleaved";
	case PEN_OPTION_APERTURE_RADIUS:
	case PEN_OPTION_FOCUS_DISTANCE: return "a length";
	case PEN_OPTION_TIME:
	case PEN_OPTION_SHUTTER: return "a number of seconds";
	case PEN_OPTION_BACKGROUND: return "RED,GREEN,BLUE";
	default: return "a whole number below 2^32";
	}
}

/* 0, PEN_OPTION_HELP, or the negative exit code of a complaint. */
static int words_read(
	struct pen_options *options, const struct pen_usage *usage, int argc, char **argv)
{
	int option;

	opterr = 0;
	while ((option = getopt_long(argc, argv, usage->letters, usage->options, NULL)) != -1) {
		if (option == PEN_OPTION_HELP)
			return PEN_OPTION_HELP;
		if (option == ':')
			return -pen_cli_usage(usage->command, "%s needs a value", argv[optind - 1]);
		if (option == '?')
			return -pen_cli_usage(
				usage->command, "unknown option %s", argv[optind - 1]);
		if (!option_read(options, option, optarg))
			return -pen_cli_usage(usage->command,
				"'%s' is not what the option takes: %s", optarg, expected(option));
	}
	return 0;
}

static int operand_read(
	struct pen_options *options, const struct pen_usage *usage, int argc, char **argv)
{
	int count = argc - optind;

	if (count < (usage->operand == PEN_OPERAND_REQUIRED))
		return pen_cli_usage(usage->command, "%s is missing", usage->operand_name);
	if (usage->value_name && count < 2)
		return pen_cli_usage(usage->command, "%s is missing", usage->value_name);
	if (count > (usage->operand != PEN_OPERAND_NONE) + (usage->value_name != NULL))
		return pen_cli_usage(usage->command, "'%s' is one word too many", argv[argc - 1]);
	options->operand = count > 0 ? argv[optind] : NULL;
	options->value = count > 1 ? argv[optind + 1] : NULL;
	return PEN_EXIT_OK;
}

bool pen_options_parse(struct pen_options *options, const struct pen_usage *usage, int argc,
	char **argv, int *ret_exit)
{
	const char *server = getenv("PENUMBRA_SERVER");
	int r;

	*options = (struct pen_options){.server = server && *server ? server : default_server};
	r = words_read(options, usage, argc, argv);
	if (r == PEN_OPTION_HELP) {
		(void)fputs(usage->help, stdout);
		*ret_exit = PEN_EXIT_OK;
		pen_options_finish(options);
		return false;
	}
	*ret_exit = r < 0 ? -r : operand_read(options, usage, argc, argv);
	if (*ret_exit == PEN_EXIT_OK)
		return true;
	pen_options_finish(options);
	return false;
}

void pen_options_finish(struct pen_options *options)
{
	json_decref(options->override);
	options->override = NULL;
}
