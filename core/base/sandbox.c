/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <sched.h>
#include <seccomp.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

/* The kernel's Landlock structure up to ABI 6; Debian 12's header ends at ABI 2. */
struct landlock_rules {
	uint64_t fs, net, scoped;
};

enum {
	LANDLOCK_FS_ABI1 = (1 << 13) - 1,
	LANDLOCK_FS_REFER = 1 << 13,	 /* ABI 2 */
	LANDLOCK_FS_TRUNCATE = 1 << 14,	 /* ABI 3 */
	LANDLOCK_FS_IOCTL_DEV = 1 << 15, /* ABI 5 */
	LANDLOCK_NET_TCP = 3,		 /* ABI 4: bind and connect */
	LANDLOCK_SCOPE_ALL = 3		 /* ABI 6: abstract sockets and signals */
};

#ifdef PEN_SANITIZE
enum { SANITIZER = true };
#else
enum { SANITIZER = false };
#endif

enum { FILES_DEFAULT = 64 };

/* A call allowed when (argument & mask) == value. */
struct condition {
	int call;
	unsigned int argument;
	uint64_t mask, value;
};

#define EXACT	  UINT64_MAX
#define EXACT_INT UINT32_MAX
#define FORBIDDEN_CLONE                                                                            \
	((uint64_t)CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER |   \
		CLONE_NEWPID | CLONE_NEWNET | CLONE_PTRACE | CLONE_PARENT)

/* What computing, allocating, and using the descriptors at hand takes. */
static const int common_calls[] = {
	SCMP_SYS(brk),
	SCMP_SYS(clock_getres),
	SCMP_SYS(clock_gettime),
	SCMP_SYS(clock_nanosleep),
	SCMP_SYS(close),
	SCMP_SYS(exit),
	SCMP_SYS(exit_group),
	SCMP_SYS(fstat),
	SCMP_SYS(futex),
	SCMP_SYS(getcpu),
	SCMP_SYS(getpid),
	SCMP_SYS(getrandom),
	SCMP_SYS(getrusage),
	SCMP_SYS(gettid),
	SCMP_SYS(gettimeofday),
	SCMP_SYS(lseek),
	SCMP_SYS(madvise),
	SCMP_SYS(mremap),
	SCMP_SYS(munmap),
	SCMP_SYS(nanosleep),
	SCMP_SYS(poll),
	SCMP_SYS(ppoll),
	SCMP_SYS(pread64),
	SCMP_SYS(pwrite64),
	SCMP_SYS(read),
	SCMP_SYS(readv),
	SCMP_SYS(restart_syscall),
	SCMP_SYS(rseq),
	SCMP_SYS(rt_sigaction),
	SCMP_SYS(rt_sigprocmask),
	SCMP_SYS(rt_sigreturn),
	SCMP_SYS(sched_getaffinity),
	SCMP_SYS(sched_yield),
	SCMP_SYS(set_robust_list),
	SCMP_SYS(sigaltstack),
	SCMP_SYS(sysinfo),
	SCMP_SYS(time),
	SCMP_SYS(write),
	SCMP_SYS(writev),
};

/* Memory that is never executable; limits are read, not set. */
static const struct condition common_conditions[] = {
	{SCMP_SYS(fcntl), 1, EXACT_INT, F_GETFL},
	{SCMP_SYS(mmap), 2, PROT_EXEC, 0},
	{SCMP_SYS(mprotect), 2, PROT_EXEC, 0},
	{SCMP_SYS(prlimit64), 2, EXACT, 0},
};

/* getppid and seccomp: a render process binds itself to its parent and stacks its filter. */
static const int scene_calls[] = {
	SCMP_SYS(close_range),
	SCMP_SYS(getppid),
	SCMP_SYS(recvfrom),
	SCMP_SYS(recvmsg),
	SCMP_SYS(seccomp),
	SCMP_SYS(sendmsg),
	SCMP_SYS(sendto),
	SCMP_SYS(umask),
	SCMP_SYS(wait4),
};

/*
 * Threads and plain forks. Render processes live under this filter and their own, so what they do
 * before theirs stands is allowed here: abort() by its signal, limits of the caller itself.
 */
