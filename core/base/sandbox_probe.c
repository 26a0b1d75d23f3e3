/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/sandbox_probe.h"

#include "core/base/clock.h"
#include "core/base/limits.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

/* errno of a refusal, or 0 when the act was possible. */
typedef int act_fn(void);

static int open_root(void)
{
	return open("/", O_RDONLY | O_DIRECTORY | O_CLOEXEC) >= 0 ? 0 : errno;
}

static int make_socket(void)
{
	return socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0) >= 0 ? 0 : errno;
}

static int execute(void)
{
	char *nothing[] = {NULL};

	return execve("", nothing, nothing) == 0 ? 0 : errno;
}

static int trace(void)
{
	return ptrace(PTRACE_TRACEME, 0, NULL, NULL) == 0 ? 0 : errno;
}

static int signal_parent(void)
{
	return kill(getppid(), 0) == 0 ? 0 : errno;
}

static int map_executable(void)
{
	void *page = mmap(NULL, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);

	return page != MAP_FAILED ? 0 : errno;
}

static int make_ring(void)
{
	return syscall(SYS_io_uring_setup, 1, NULL) >= 0 ? 0 : errno;
}

enum { KILLED = -1 }; /* by SIGSYS */

static const struct {
	const char *name;
	act_fn *act;
	int expected; /* errno or KILLED */
} acts[] = {
	{"open", open_root, EACCES},
	{"socket", make_socket, KILLED},
	{"execve", execute, KILLED},
	{"ptrace", trace, KILLED},
	{"kill", signal_parent, KILLED},
	{"mmap with PROT_EXEC", map_executable, KILLED},
	{"io_uring_setup", make_ring, KILLED},
};

enum { ACTS = sizeof acts / sizeof *acts };

struct attempt {
	pid_t pid;
	int pipe; /* what kept the child out of the sandbox, if it says something */
};

static _Noreturn void try_act(enum pen_sandbox_profile profile, size_t act, int pipe)
{
	const struct pen_sandbox_limits limits = {0};
	struct pen_error err = PEN_ERROR_INIT;

	(void)prctl(PR_SET_NAME, "pen-probe");
	if (pen_sandbox_enter(profile, PEN_SANDBOX_REQUIRE, &limits, &err) < 0) {
		(void)!write(pipe, err.text, strlen(err.text));
		_exit(EXIT_FAILURE);
	}
	_exit(acts[act].act());
}

static int start(enum pen_sandbox_profile profile, size_t act, struct attempt *attempt,
	struct pen_error *err)
{
	int ends[2];

	if (pipe2(ends, O_CLOEXEC) < 0)
		return pen_error_system(err, errno, "pipe");
	attempt->pid = fork();
	if (attempt->pid == 0)
		try_act(profile, act, ends[1]);
	(void)close(ends[1]);
	attempt->pipe = ends[0];
	return attempt->pid < 0 ? pen_error_system(err, errno, "fork") : 0;
}

/* The end of the pipe is the end of the child, which hands it on to nobody. */
static int judge(size_t act, const struct attempt *attempt, int64_t end_ms, struct pen_error *err)
{
	struct pollfd poll_end = {.fd = attempt->pipe, .events = POLLIN};
	char reason[sizeof err->text];
	int64_t left_ms = end_ms - pen_clock_ms();
	ssize_t size;
	int status;

	if (poll(&poll_end, 1, left_ms > 0 ? (int)left_ms : 0) <= 0)
		(void)kill(attempt->pid, SIGKILL);
	size = read(attempt->pipe, reason, sizeof reason - 1);
	while (waitpid(attempt->pid, &status, 0) < 0)
		if (errno != EINTR)
			return pen_error_system(err, errno, "waitpid");
	if (size > 0)
		return pen_error_set(err, PEN_EUNSUPPORTED, "%.*s", (int)size, reason);
	if (acts[act].expected == KILLED
			? WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS
			: WIFEXITED(status) && WEXITSTATUS(status) == acts[act].expected)
		return 0;
	return pen_error_set(err, PEN_EUNSUPPORTED,
		"the sandbox does not hold here: %s inside of it ended with status %#x",
		acts[act].name, (unsigned)status);
}

int pen_sandbox_probe(enum pen_sandbox_profile profile, struct pen_error *err)
{
	const int64_t end_ms = pen_clock_ms() + PEN_SANDBOX_PROBE_MS;
	struct attempt attempts[ACTS];
	struct pen_error fault = PEN_ERROR_INIT;
	size_t started = 0;
	int r = 0;

	if (!pen_sandbox_is_built())
		return 0;
	while (r == 0 && started < ACTS) {
		attempts[started].pipe = -1;
		r = start(profile, started, &attempts[started], err);
		if (r == 0)
			started++;
		else if (attempts[started].pipe >= 0)
			(void)close(attempts[started].pipe);
	}
	/* Every child is waited for; the first fault is the one that is told. */
	for (size_t i = 0; i < started; i++) {
		int s = judge(i, &attempts[i], end_ms, &fault);

		(void)close(attempts[i].pipe);
		if (r == 0 && s < 0) {
			*err = fault;
			r = s;
		}
	}
	return r;
}
