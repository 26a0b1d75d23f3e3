/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/landlock.h>
#include <pthread.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* What a child reports: 0 when the forbidden act succeeded, else errno. */
typedef int act_fn(void);

static const struct pen_sandbox_limits limits = {.memory_bytes = 1ul << 30, .cpu_s = 20};
static pid_t victim; /* a process outside of the sandbox */

static void confine(enum pen_sandbox_profile profile)
{
	struct pen_error err = PEN_ERROR_INIT;

	if (profile == PEN_SANDBOX_RENDER)
		confine(PEN_SANDBOX_SCENE);
	if (pen_sandbox_enter(profile, PEN_SANDBOX_REQUIRE, &limits, &err) < 0) {
		(void)!write(STDERR_FILENO, err.text, sizeof err.text);
		_exit(200);
	}
}

/* How a child ends that confines itself and then acts. */
static int status_of(enum pen_sandbox_profile profile, act_fn *act)
{
	pid_t pid = fork();
	int status;

	assert_true(pid >= 0);
	if (pid == 0) {
		confine(profile);
		_exit(act());
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	return status;
}

static int act_read_limits(void)
{
	struct rlimit core, files;

	if (getrlimit(RLIMIT_CORE, &core) < 0 || getrlimit(RLIMIT_NOFILE, &files) < 0)
		return 1;
	return core.rlim_max == 0 && files.rlim_max == 64 ? 0 : 2;
}

/* Fails when a limit is not set. */
static void test_limits(void **state)
{
	(void)state;
	assert_int_equal(status_of(PEN_SANDBOX_SCENE, act_read_limits), 0);
	assert_int_equal(status_of(PEN_SANDBOX_ENCODER, act_read_limits), 0);
}

#ifndef PEN_SANITIZE

static int act_open(void)
{
	return open("/etc/passwd", O_RDONLY | O_CLOEXEC) >= 0 ? 0 : errno;
}

static int act_create(void)
{
	return open("/tmp/pen-sandbox-test", O_WRONLY | O_CREAT | O_CLOEXEC, 0600) >= 0 ? 0 : errno;
}

static int act_stat(void)
{
	struct stat st;

	return stat("/etc/passwd", &st) == 0 ? 0 : errno;
}

static int act_socket(void)
{
	return socket(AF_INET, SOCK_STREAM, 0) >= 0 ? 0 : errno;
}

static int act_connect(void)
{
	struct sockaddr address = {.sa_family = AF_UNIX};

	return connect(STDIN_FILENO, &address, sizeof address) == 0 ? 0 : errno;
}

static int act_execve(void)
{
	char *arguments[] = {NULL};

	return execve("/bin/true", arguments, arguments) == 0 ? 0 : errno;
}

static int act_ptrace(void)
{
	return ptrace(PTRACE_ATTACH, victim, NULL, NULL) == 0 ? 0 : errno;
}

static int act_kill(void)
{
	return kill(victim, SIGKILL) == 0 ? 0 : errno;
}

static int act_abort_other(void)
{
	return syscall(SYS_tgkill, victim, victim, SIGABRT) == 0 ? 0 : errno;
}

static int act_map_executable(void)
{
	return mmap(NULL, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) !=
			       MAP_FAILED
		       ? 0
		       : errno;
}

static int act_protect_executable(void)
{
	void *page = mmap(NULL, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);

	return mprotect(page, 4096, PROT_READ | PROT_EXEC) == 0 ? 0 : errno;
}

static int act_unshare(void)
{
	return unshare(CLONE_NEWUSER) == 0 ? 0 : errno;
}

static int act_clone_namespace(void)
{
	return syscall(SYS_clone, CLONE_NEWUSER | SIGCHLD, NULL, NULL, NULL, 0) >= 0 ? 0 : errno;
}

static int act_io_uring(void)
{
	return syscall(SYS_io_uring_setup, 1, NULL) >= 0 ? 0 : errno;
}

static int act_bpf(void)
{
	return syscall(SYS_bpf, 0, NULL, 0) >= 0 ? 0 : errno;
}

static int act_keyctl(void)
{
	return syscall(SYS_keyctl, 0, -2, 0) >= 0 ? 0 : errno;
}

static int act_userfaultfd(void)
{
	return syscall(SYS_userfaultfd, 0) >= 0 ? 0 : errno;
}

static int act_clone3(void)
{
	return syscall(SYS_clone3, NULL, 0) >= 0 ? 0 : errno;
}

/* Forks as a library would and waits for the child. */
static int act_fork(void)
{
	pid_t pid = fork();
	int status;

	if (pid == 0)
		_exit(0);
	return pid > 0 && waitpid(pid, &status, 0) == pid && status == 0 ? 0 : 1;
}

static void *return_argument(void *argument)
{
	return argument;
}

static int act_thread(void)
{
	pthread_t thread;
	void *result;

	if (pthread_create(&thread, NULL, return_argument, &victim) != 0)
		return 1;
	return pthread_join(thread, &result) == 0 && result == &victim ? 0 : 2;
}

static int act_raise_limit(void)
{
	struct rlimit limit = {0, 0};

	return setrlimit(RLIMIT_AS, &limit) == 0 ? 0 : errno;
}

static int act_receive(void)
{
	char byte;

	return recv(STDIN_FILENO, &byte, 1, MSG_DONTWAIT) >= 0 ? 0 : errno;
}

static int act_abort(void)
{
	abort();
}

static int act_compute(void)
{
	void *memory = malloc(16 << 20);
	char byte;

	if (!memory || lseek(STDIN_FILENO, 0, SEEK_SET) < 0)
		return 1;
	free(memory);
	return read(STDIN_FILENO, &byte, 1) == 0 ? 0 : 2;
}

static int act_allocate_too_much(void)
{
	return mmap(NULL, 2ul << 30, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED
		       ? errno
		       : 0;
}

enum { DIES = -1 }; /* of SIGSYS */

/* Each line fails when the profile lets the act through, or forbids more than it should. */
static const struct {
	const char *name;
	act_fn *act;
	int scene, render, encoder; /* exit status or DIES */
} acts[] = {
	{"open", act_open, EACCES, EACCES, EACCES},
	{"create", act_create, EACCES, EACCES, EACCES},
	{"stat", act_stat, EACCES, EACCES, EACCES},
	{"clone3", act_clone3, ENOSYS, ENOSYS, ENOSYS},
	{"socket", act_socket, DIES, DIES, DIES},
	{"connect", act_connect, DIES, DIES, DIES},
	{"execve", act_execve, DIES, DIES, DIES},
	{"ptrace", act_ptrace, DIES, DIES, DIES},
	{"kill", act_kill, DIES, DIES, DIES},
	{"mmap executable", act_map_executable, DIES, DIES, DIES},
	{"mprotect executable", act_protect_executable, DIES, DIES, DIES},
	{"unshare", act_unshare, DIES, DIES, DIES},
	{"clone of a namespace", act_clone_namespace, DIES, DIES, DIES},
	{"io_uring", act_io_uring, DIES, DIES, DIES},
	{"bpf", act_bpf, DIES, DIES, DIES},
	{"keyctl", act_keyctl, DIES, DIES, DIES},
	{"userfaultfd", act_userfaultfd, DIES, DIES, DIES},
	{"fork", act_fork, 0, DIES, DIES},
	{"thread", act_thread, 0, DIES, DIES},
	{"recv", act_receive, ENOTSOCK, DIES, ENOTSOCK},
	{"setrlimit", act_raise_limit, 0, DIES, DIES},
	{"too much memory", act_allocate_too_much, ENOMEM, ENOMEM, ENOMEM},
	{"computing", act_compute, 0, 0, 0},
};

static void check_act(const char *name, const char *profile, int status, int expected)
{
	bool right = expected == DIES ? WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS
				      : WIFEXITED(status) && WEXITSTATUS(status) == expected;

	if (!right)
		fail_msg("%s in %s: status %#x, expected %d", name, profile, (unsigned)status,
			expected);
}

static void test_acts(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof acts / sizeof *acts; i++) {
		check_act(acts[i].name, "scene", status_of(PEN_SANDBOX_SCENE, acts[i].act),
			acts[i].scene);
		check_act(acts[i].name, "render", status_of(PEN_SANDBOX_RENDER, acts[i].act),
			acts[i].render);
		check_act(acts[i].name, "encoder", status_of(PEN_SANDBOX_ENCODER, acts[i].act),
			acts[i].encoder);
	}
	assert_int_equal(kill(victim, 0), 0);
}

/* Fails when a crash by abort() would be told as a breach of the sandbox. */
static void test_abort_is_sigabrt(void **state)
{
	(void)state;
	for (int profile = PEN_SANDBOX_SCENE; profile <= PEN_SANDBOX_ENCODER; profile++) {
		int status = status_of((enum pen_sandbox_profile)profile, act_abort);

		assert_true(WIFSIGNALED(status));
		assert_int_equal(WTERMSIG(status), SIGABRT);
	}
}

/* Whether the kernel lists pid as without any capability. */
static bool has_no_capabilities(pid_t pid)
{
	char path[64], line[256];
	unsigned long long effective = 1, permitted = 1;
	FILE *file;

	(void)snprintf(path, sizeof path, "/proc/%d/status", (int)pid);
	file = fopen(path, "re");
	assert_non_null(file);
	while (fgets(line, sizeof line, file)) {
		(void)sscanf(line, "CapEff: %llx", &effective);
		(void)sscanf(line, "CapPrm: %llx", &permitted);
	}
	(void)fclose(file);
	return effective == 0 && permitted == 0;
}

/* Fails when a sandbox entered by root keeps a power of root. */
static void test_capabilities(void **state)
{
	int ready[2], leave[2];
	char byte;
	pid_t pid;

	(void)state;
	assert_int_equal(pipe(ready), 0);
	assert_int_equal(pipe(leave), 0);
	pid = fork();
	if (pid == 0) {
		(void)close(leave[1]);
		confine(PEN_SANDBOX_SCENE);
		(void)!write(ready[1], "r", 1);
		_exit((int)read(leave[0], &byte, 1));
	}
	(void)close(leave[0]);
	assert_int_equal(read(ready[0], &byte, 1), 1);
	assert_true(has_no_capabilities(pid));
	(void)close(leave[1]);
	(void)close(ready[0]);
	(void)close(ready[1]);
	assert_int_equal(waitpid(pid, NULL, 0), pid);
}

/* Fails when abort()'s call reaches another process: Landlock scopes signals from ABI 6 on. */
static void test_abort_of_others(void **state)
{
	long abi = syscall(SYS_landlock_create_ruleset, NULL, 0, LANDLOCK_CREATE_RULESET_VERSION);

	(void)state;
	check_act("tgkill", "render", status_of(PEN_SANDBOX_RENDER, act_abort_other), DIES);
	check_act("tgkill", "encoder", status_of(PEN_SANDBOX_ENCODER, act_abort_other), DIES);
	if (abi >= 6)
		check_act("tgkill", "scene", status_of(PEN_SANDBOX_SCENE, act_abort_other), EPERM);
	assert_int_equal(waitpid(victim, NULL, WNOHANG), 0);
}

#endif

/* Fails when a mode's name is misread or a wrong one accepted. */
static void test_mode_parse(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	enum pen_sandbox_mode mode = PEN_SANDBOX_OFF;

	(void)state;
	assert_int_equal(pen_sandbox_mode_parse("require", &mode, &err), 0);
	assert_int_equal(mode, PEN_SANDBOX_REQUIRE);
	assert_int_equal(pen_sandbox_mode_parse("best-effort", &mode, &err), 0);
	assert_int_equal(mode, PEN_SANDBOX_BEST_EFFORT);
	assert_int_equal(pen_sandbox_mode_parse("none", &mode, &err), PEN_EINVALID);
	assert_int_equal(mode, PEN_SANDBOX_BEST_EFFORT);
}

/* Fails when OFF confines, or forgets the limits. */
static void test_off(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	pid_t pid = fork();
	int status;

	(void)state;
	if (pid == 0) {
		if (pen_sandbox_enter(PEN_SANDBOX_ENCODER, PEN_SANDBOX_OFF, &limits, &err) < 0)
			_exit(1);
		if (open("/dev/null", O_RDONLY | O_CLOEXEC) < 0)
			_exit(2);
		_exit(prctl(PR_GET_DUMPABLE) == 0 ? act_read_limits() : 3);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_int_equal(status, 0);
}

/* Fails when a child outlives its parent, or when one is bound to a parent already gone. */
static void test_bind(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	int ends[2];
	char byte;
	pid_t parent;

	(void)state;
	assert_int_equal(pipe(ends), 0);
	parent = fork();
	if (parent == 0) {
		pid_t own = getpid();

		if (fork() == 0) {
			(void)pen_process_bind(own, SIGKILL, &err);
			(void)!write(ends[1], "b", 1);
			(void)pause();
		}
		if (fork() == 0) {
			(void)pen_process_bind(own + 1, SIGKILL, &err);
			(void)!write(ends[1], "x", 1);
			(void)pause();
		}
		(void)pause();
	}
	(void)close(ends[1]);
	assert_int_equal(read(ends[0], &byte, 1), 1);
	assert_int_equal(byte, 'b');
	assert_int_equal(kill(parent, SIGKILL), 0);
	assert_int_equal(waitpid(parent, NULL, 0), parent);
	/* The pipe ends only when both grandchildren are gone. */
	assert_int_equal(read(ends[0], &byte, 1), 0);
	(void)close(ends[0]);
}

static bool is_open(int fd)
{
	return fcntl(fd, F_GETFD) >= 0;
}

/* Fails when a descriptor that should go stays, or one to keep is closed. */
static void test_close_except(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;
	pid_t pid = fork();
	int status;

	(void)state;
	if (pid == 0) {
		int keep[] = {42, 40};

		for (int fd = 39; fd <= 44; fd++)
			(void)dup2(STDIN_FILENO, fd);
		if (pen_process_close_except(keep, 2, &err) < 0)
			_exit(1);
		_exit(is_open(0) && is_open(1) && is_open(2) && !is_open(39) && is_open(40) &&
					!is_open(41) && is_open(42) && !is_open(43) && !is_open(44)
				? 0
				: 2);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_int_equal(status, 0);
}

static int start_victim(void **state)
{
	int null = open("/dev/null", O_RDONLY | O_CLOEXEC);

	(void)state;
	(void)dup2(null, STDIN_FILENO);
	victim = fork();
	if (victim == 0)
		for (;;)
			(void)pause();
	return victim < 0;
}

static int stop_victim(void **state)
{
	(void)state;
	return kill(victim, SIGKILL) < 0 || waitpid(victim, NULL, 0) != victim;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
#ifndef PEN_SANITIZE
		cmocka_unit_test(test_acts),
		cmocka_unit_test(test_abort_is_sigabrt),
		cmocka_unit_test(test_abort_of_others),
		cmocka_unit_test(test_capabilities),
#endif
		cmocka_unit_test(test_limits),
		cmocka_unit_test(test_mode_parse),
		cmocka_unit_test(test_off),
		cmocka_unit_test(test_bind),
		cmocka_unit_test(test_close_except),
	};

	return cmocka_run_group_tests(tests, start_victim, stop_victim);
}
