/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/private_farm.h"

#include "core/base/clock.h"
#include "server/cli/interrupt.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <jansson.h>
#include <signal.h>
#include <spawn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { START_MS = 20000, STOP_MS = 10000, POLL_MS = 5, PATH_SIZE = 288, LINE_SIZE = 400 };

static void path_format(const struct pen_private_farm *farm, const char *name, char *ret_path)
{
	(void)snprintf(ret_path, PATH_SIZE, "%s/%s", farm->directory, name);
}

static int directory_create(struct pen_private_farm *farm, struct pen_error *err)
{
	const char *parent = getenv("TMPDIR");
	char template[sizeof farm->directory];
	int size = snprintf(template, sizeof template, "%s/penumbra-XXXXXX",
		parent && *parent ? parent : "/tmp");

	if (size < 0 || (size_t)size >= sizeof template)
		return pen_error_set(err, PEN_EIO, "TMPDIR is too long");
	if (!mkdtemp(template))
		return pen_error_system(err, errno, "create %s", template);
	(void)snprintf(farm->directory, sizeof farm->directory, "%s", template);
	return 0;
}

static int entry_remove(const char *path, const struct stat *status, int type, struct FTW *where)
{
	(void)status;
	(void)type;
	(void)where;
	(void)remove(path);
	return 0;
}

static void directory_remove(struct pen_private_farm *farm)
{
	if (*farm->directory)
		(void)nftw(farm->directory, entry_remove, 16, FTW_DEPTH | FTW_PHYS);
	farm->directory[0] = '\0';
}

/*
 * A process group of its own, so that the terminal's Ctrl-C reaches this process alone, which then
 * ends the farm in order; signals that this process catches or ignores as they are by default.
 */
