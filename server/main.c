/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/log.h"
#include "server/access.h"
#include "server/care.h"
#include "server/cli/cli.h"
#include "server/config.h"
#include "server/loop.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

/* Where the package puts it, and its unit reads it. */
#define USUAL_FILE "/etc/penumbra/penumbra.conf"

/* Ends with SIGTERM when the parent does, also when that has happened already. */
static void follow_parent(pid_t parent)
{
	(void)prctl(PR_SET_PDEATHSIG, SIGTERM);
	if (getppid() != parent)
		(void)raise(SIGTERM);
}

static int serve(int argc, char **argv)
{
	struct pen_config config;
	struct pen_error err;

	if (pen_config_parse(argc, argv, &config, &err) < 0)
		return pen_cli_usage("serve", "%s", err.text);
	if (config.help) {
		(void)fputs(pen_config_usage, stdout);
		return PEN_EXIT_OK;
	}
	if (config.parent != 0)
		follow_parent(config.parent);
	(void)umask(077);
	pen_log_open("penumbra", config.log_level, config.log_format);
	if (pen_server_run(&config, &err) < 0) {
		(void)fprintf(stderr, "penumbra: %s\n", err.text);
		return PEN_EXIT_FAILED;
	}
	return PEN_EXIT_OK;
}

static const char config_usage[] =
	"usage: penumbra config check [FILE]\n"
	"Say whether `penumbra serve` accepts a configuration file, and what is wrong where.\n"
	"\n"
	"  FILE    instead of $PENUMBRA_CONFIG, or else " USUAL_FILE "\n"
	"  --help  print this\n";

static int config_check(int argc, char **argv)
{
	const char *usual = getenv("PENUMBRA_CONFIG"), *path;
	struct pen_error err;

	if (argc == 2 && strcmp(argv[1], "--help") == 0) {
		(void)fputs(config_usage, stdout);
		return PEN_EXIT_OK;
	}
	if (argc < 2 || argc > 3 || strcmp(argv[1], "check") != 0)
		return pen_cli_usage("config", "config takes check and a file");
	if (argc == 3)
		path = argv[2];
	else
		path = usual && *usual != '\0' ? usual : USUAL_FILE;
	if (pen_config_check(path, &err) < 0) {
		(void)fprintf(stderr, "penumbra: %s\n", err.text);
		return PEN_EXIT_FAILED;
	}
	(void)printf("%s: correct\n", path);
	return PEN_EXIT_OK;
}

int main(int argc, char **argv)
{
	static const struct pen_command commands[] = {
		{"serve", "run the coordinator, with a farm on this machine", serve},
		{"fsck", "look for damage in a data directory, and repair it", pen_care_fsck},
		{"backup", "copy a data directory, also of a running coordinator", pen_care_backup},
		{"restore", "check a backup and copy it back", pen_care_restore},
		{"token", "say who may use a coordinator", pen_access_token},
		{"worker", "say which workers may join a coordinator", pen_access_worker},
		{"cert", "make a certificate for a coordinator", pen_access_cert},
		{"config", "check a configuration file of serve", config_check},
		{0},
	};

	return pen_cli_main(argc, argv, commands);
}
