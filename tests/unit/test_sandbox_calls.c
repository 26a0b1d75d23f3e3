/* SPDX-License-Identifier: Apache-2.0 */
/*
 * System calls that a process in the sandbox tries, one child for each and for each profile. The
 * call is made bare, so that no library stands in for the kernel; a call that got through would end
 * with the kernel's own answer, which is never what is expected here.
 */
#include "core/base/sandbox_probe.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/landlock.h>
#include <sched.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/reboot.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* Younger than the headers of Debian 12, or not in them. */
enum {
	CALL_MAP_SHADOW_STACK = 453,
	CALL_FUTEX_WAKE = 454,
	CALL_OPEN_TREE_ATTR = 467,
	CALL_UNKNOWN = 4000
};

#define PATH   ((long)(intptr_t) "/etc/passwd")
#define FRESH  ((long)(intptr_t) "/tmp/penumbra-sandbox-test")
#define NAME   ((long)(intptr_t) "penumbra")
#define BUFFER ((long)(intptr_t)buffer)
#define VICTIM (-2L) /* stands for the process outside */

static char buffer[4096];
static pid_t victim;

/* Exit statuses; errno values are smaller. */
enum { DIES = 1000, POSSIBLE = 0, ANSWER_NOT_TOLD = 199, NOT_CONFINED = 200 };

struct call {
	const char *name;
	long number;
	long arguments[6];
	int expected; /* DIES, or the errno of a refusal; the same in all profiles */
};