static const struct condition scene_conditions[] = {
	{SCMP_SYS(clone), 0, FORBIDDEN_CLONE, 0},
	{SCMP_SYS(prctl), 0, EXACT_INT, PR_GET_SECCOMP},
	{SCMP_SYS(prctl), 0, EXACT_INT, PR_SET_DUMPABLE},
	{SCMP_SYS(prctl), 0, EXACT_INT, PR_SET_NAME},
	{SCMP_SYS(prctl), 0, EXACT_INT, PR_SET_NO_NEW_PRIVS},
	{SCMP_SYS(prctl), 0, EXACT_INT, PR_SET_PDEATHSIG},
	{SCMP_SYS(prctl), 0, EXACT_INT, PR_SET_SECCOMP},
	{SCMP_SYS(prlimit64), 0, EXACT_INT, 0},
	{SCMP_SYS(tgkill), 2, EXACT_INT, SIGABRT},
};

static const int encoder_calls[] = {
	SCMP_SYS(dup),
	SCMP_SYS(ftruncate),
	SCMP_SYS(pwritev),
	SCMP_SYS(preadv),
	SCMP_SYS(recvfrom),
	SCMP_SYS(recvmsg),
	SCMP_SYS(sendmsg),
	SCMP_SYS(sendto),
};

/* Libraries try these and live without. */
static const struct {
	int call, error;
} refused_calls[] = {
	{SCMP_SYS(access), EACCES},
	{SCMP_SYS(clone3), ENOSYS},
	{SCMP_SYS(faccessat), EACCES},
	{SCMP_SYS(faccessat2), EACCES},
	{SCMP_SYS(getcwd), EACCES},
	{SCMP_SYS(ioctl), ENOTTY},
	{SCMP_SYS(lstat), EACCES},
	{SCMP_SYS(newfstatat), EACCES},
	{SCMP_SYS(open), EACCES},
	{SCMP_SYS(openat), EACCES},
	{SCMP_SYS(openat2), EACCES},
	{SCMP_SYS(readlink), EACCES},
	{SCMP_SYS(readlinkat), EACCES},
	{SCMP_SYS(stat), EACCES},
	{SCMP_SYS(statx), EACCES},
};

#define COUNT(array) (sizeof(array) / sizeof *(array))

static const char *const mode_names[] = {"require", "best-effort", "off"};

const char *pen_sandbox_mode_name(enum pen_sandbox_mode mode)
{
	return mode_names[mode];
}

bool pen_sandbox_is_built(void)
{
	return !SANITIZER;
}

int pen_sandbox_mode_parse(const char *name, enum pen_sandbox_mode *ret_mode, struct pen_error *err)
{
	for (size_t i = 0; i < COUNT(mode_names); i++)
		if (strcmp(name, mode_names[i]) == 0) {
			*ret_mode = (enum pen_sandbox_mode)i;
			return 0;
		}
	return pen_error_set(
		err, PEN_EINVALID, "no sandbox mode \"%s\": use require, best-effort or off", name);
}

static int set_limit(__rlimit_resource_t resource, rlim_t value, struct pen_error *err)
{
	struct rlimit limit;

	if (getrlimit(resource, &limit) < 0)
		return pen_error_system(err, errno, "getrlimit");
	if (value < limit.rlim_max)
		limit.rlim_max = value;
	limit.rlim_cur = limit.rlim_max;
	if (setrlimit(resource, &limit) < 0)
		return pen_error_system(err, errno, "setrlimit");
	return 0;
}

static int set_limits(const struct pen_sandbox_limits *limits, struct pen_error *err)
{
	int r;

	r = set_limit(RLIMIT_CORE, 0, err);
	if (r == 0)
		r = set_limit(RLIMIT_NOFILE, limits->files ? limits->files : FILES_DEFAULT, err);
	if (r == 0 && limits->memory_bytes && !SANITIZER)
		r = set_limit(RLIMIT_AS, limits->memory_bytes, err);
	if (r == 0 && limits->cpu_s)
		r = set_limit(RLIMIT_CPU, limits->cpu_s, err);
	return r;
}

