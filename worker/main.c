/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/digest.h"
#include "core/base/log.h"
#include "core/base/sandbox.h"
#include "worker/config.h"
#include "worker/pool.h"
#include "worker/zygote.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* 64 hex digits, then the pipe's end or a newline. */
static int read_key(int fd, char *ret_key, struct pen_error *err)
{
	char key[PEN_SHA256_TEXT] = "";
	struct pen_sha256 parsed;
	size_t size = 0;
	ssize_t r = 1;

	while (size < sizeof key - 1 && r > 0) {
		r = read(fd, key + size, sizeof key - 1 - size);
		if (r < 0 && errno == EINTR)
			r = 1;
		else if (r > 0)
			size += (size_t)r;
	}
	(void)close(fd);
	if (size != sizeof key - 1 || !pen_sha256_parse(key, &parsed))
		return pen_error_set(err, PEN_EINVALID, "--key-fd: no key of 64 hex digits");
	memcpy(ret_key, key, sizeof key);
	return 0;
}

/* The zygote is forked before the key is read: it and all below it never see it. */
static int run(const struct pen_worker_config *config, struct pen_error *err)
{
	char key[PEN_SHA256_TEXT] = "";
	struct pen_zygote zygote;
	int code = PEN_WORKER_FAILED;

	if (config->parent != 0 && pen_process_bind(config->parent, SIGKILL, err) < 0)
		return PEN_WORKER_FAILED;
	if (pen_zygote_start(config, &zygote, err) < 0)
		return PEN_WORKER_FAILED;
	(void)signal(SIGPIPE, SIG_IGN);
	if (config->key_fd < 0 || read_key(config->key_fd, key, err) == 0)
		code = pen_pool_run(config, &zygote, key, err);
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
	pen_log_open("penumbra-worker", config.log_level);
	code = run(&config, &err);
	if (err.code != PEN_OK)
		pen_log(PEN_LOG_ERROR, "%s", err.text);
	return code;
}