static const struct call calls[] = {
	/* Files */
	{"open", SYS_open, {PATH, O_RDONLY}, EACCES},
	{"open to write", SYS_open, {PATH, O_WRONLY}, EACCES},
	{"open as a path", SYS_open, {PATH, O_PATH}, EACCES},
	{"openat", SYS_openat, {AT_FDCWD, PATH, O_RDONLY}, EACCES},
	{"openat to create", SYS_openat, {AT_FDCWD, FRESH, O_CREAT | O_RDWR, 0600}, EACCES},
	{"openat without a name", SYS_openat,
		{AT_FDCWD, (long)(intptr_t) "/tmp", O_TMPFILE | O_RDWR, 0600}, EACCES},
	{"openat below a descriptor", SYS_openat, {0, NAME, O_RDONLY}, EACCES},
	{"openat2", SYS_openat2, {AT_FDCWD, PATH, BUFFER, 24}, EACCES},
	{"creat", SYS_creat, {FRESH, 0600}, DIES},
	{"stat", SYS_stat, {PATH, BUFFER}, EACCES},
	{"lstat", SYS_lstat, {PATH, BUFFER}, EACCES},
	{"newfstatat", SYS_newfstatat, {AT_FDCWD, PATH, BUFFER, 0}, EACCES},
	{"statx", SYS_statx, {AT_FDCWD, PATH, 0, 0x7ff, BUFFER}, EACCES},
	{"statfs", SYS_statfs, {PATH, BUFFER}, DIES},
	{"access", SYS_access, {PATH, R_OK}, EACCES},
	{"faccessat", SYS_faccessat, {AT_FDCWD, PATH, R_OK}, EACCES},
	{"readlink", SYS_readlink, {(long)(intptr_t) "/proc/self/exe", BUFFER, 4096}, EACCES},
	{"readlinkat", SYS_readlinkat, {AT_FDCWD, PATH, BUFFER, 4096}, EACCES},
	{"getcwd", SYS_getcwd, {BUFFER, 4096}, EACCES},
	{"getdents64", SYS_getdents64, {0, BUFFER, 4096}, DIES},
	{"link", SYS_link, {PATH, FRESH}, DIES},
	{"linkat", SYS_linkat, {AT_FDCWD, PATH, AT_FDCWD, FRESH, 0}, DIES},
	{"symlink", SYS_symlink, {PATH, FRESH}, DIES},
	{"symlinkat", SYS_symlinkat, {PATH, AT_FDCWD, FRESH}, DIES},
	{"rename", SYS_rename, {FRESH, FRESH}, DIES},
	{"renameat2", SYS_renameat2, {AT_FDCWD, FRESH, AT_FDCWD, FRESH, 0}, DIES},
	{"unlink", SYS_unlink, {FRESH}, DIES},
	{"unlinkat", SYS_unlinkat, {AT_FDCWD, FRESH, 0}, DIES},
	{"mkdir", SYS_mkdir, {FRESH, 0700}, DIES},
	{"rmdir", SYS_rmdir, {FRESH}, DIES},
	{"mknod", SYS_mknod, {FRESH, 0010600, 0}, DIES},
	{"chmod", SYS_chmod, {FRESH, 0777}, DIES},
	{"fchmod", SYS_fchmod, {0, 0777}, DIES},
	{"fchmodat", SYS_fchmodat, {AT_FDCWD, FRESH, 0777}, DIES},
	{"chown", SYS_chown, {FRESH, 0, 0}, DIES},
	{"truncate", SYS_truncate, {FRESH, 0}, DIES},
	{"utimensat", SYS_utimensat, {AT_FDCWD, FRESH, 0, 0}, DIES},
	{"setxattr", SYS_setxattr, {FRESH, NAME, BUFFER, 1, 0}, DIES},
	{"chdir", SYS_chdir, {(long)(intptr_t) "/"}, DIES},
	{"fchdir", SYS_fchdir, {0}, DIES},
	{"chroot", SYS_chroot, {(long)(intptr_t) "/tmp"}, DIES},
	{"inotify_init1", SYS_inotify_init1, {0}, DIES},
	{"fanotify_init", SYS_fanotify_init, {0, 0}, DIES},
	{"name_to_handle_at", SYS_name_to_handle_at, {AT_FDCWD, PATH, BUFFER, BUFFER, 0}, DIES},
	{"open_by_handle_at", SYS_open_by_handle_at, {AT_FDCWD, BUFFER, O_RDONLY}, DIES},
	{"memfd_create", SYS_memfd_create, {NAME, 0}, DIES},
	{"ioctl TIOCSTI", SYS_ioctl, {0, TIOCSTI, NAME}, ENOTTY},
	{"ioctl FIONREAD", SYS_ioctl, {0, FIONREAD, BUFFER}, ENOTTY},
	{"fcntl F_SETOWN", SYS_fcntl, {0, F_SETOWN, 1}, DIES},
	{"fcntl F_SETFL", SYS_fcntl, {0, F_SETFL, O_ASYNC}, DIES},
	{"sendfile", SYS_sendfile, {0, 0, 0, 1}, DIES},
	{"splice", SYS_splice, {0, 0, 0, 0, 1, 0}, DIES},
	/* Mounts */
	{"mount", SYS_mount, {NAME, FRESH, (long)(intptr_t) "tmpfs", 0, 0}, DIES},
	{"umount2", SYS_umount2, {FRESH, 0}, DIES},
	{"pivot_root", SYS_pivot_root, {FRESH, FRESH}, DIES},
	{"open_tree", SYS_open_tree, {AT_FDCWD, FRESH, 0}, DIES},
	{"open_tree_attr", CALL_OPEN_TREE_ATTR, {AT_FDCWD, FRESH, 0}, DIES},
	{"move_mount", SYS_move_mount, {AT_FDCWD, FRESH, AT_FDCWD, FRESH, 0}, DIES},
	{"fsopen", SYS_fsopen, {(long)(intptr_t) "tmpfs", 0}, DIES},
	{"mount_setattr", SYS_mount_setattr, {AT_FDCWD, FRESH, 0, BUFFER, 32}, DIES},
	{"swapon", SYS_swapon, {FRESH, 0}, DIES},
	{"quotactl", SYS_quotactl, {0, NAME, 0, BUFFER}, DIES},
	/* Network */
	{"socket AF_INET", SYS_socket, {AF_INET, SOCK_STREAM, 0}, DIES},
	{"socket AF_INET6", SYS_socket, {AF_INET6, SOCK_DGRAM, 0}, DIES},
	{"socket AF_UNIX", SYS_socket, {AF_UNIX, SOCK_STREAM, 0}, DIES},
	{"socket AF_NETLINK", SYS_socket, {AF_NETLINK, SOCK_RAW, 0}, DIES},
	{"socket AF_PACKET", SYS_socket, {AF_PACKET, SOCK_RAW, 0}, DIES},
	{"socket AF_VSOCK", SYS_socket, {AF_VSOCK, SOCK_STREAM, 0}, DIES},
	{"socket AF_ALG", SYS_socket, {AF_ALG, SOCK_SEQPACKET, 0}, DIES},
	{"socketpair", SYS_socketpair, {AF_UNIX, SOCK_STREAM, 0, BUFFER}, DIES},
	{"connect", SYS_connect, {0, BUFFER, 16}, DIES},
	{"bind", SYS_bind, {0, BUFFER, 16}, DIES},
	{"listen", SYS_listen, {0, 1}, DIES},
	{"accept4", SYS_accept4, {0, 0, 0, 0}, DIES},
	{"setsockopt", SYS_setsockopt, {0, 1, 1, BUFFER, 4}, DIES},
	/* Programs, processes */
	{"execve", SYS_execve, {(long)(intptr_t) "/bin/true", 0, 0}, DIES},
	{"execveat", SYS_execveat, {AT_FDCWD, (long)(intptr_t) "/bin/true", 0, 0, 0}, DIES},
	{"execveat of a descriptor", SYS_execveat, {0, (long)(intptr_t) "", 0, 0, AT_EMPTY_PATH},
		DIES},
	{"vfork", SYS_vfork, {0}, DIES},
	{"fork", SYS_fork, {0}, DIES},
	{"clone3", SYS_clone3, {BUFFER, 64}, ENOSYS},
	{"clone of a user namespace", SYS_clone, {CLONE_NEWUSER | SIGCHLD}, DIES},
	{"clone of a network namespace", SYS_clone, {CLONE_NEWNET | SIGCHLD}, DIES},
	{"clone of a mount namespace", SYS_clone, {CLONE_NEWNS | SIGCHLD}, DIES},
	{"clone of a process namespace", SYS_clone, {CLONE_NEWPID | SIGCHLD}, DIES},
	{"clone as a brother", SYS_clone, {CLONE_PARENT | SIGCHLD}, DIES},
	{"clone with its tracer", SYS_clone, {CLONE_PTRACE | SIGCHLD}, DIES},
	{"unshare", SYS_unshare, {CLONE_NEWUSER}, DIES},
	{"setns", SYS_setns, {0, 0}, DIES},
	{"ptrace of the parent", SYS_ptrace, {PTRACE_ATTACH, VICTIM}, DIES},
	{"ptrace of itself", SYS_ptrace, {PTRACE_TRACEME}, DIES},
	{"process_vm_readv", SYS_process_vm_readv, {VICTIM, BUFFER, 1, BUFFER, 1, 0}, DIES},
	{"process_vm_writev", SYS_process_vm_writev, {VICTIM, BUFFER, 1, BUFFER, 1, 0}, DIES},
	{"process_madvise", SYS_process_madvise, {0, BUFFER, 0, 0, 0}, DIES},
	{"kcmp", SYS_kcmp, {VICTIM, VICTIM, 0, 0, 0}, DIES},
	{"kill", SYS_kill, {VICTIM, SIGKILL}, DIES},
	{"kill of everybody", SYS_kill, {-1, 0}, DIES},
	{"tkill", SYS_tkill, {VICTIM, SIGKILL}, DIES},
	{"tgkill", SYS_tgkill, {VICTIM, VICTIM, SIGKILL}, DIES},
	{"rt_sigqueueinfo", SYS_rt_sigqueueinfo, {VICTIM, SIGUSR1, BUFFER}, DIES},
	{"pidfd_open", SYS_pidfd_open, {VICTIM, 0}, DIES},
	{"pidfd_getfd", SYS_pidfd_getfd, {0, 0, 0}, DIES},
	{"pidfd_send_signal", SYS_pidfd_send_signal, {0, SIGKILL, 0, 0}, DIES},
	{"setpgid", SYS_setpgid, {0, 0}, DIES},
	{"setsid", SYS_setsid, {0}, DIES},
	{"setpriority", SYS_setpriority, {0, 0, -10}, DIES},
	{"sched_setscheduler", SYS_sched_setscheduler, {0, SCHED_FIFO, BUFFER}, DIES},
	{"prlimit64 of another", SYS_prlimit64, {VICTIM, 0, BUFFER, 0}, DIES},
	/* Memory to execute */
	{"mmap PROT_EXEC", SYS_mmap,
		{0, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0}, DIES},
	{"mmap PROT_WRITE and PROT_EXEC", SYS_mmap,
		{0, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0},
		DIES},
	{"mprotect PROT_EXEC", SYS_mprotect, {0, 0, PROT_READ | PROT_EXEC}, DIES},
	{"pkey_mprotect", SYS_pkey_mprotect, {0, 0, PROT_READ | PROT_EXEC, -1}, DIES},
	{"remap_file_pages", SYS_remap_file_pages, {0, 0, 0, 0, 0}, DIES},
	{"map_shadow_stack", CALL_MAP_SHADOW_STACK, {0, 4096, 0}, DIES},
	{"userfaultfd", SYS_userfaultfd, {0}, DIES},
	{"mlockall", SYS_mlockall, {MCL_CURRENT}, DIES},
	/* Identity, and ways out of the sandbox itself */
	{"setuid", SYS_setuid, {0}, DIES},
	{"setresuid", SYS_setresuid, {0, 0, 0}, DIES},
	{"setgid", SYS_setgid, {0}, DIES},
	{"setgroups", SYS_setgroups, {0, 0}, DIES},
	{"setfsuid", SYS_setfsuid, {0}, DIES},
	{"capset", SYS_capset, {BUFFER, BUFFER}, DIES},
	{"personality", SYS_personality, {0}, DIES},
	{"prctl PR_SET_MM", SYS_prctl, {PR_SET_MM, PR_SET_MM_BRK, BUFFER, 0, 0}, DIES},
	{"prctl PR_CAP_AMBIENT", SYS_prctl, {PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, 0, 0, 0}, DIES},
	{"prctl PR_SET_PTRACER", SYS_prctl, {PR_SET_PTRACER, VICTIM, 0, 0, 0}, DIES},
	{"prctl PR_SET_SECUREBITS", SYS_prctl, {PR_SET_SECUREBITS, 0, 0, 0, 0}, DIES},
	{"prctl PR_SET_CHILD_SUBREAPER", SYS_prctl, {PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0}, DIES},
	{"arch_prctl", SYS_arch_prctl, {0x1002, 0}, DIES},
	{"modify_ldt", SYS_modify_ldt, {0, BUFFER, 16}, DIES},
	{"landlock_create_ruleset", SYS_landlock_create_ruleset,
		{0, 0, LANDLOCK_CREATE_RULESET_VERSION}, DIES},
	/* The kernel's own */
	{"bpf", SYS_bpf, {0, BUFFER, 4}, DIES},
	{"io_uring_setup", SYS_io_uring_setup, {1, BUFFER}, DIES},
	{"io_uring_enter", SYS_io_uring_enter, {0, 0, 0, 0, 0}, DIES},
	{"perf_event_open", SYS_perf_event_open, {BUFFER, 0, -1, -1, 0}, DIES},
	{"keyctl", SYS_keyctl, {0, -2, 0}, DIES},
	{"add_key", SYS_add_key, {(long)(intptr_t) "user", NAME, BUFFER, 1, -2}, DIES},
	{"request_key", SYS_request_key, {(long)(intptr_t) "user", NAME, 0, -2}, DIES},
	{"init_module", SYS_init_module, {BUFFER, 0, NAME}, DIES},
	{"finit_module", SYS_finit_module, {0, NAME, 0}, DIES},
	{"delete_module", SYS_delete_module, {NAME, 0}, DIES},
	{"kexec_load", SYS_kexec_load, {0, 0, 0, 0}, DIES},
	{"reboot", SYS_reboot, {0, 0, RB_DISABLE_CAD, 0}, DIES},
	{"syslog", SYS_syslog, {10, 0, 0}, DIES},
	{"sethostname", SYS_sethostname, {NAME, 1}, DIES},
	{"settimeofday", SYS_settimeofday, {0, 0}, DIES},
	{"clock_settime", SYS_clock_settime, {0, BUFFER}, DIES},
	{"adjtimex", SYS_adjtimex, {BUFFER}, DIES},
	{"iopl", SYS_iopl, {3}, DIES},
	{"ioperm", SYS_ioperm, {0, 1, 1}, DIES},
	{"acct", SYS_acct, {0}, DIES},
	{"lookup_dcookie", SYS_lookup_dcookie, {0, BUFFER, 1}, DIES},
	{"shmget", SYS_shmget, {1, 4096, 01600}, DIES},
	{"shmat", SYS_shmat, {0, 0, 0}, DIES},
	{"msgget", SYS_msgget, {1, 01600}, DIES},
	{"semget", SYS_semget, {1, 1, 01600}, DIES},
	{"mq_open", SYS_mq_open, {NAME, O_CREAT | O_RDWR, 0600, 0}, DIES},
	{"timer_create", SYS_timer_create, {0, 0, BUFFER}, DIES},
	{"timerfd_create", SYS_timerfd_create, {0, 0}, DIES},
	{"eventfd2", SYS_eventfd2, {0, 0}, DIES},
	{"epoll_create1", SYS_epoll_create1, {0}, DIES},
	{"futex_wake of another kind", CALL_FUTEX_WAKE, {BUFFER, 0, 0, 0}, DIES},
	{"a call of a kernel to come", CALL_UNKNOWN, {0}, DIES},
};

