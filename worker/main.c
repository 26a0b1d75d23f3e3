/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "core/base/log.h"
#include "core/base/sandbox_probe.h"
#include "worker/config.h"
#include "worker/key.h"
#include "worker/pool.h"
#include "worker/zygote.h"

#include <malloc.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

/* Without an option for it there is none. */
static int read_key(
	const struct pen_worker_config *config, struct pen_key *ret_key, struct pen_error *err)
{
	int r = 0;

	if (config->key_fd >= 0)
		r = pen_key_read(config->key_fd, ret_key, err);
	else if (config->key_file)
		r = pen_key_read_file(config->key_file, ret_key, err);
	ret_key->is_single_use = config->key_fd >= 0;
	return r;
}

/* What this machine lacks is an error or a warning, as --sandbox has it. */
static int check_sandbox(enum pen_sandbox_mode mode, struct pen_error *err)
{
	struct pen_error fault = PEN_ERROR_INIT;
	int r = mode == PEN_SANDBOX_OFF ? 0 : pen_sandbox_probe(PEN_SANDBOX_SCENE, &fault);

	if (mode == PEN_SANDBOX_OFF)
		pen_log(PEN_LOG_WARNING, "--sandbox off: scenes are read with this user's rights");
	if (r == 0)
		return 0;
	if (mode == PEN_SANDBOX_REQUIRE)
		return pen_error_set(err, r,
			"%.300s; without it nothing is rendered for another machine, unless "
			"--sandbox best-effort says that this is meant",
			fault.text);
	pen_log(PEN_LOG_WARNING, "%s; going on with what there is", fault.text);
	return 0;
}

/* Else what a tile needs is given back to the system with each, and comes again page by page. */
static void keep_heap(void)
{
	(void)mallopt(M_MMAP_THRESHOLD, 2 * PEN_FRAME_PAYLOAD_MAX);
	(void)mallopt(M_TRIM_THRESHOLD, 4 * PEN_FRAME_PAYLOAD_MAX);
}

/* The zygote is forked before the key is read: it and all below it never see it. */
static int run(const struct pen_worker_config *config, struct pen_error *err)
{
	struct pen_key key = {.name = ""};
	struct pen_zygote zygote;
	int code = PEN_WORKER_FAILED;

	if (config->parent != 0 && pen_process_bind(config->parent, SIGKILL, err) < 0)
		return PEN_WORKER_FAILED;
	if (check_sandbox(config->sandbox, err) < 0)
		return PEN_WORKER_FAILED;
	if (pen_zygote_start(config, &zygote, err) < 0)
		return PEN_WORKER_FAILED;
	(void)signal(SIGPIPE, SIG_IGN);
	keep_heap();
	if (read_key(config, &key, err) == 0)
		code = pen_pool_run(config, &zygote, &key, err);
	explicit_bzero(&key, sizeof key);
	pen_zygote_stop(&zygote);
	return code;
}

int main(int argc, char **argv)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_worker_config config;
	int code;

	if (pen_worker_config_parse(argc, argv, &config, &err) < 0) {
		(void)fprintf(stderr, "penumbra-worker: %s\n", err.text);
		return PEN_WORKER_USAGE;
	}
	if (config.help || config.version) {
		(void)fputs(config.help ? pen_worker_config_usage()
					: "penumbra-worker " PEN_VERSION "\n",
			stdout);
		return PEN_WORKER_DONE;
	}
	pen_log_open("penumbra-worker", config.log_level, config.log_format);
	code = run(&config, &err);
	if (err.code != PEN_OK)
		pen_log(PEN_LOG_ERROR, "%s", err.text);
	return code;
}