/* Without this a caller could open files that belong to the user, or signal other processes. */
static int enter_landlock(enum pen_sandbox_mode mode, struct pen_error *err)
{
	struct landlock_rules rules = {.fs = LANDLOCK_FS_ABI1};
	long abi = syscall(SYS_landlock_create_ruleset, NULL, 0, LANDLOCK_CREATE_RULESET_VERSION);
	size_t size = abi >= 6 ? 24 : abi >= 4 ? 16 : 8;
	long fd;
	int r = 0;

	if (abi < 1 && mode == PEN_SANDBOX_BEST_EFFORT)
		return 0;
	if (abi < 1)
		return pen_error_set(err, PEN_EUNSUPPORTED, "this kernel lacks Landlock: %s",
			errno == EOPNOTSUPP ? "it was started without landlock among its lsm="
					    : "it takes Linux 5.13 or later with "
					      "CONFIG_SECURITY_LANDLOCK, and leave to use it");
	rules.fs |= (abi >= 2 ? LANDLOCK_FS_REFER : 0) | (abi >= 3 ? LANDLOCK_FS_TRUNCATE : 0) |
		    (abi >= 5 ? LANDLOCK_FS_IOCTL_DEV : 0);
	rules.net = LANDLOCK_NET_TCP;
	rules.scoped = LANDLOCK_SCOPE_ALL;
	fd = syscall(SYS_landlock_create_ruleset, &rules, size, 0);
	if (fd < 0)
		return pen_error_system(err, errno, "landlock_create_ruleset");
	if (syscall(SYS_landlock_restrict_self, fd, 0) < 0)
		r = pen_error_system(err, errno, "landlock_restrict_self");
	(void)close((int)fd);
	return r;
}

static int allow(scmp_filter_ctx filter, const int *calls, size_t count)
{
	int r = 0;

	for (size_t i = 0; i < count && r == 0; i++)
		r = seccomp_rule_add(filter, SCMP_ACT_ALLOW, calls[i], 0);
	return r;
}

static int allow_when(scmp_filter_ctx filter, const struct condition *conditions, size_t count)
{
	int r = 0;

	for (size_t i = 0; i < count && r == 0; i++) {
		const struct condition *c = &conditions[i];
		struct scmp_arg_cmp compare = {c->argument, SCMP_CMP_MASKED_EQ, c->mask, c->value};

		r = seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, c->call, 1, &compare);
	}
	return r;
}

static int refuse(scmp_filter_ctx filter)
{
	int r = 0;

	for (size_t i = 0; i < COUNT(refused_calls) && r == 0; i++)
		r = seccomp_rule_add(filter, SCMP_ACT_ERRNO((uint32_t)refused_calls[i].error),
			refused_calls[i].call, 0);
	return r;
}

static int allow_own_abort(scmp_filter_ctx filter)
{
	return seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 2,
		SCMP_A0_32(SCMP_CMP_EQ, (uint32_t)getpid(), 0),
		SCMP_A2_32(SCMP_CMP_EQ, SIGABRT, 0));
}

static int add_rules(scmp_filter_ctx filter, enum pen_sandbox_profile profile)
{
	int r;

	r = seccomp_attr_set(filter, SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_KILL_PROCESS);
	if (r == 0)
		r = seccomp_attr_set(filter, SCMP_FLTATR_CTL_OPTIMIZE, 2);
	if (r == 0)
		r = allow(filter, common_calls, COUNT(common_calls));
	if (r == 0)
		r = allow_when(filter, common_conditions, COUNT(common_conditions));
	if (r == 0)
		r = refuse(filter);
	if (r < 0)
		return r;
	if (profile == PEN_SANDBOX_SCENE) {
		r = allow(filter, scene_calls, COUNT(scene_calls));
		return r < 0 ? r : allow_when(filter, scene_conditions, COUNT(scene_conditions));
	}
	r = allow_own_abort(filter);
	if (r == 0 && profile == PEN_SANDBOX_ENCODER)
		r = allow(filter, encoder_calls, COUNT(encoder_calls));
	return r;
}