/* The prefix of a call of the x32 interface, a second table behind the same gate. */
enum { X32 = 0x40000000 };

static long argument(long value)
{
	return value == VICTIM ? victim : value;
}

static _Noreturn void confine_and_call(
	enum pen_sandbox_profile profile, const struct call *call, long prefix)
{
	const struct pen_sandbox_limits limits = {.memory_bytes = 1ul << 30, .cpu_s = 20};
	struct pen_error err = PEN_ERROR_INIT;
	const long *a = call->arguments;
	int r = 0;

	if (profile == PEN_SANDBOX_RENDER)
		r = pen_sandbox_enter(PEN_SANDBOX_SCENE, PEN_SANDBOX_REQUIRE, &limits, &err);
	if (r == 0)
		r = pen_sandbox_enter(profile, PEN_SANDBOX_REQUIRE, &limits, &err);
	if (r < 0)
		_exit(NOT_CONFINED);
	if (syscall(call->number | prefix, argument(a[0]), argument(a[1]), argument(a[2]), a[3],
		    a[4], a[5]) >= 0)
		_exit(POSSIBLE);
	_exit(errno < ANSWER_NOT_TOLD ? errno : ANSWER_NOT_TOLD);
}

static int status_of(enum pen_sandbox_profile profile, const struct call *call, long prefix)
{
	pid_t pid = fork();
	int status;

	assert_true(pid >= 0);
	if (pid == 0)
		confine_and_call(profile, call, prefix);
	assert_int_equal(waitpid(pid, &status, 0), pid);
	return status;
}

