/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/sandbox.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/*
 * Enters an encoder's sandbox as far as this kernel has one, in a child for each of a few acts, and
 * prints how each ended: "open: EACCES", "bind: SIGSYS", "kill: possible".
 */

static int open_file(void)
{
	return open("/etc/passwd", O_RDONLY | O_CLOEXEC);
}

static int make_directory(void)
{
	return mkdir("/tmp/penumbra-sandbox-try", 0700);
}

static int listen_somewhere(void)
{
	const struct sockaddr_in address = {
		.sin_family = AF_INET, .sin_addr = {.s_addr = htonl(INADDR_LOOPBACK)}};
	int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

	return fd < 0 ? fd : bind(fd, (const struct sockaddr *)&address, sizeof address);
}

static int signal_parent(void)
{
	return kill(getppid(), 0);
}

static const struct {
	const char *name;
	int (*act)(void);
} acts[] = {
	{"open", open_file},
	{"mkdir", make_directory},
	{"bind", listen_somewhere},
	{"kill", signal_parent},
};

static _Noreturn void confine_and_try(size_t act)
{
	const struct pen_sandbox_limits limits = {0};
	struct pen_error err;

	if (pen_sandbox_enter(PEN_SANDBOX_ENCODER, PEN_SANDBOX_BEST_EFFORT, &limits, &err) < 0)
		_exit(255);
	_exit(acts[act].act() >= 0 ? 0 : errno);
}

int main(void)
{
	for (size_t i = 0; i < sizeof acts / sizeof *acts; i++) {
		pid_t pid = fork();
		int status;

		if (pid == 0)
			confine_and_try(i);
		if (pid < 0 || waitpid(pid, &status, 0) != pid)
			return EXIT_FAILURE;
		if (WIFSIGNALED(status))
			(void)printf("%s: SIG%s\n", acts[i].name, sigabbrev_np(WTERMSIG(status)));
		else if (WEXITSTATUS(status) == 0)
			(void)printf("%s: possible\n", acts[i].name);
		else
			(void)printf(
				"%s: %s\n", acts[i].name, strerrorname_np(WEXITSTATUS(status)));
		(void)fflush(stdout);
	}
	return EXIT_SUCCESS;
}