static int attributes_init(posix_spawnattr_t *attributes)
{
	sigset_t defaults;
	int r = posix_spawnattr_init(attributes);

	if (r != 0)
		return r;
	(void)sigfillset(&defaults);
	(void)posix_spawnattr_setsigdefault(attributes, &defaults);
	(void)posix_spawnattr_setpgroup(attributes, 0);
	(void)posix_spawnattr_setflags(attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
	return 0;
}

static int coordinator_spawn(struct pen_private_farm *farm, char **arguments, struct pen_error *err)
{
	posix_spawn_file_actions_t actions;
	posix_spawnattr_t attributes;
	char log[PATH_SIZE];
	int r = attributes_init(&attributes);

	if (r != 0)
		return pen_error_system(err, r, "start a coordinator");
	r = posix_spawn_file_actions_init(&actions);
	if (r != 0)
		goto out;
	path_format(farm, "log", log);
	r = posix_spawn_file_actions_addopen(
		&actions, STDERR_FILENO, log, O_WRONLY | O_CREAT | O_APPEND, 0600);
	if (r == 0)
		r = posix_spawn_file_actions_addopen(
			&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
	if (r == 0)
		r = posix_spawn_file_actions_addopen(
			&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
	if (r == 0)
		r = posix_spawn(
			&farm->pid, "/proc/self/exe", &actions, &attributes, arguments, environ);
	(void)posix_spawn_file_actions_destroy(&actions);
out:
	(void)posix_spawnattr_destroy(&attributes);
	if (r != 0)
		farm->pid = 0;
	return r == 0 ? 0 : pen_error_system(err, r, "start a coordinator");
}

static int coordinator_start(struct pen_private_farm *farm,
	const struct pen_private_farm_options *options, struct pen_error *err)
{
	char data[PATH_SIZE], parent[32];
	const char *words[16] = {"penumbra", "serve", parent, "--data", data, "--listen",
		"127.0.0.1:0", "--worker-listen", "127.0.0.1:0"};
	char *arguments[16];
	size_t count = 9;

	path_format(farm, "data", data);
	(void)snprintf(parent, sizeof parent, "--parent-death=%ld", (long)getpid());
	if (options->processes) {
		words[count++] = "--processes";
		words[count++] = options->processes;
	}
	if (options->isa) {
		words[count++] = "--isa";
		words[count++] = options->isa;
	}
	/* exec takes pointers to plain char, but writes to none of them. */
	memcpy(arguments, words, sizeof arguments);
	/* A secret that is no business of what is started here. */
	(void)unsetenv("PENUMBRA_TOKEN");
	return coordinator_spawn(farm, arguments, err);
}

/* Whether the coordinator has ended; then it is reaped. */
static bool coordinator_ended(struct pen_private_farm *farm)
{
	if (farm->pid > 0 && waitpid(farm->pid, NULL, WNOHANG) != 0)
		farm->pid = 0;
	return farm->pid == 0;
}

/* The port in DATA/ports, which is renamed to its place when it is whole; 0 before that. */
static uint16_t port_read(const struct pen_private_farm *farm)
{
	char path[PATH_SIZE];
	json_int_t port;
	json_t *ports;

	path_format(farm, "data/ports", path);
	ports = json_load_file(path, 0, NULL);
	port = json_integer_value(json_object_get(ports, "http"));
	json_decref(ports);
	return port > 0 && port <= UINT16_MAX ? (uint16_t)port : 0;
}

static int coordinator_wait(struct pen_private_farm *farm, struct pen_error *err)
{
	int64_t deadline_ms = pen_clock_ms() + START_MS;

	while ((farm->port = port_read(farm)) == 0) {
		if (coordinator_ended(farm))
			return pen_error_set(err, PEN_EIO, "the coordinator ended at once");
		if (pen_interrupted())
			return pen_error_set(err, PEN_ECLOSED, "interrupted");
		if (pen_clock_ms() > deadline_ms)
			return pen_error_set(err, PEN_EIO, "the coordinator does not get ready");
		pen_interrupt_sleep(POLL_MS);
	}
	return 0;
}

int pen_private_farm_start(struct pen_private_farm *farm,
	const struct pen_private_farm_options *options, struct pen_error *err)
{
	int r;

	*farm = (struct pen_private_farm){0};
	r = directory_create(farm, err);
	if (r == 0)
		r = coordinator_start(farm, options, err);
	if (r == 0)
		r = coordinator_wait(farm, err);
	if (r < 0) {
		pen_private_farm_explain(farm, err);
		pen_private_farm_stop(farm);
	}
	return r;
}

/* The last line of a log, without time and level; false when there is none. */
static bool last_line_read(const char *path, char *ret_line)
{
	FILE *file = fopen(path, "re");
	char line[LINE_SIZE];
	bool found = false;

	if (!file)
		return false;
	while (fgets(line, sizeof line, file)) {
		const char *text = strstr(line, "] error: ");

		text = text ? text + strlen("] error: ") : line;
		if (*text == '\n')
			continue;
		(void)snprintf(ret_line, LINE_SIZE, "%.*s", (int)strcspn(text, "\n"), text);
		found = true;
	}
	(void)fclose(file);
	return found;
}

void pen_private_farm_explain(struct pen_private_farm *farm, struct pen_error *err)
{
	char path[PATH_SIZE], line[LINE_SIZE];

	path_format(farm, "log", path);
	if (coordinator_ended(farm) && last_line_read(path, line))
		(void)pen_error_set(err, PEN_EIO, "the coordinator ended: %s", line);
}

/* Not pen_interrupt_sleep: an interrupt must not turn this wait into a spin. */
static void wait_shortly(void)
{
	const struct timespec span = {.tv_nsec = POLL_MS * 1000000L};

	(void)nanosleep(&span, NULL);
}

void pen_private_farm_stop(struct pen_private_farm *farm)
{
	int64_t deadline_ms = pen_clock_ms() + STOP_MS;

	if (!coordinator_ended(farm))
		(void)kill(farm->pid, SIGTERM);
	while (!coordinator_ended(farm)) {
		if (pen_clock_ms() > deadline_ms)
			(void)kill(-farm->pid, SIGKILL);
		wait_shortly();
	}
	directory_remove(farm);
}