static const char *const profile_names[] = {"scene", "render", "encoder"};

/* How many of the calls end otherwise than they should; each is printed. */
static unsigned wrong_calls(enum pen_sandbox_profile profile)
{
	unsigned wrong = 0;

	for (size_t i = 0; i < sizeof calls / sizeof *calls; i++) {
		int status = status_of(profile, &calls[i], 0), expected = calls[i].expected;
		bool right = expected == DIES
				     ? WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS
				     : WIFEXITED(status) && WEXITSTATUS(status) == expected;

		if (right)
			continue;
		print_error("%s in %s: status %#x, expected %d\n", calls[i].name,
			profile_names[profile], (unsigned)status, expected);
		wrong++;
	}
	return wrong;
}

/* Each fails when a profile lets one of the calls through, or refuses it in another way. */
static void test_scene(void **state)
{
	(void)state;
	assert_int_equal(wrong_calls(PEN_SANDBOX_SCENE), 0);
}

static void test_render(void **state)
{
	(void)state;
	assert_int_equal(wrong_calls(PEN_SANDBOX_RENDER), 0);
}

static void test_encoder(void **state)
{
	(void)state;
	assert_int_equal(wrong_calls(PEN_SANDBOX_ENCODER), 0);
}

/* Fails when a call that is allowed may come as one of the x32 interface too. */
static void test_second_interface(void **state)
{
	static const struct call call = {"getpid", SYS_getpid, {0}, DIES};

	(void)state;
	for (int profile = PEN_SANDBOX_SCENE; profile <= PEN_SANDBOX_ENCODER; profile++) {
		int status = status_of((enum pen_sandbox_profile)profile, &call, X32);

		assert_true(WIFSIGNALED(status));
		assert_int_equal(WTERMSIG(status), SIGSYS);
		status = status_of((enum pen_sandbox_profile)profile, &call, 0);
		assert_true(WIFEXITED(status));
		assert_int_equal(WEXITSTATUS(status), POSSIBLE);
	}
}

