/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/log.h"
#include "server/cli/cli.h"
#include "server/config.h"
#include "server/loop.h"

#include <signal.h>
#include <stdio.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

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
	pen_log_open("penumbra", config.log_level);
	if (pen_server_run(&config, &err) < 0) {
		(void)fprintf(stderr, "penumbra: %s\n", err.text);
		return PEN_EXIT_FAILED;
	}
	return PEN_EXIT_OK;
}

int main(int argc, char **argv)
{
	static const struct pen_command serve_command = {
		"serve", "run the coordinator, with a farm on this machine", serve};

	return pen_cli_main(argc, argv, &serve_command);
}