static int make_filter(enum pen_sandbox_profile profile)
{
	/* libseccomp makes none for a kernel that could not load it, and says no reason. */
	scmp_filter_ctx filter = seccomp_init(SCMP_ACT_KILL_PROCESS);
	int r = filter ? add_rules(filter, profile) : -ENOSYS;

	if (r == 0)
		r = seccomp_load(filter);
	if (filter)
		seccomp_release(filter);
	return r;
}

static int enter_seccomp(
	enum pen_sandbox_profile profile, enum pen_sandbox_mode mode, struct pen_error *err)
{
	int r = make_filter(profile);

	if (r == 0 || mode == PEN_SANDBOX_BEST_EFFORT)
		return 0;
	return pen_error_set(err, PEN_EUNSUPPORTED,
		"this kernel lacks seccomp filters (%s): they take CONFIG_SECCOMP_FILTER, and "
		"leave to use them",
		strerror(-r));
}

/* Root without capabilities cannot pass itself off as another process, nor override modes. */
static int drop_capabilities(struct pen_error *err)
{
	struct __user_cap_header_struct header = {.version = _LINUX_CAPABILITY_VERSION_3};
	const struct __user_cap_data_struct none[_LINUX_CAPABILITY_U32S_3] = {{0}};

	if (syscall(SYS_capset, &header, none) < 0)
		return pen_error_system(err, errno, "capset");
	return 0;
}

int pen_sandbox_enter(enum pen_sandbox_profile profile, enum pen_sandbox_mode mode,
	const struct pen_sandbox_limits *limits, struct pen_error *err)
{
	int r;

	r = set_limits(limits, err);
	if (r == 0 && profile == PEN_SANDBOX_RENDER)
		r = set_limit(RLIMIT_FSIZE, 0, err);
	if (r < 0)
		return r;
	/* Last words to a log that is a file fail; the process ends by what it says, not by them.
	 */
	(void)signal(SIGXFSZ, SIG_IGN);
	if (prctl(PR_SET_DUMPABLE, 0) < 0 || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) < 0)
		return pen_error_system(err, errno, "prctl");
	(void)umask(077);
	if (SANITIZER || mode == PEN_SANDBOX_OFF)
		return 0;
	/* What a render process inherits from its scene process needs no second time. */
	if (profile != PEN_SANDBOX_RENDER) {
		r = drop_capabilities(err);
		if (r == 0)
			r = enter_landlock(mode, err);
	}
	return r < 0 ? r : enter_seccomp(profile, mode, err);
}

int pen_sandbox_allow_cpu(uint32_t seconds, struct pen_error *err)
{
	struct rlimit limit;
	struct rusage used;
	rlim_t end;

	if (SANITIZER)
		return 0;
	if (getrusage(RUSAGE_SELF, &used) < 0 || getrlimit(RLIMIT_CPU, &limit) < 0)
		return pen_error_system(err, errno, "RLIMIT_CPU");
	/* The kernel counts whole seconds: two are begun already. */
	end = (rlim_t)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + 2 + seconds;
	limit.rlim_cur = seconds > 0 && end < limit.rlim_max ? end : limit.rlim_max;
	return setrlimit(RLIMIT_CPU, &limit) < 0 ? pen_error_system(err, errno, "RLIMIT_CPU") : 0;
}

int pen_process_bind(pid_t parent, int signal_number, struct pen_error *err)
{
	if (prctl(PR_SET_PDEATHSIG, signal_number) < 0)
		return pen_error_system(err, errno, "PR_SET_PDEATHSIG");
	if (getppid() != parent)
		_exit(EXIT_FAILURE);
	return 0;
}

int pen_process_close_except(const int *keep, size_t count, struct pen_error *err)
{
	unsigned int first = STDERR_FILENO + 1;

	/* One gap between kept descriptors after another, in order. */
	for (;;) {
		unsigned int next = ~0u;

		for (size_t i = 0; i < count; i++)
			if ((unsigned int)keep[i] >= first && (unsigned int)keep[i] < next)
				next = (unsigned int)keep[i];
		if (next > first && close_range(first, next == ~0u ? next : next - 1, 0) < 0)
			return pen_error_system(err, errno, "close_range");
		if (next == ~0u)
			return 0;
		first = next + 1;
	}
}
