/* SPDX-License-Identifier: Apache-2.0 */
#include "server/spawn.h"

#include "core/base/clock.h"
#include "server/config.h"
#include "server/sibling.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PAUSE_MS_MIN = 100, PAUSE_MS_MAX = 30000, KILL_MS = 3000, KEY_FD = 3, ARGUMENTS_MAX = 18 };

struct pen_spawn {
	uv_process_t process;
	uv_timer_t timer; /* of the next start, or of the kill */
	struct pen_spawn_options options;
	char program[PATH_MAX];
	bool running;
	bool stopping;
	unsigned open_handles;
	unsigned pause_ms;
	int64_t started_ms;
};

static int start_worker(struct pen_spawn *spawn, struct pen_error *err);

static void handle_closed(uv_handle_t *handle)
{
	struct pen_spawn *spawn = handle->data;

	if (--spawn->open_handles == 0)
		free(spawn);
}

static void handle_restart(uv_timer_t *timer)
{
	struct pen_spawn *spawn = timer->data;
	struct pen_error err;

	if (start_worker(spawn, &err) < 0)
		pen_log(PEN_LOG_ERROR, "%s", err.text);
}

/* One that ran for a while gets the short pause again. */
static void schedule_restart(struct pen_spawn *spawn)
{
	if (pen_clock_ms() - spawn->started_ms > PAUSE_MS_MAX)
		spawn->pause_ms = PAUSE_MS_MIN;
	(void)uv_timer_start(&spawn->timer, handle_restart, spawn->pause_ms, 0);
	spawn->pause_ms = spawn->pause_ms < PAUSE_MS_MAX / 2 ? 2 * spawn->pause_ms : PAUSE_MS_MAX;
}

static void handle_exit(uv_process_t *process, int64_t status, int signal_number)
{
	struct pen_spawn *spawn = process->data;

	spawn->running = false;
	uv_close((uv_handle_t *)process, handle_closed);
	if (spawn->stopping) {
		uv_close((uv_handle_t *)&spawn->timer, handle_closed);
		return;
	}
	pen_log(PEN_LOG_WARNING, "the local worker ended (status %lld, signal %d)",
		(long long)status, signal_number);
	schedule_restart(spawn);
}

/* The reading end of a pipe that holds the key and nothing more. */
static int open_key(struct pen_spawn *spawn, int *ret_fd, struct pen_error *err)
{
	char key[PEN_WORKER_KEY_TEXT];
	int fds[2];
	int r = pen_farm_issue_key(spawn->options.farm, key, err);

	if (r < 0)
		return r;
	if (pipe2(fds, O_CLOEXEC) < 0)
		return pen_error_system(err, errno, "cannot make a pipe");
	if (write(fds[1], key, strlen(key)) != (ssize_t)strlen(key))
		r = pen_error_system(err, errno, "cannot write the key");
	explicit_bzero(key, sizeof key);
	(void)close(fds[1]);
	if (r < 0)
		(void)close(fds[0]);
	else
		*ret_fd = fds[0];
	return r;
}

static int spawn_process(struct pen_spawn *spawn, int key_fd)
{
	char address[64], processes[16], parent[32];
	const char *arguments[ARGUMENTS_MAX] = {"penumbra-worker", "--connect", address,
		"--processes", processes, "--key-fd", "3", parent, "--log-level",
		pen_log_level_name(spawn->options.log_level), "--log-format",
		pen_log_format_name(spawn->options.log_format), "--sandbox",
		pen_sandbox_mode_name(spawn->options.sandbox)};
	size_t count = 14;
	uv_stdio_container_t stdio[KEY_FD + 1] = {
		{.flags = UV_IGNORE},
		{.flags = UV_INHERIT_FD, .data.fd = STDERR_FILENO},
		{.flags = UV_INHERIT_FD, .data.fd = STDERR_FILENO},
		{.flags = UV_INHERIT_FD, .data.fd = key_fd},
	};
	uv_process_options_t process = {
		.exit_cb = handle_exit,
		.file = spawn->program,
		.args = (char **)(uintptr_t)arguments,
		.stdio = stdio,
		.stdio_count = KEY_FD + 1,
	};

	if (spawn->options.isa) {
		arguments[count++] = "--isa";
		arguments[count++] = spawn->options.isa;
	}
	(void)snprintf(address, sizeof address, "%s:%u", spawn->options.host,
		pen_farm_port(spawn->options.farm));
	(void)snprintf(parent, sizeof parent, "--parent-death=%ld", (long)getpid());
	(void)snprintf(processes, sizeof processes, "%u", spawn->options.processes);
	return uv_spawn(spawn->timer.loop, &spawn->process, &process);
}

static int start_worker(struct pen_spawn *spawn, struct pen_error *err)
{
	int key_fd = -1;
	int r = open_key(spawn, &key_fd, err);

	if (r < 0)
		return r;
	spawn->started_ms = pen_clock_ms();
	spawn->process.data = spawn;
	r = spawn_process(spawn, key_fd);
	(void)close(key_fd);
	/* Even when it fails uv_spawn leaves a handle to close. */
	spawn->open_handles++;
	if (r < 0) {
		uv_close((uv_handle_t *)&spawn->process, handle_closed);
		schedule_restart(spawn);
		return pen_error_set(
			err, PEN_EIO, "cannot start %s: %s", spawn->program, uv_strerror(r));
	}
	spawn->running = true;
	return 0;
}

int pen_spawn_create(uv_loop_t *loop, const struct pen_spawn_options *options,
	struct pen_spawn **ret_spawn, struct pen_error *err)
{
	struct pen_spawn *spawn = calloc(1, sizeof *spawn);
	int r;

	if (!spawn)
		return pen_error_memory(err);
	spawn->options = *options;
	spawn->pause_ms = PAUSE_MS_MIN;
	pen_sibling_path("penumbra-worker", spawn->program, sizeof spawn->program);
	(void)uv_timer_init(loop, &spawn->timer);
	spawn->timer.data = spawn;
	spawn->open_handles = 1;
	r = start_worker(spawn, err);
	if (r < 0) {
		pen_spawn_destroy(spawn);
		return r;
	}
	*ret_spawn = spawn;
	return 0;
}

static void handle_kill(uv_timer_t *timer)
{
	struct pen_spawn *spawn = timer->data;

	(void)uv_process_kill(&spawn->process, SIGKILL);
}

void pen_spawn_destroy(struct pen_spawn *spawn)
{
	if (!spawn)
		return;
	spawn->stopping = true;
	if (!spawn->running) {
		uv_close((uv_handle_t *)&spawn->timer, handle_closed);
		return;
	}
	(void)uv_process_kill(&spawn->process, SIGTERM);
	(void)uv_timer_start(&spawn->timer, handle_kill, KILL_MS, 0);
}