/* Fails when the trial of a start finds fault with a kernel that has all, or leaves a child. */
static void test_probe(void **state)
{
	struct pen_error err = PEN_ERROR_INIT;

	(void)state;
	assert_int_equal(pen_sandbox_probe(PEN_SANDBOX_SCENE, &err), 0);
	assert_int_equal(pen_sandbox_probe(PEN_SANDBOX_ENCODER, &err), 0);
	assert_int_equal(waitpid(-1, NULL, WNOHANG), 0); /* the victim alone */
}

static int start_victim(void **state)
{
	int file = open("/dev/null", O_RDONLY | O_CLOEXEC);

	(void)state;
	if (file < 0 || dup2(file, STDIN_FILENO) < 0)
		return 1;
	victim = fork();
	if (victim == 0)
		for (;;)
			(void)pause();
	return victim < 0;
}

/* It must have lived through all of it. */
static int stop_victim(void **state)
{
	int status;

	(void)state;
	if (waitpid(victim, NULL, WNOHANG) != 0)
		return 1;
	return kill(victim, SIGTERM) < 0 || waitpid(victim, &status, 0) != victim;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_scene),
		cmocka_unit_test(test_render),
		cmocka_unit_test(test_encoder),
		cmocka_unit_test(test_second_interface),
		cmocka_unit_test(test_probe),
	};

	if (!pen_sandbox_is_built())
		return 0;
	return cmocka_run_group_tests(tests, start_victim, stop_victim);
}
