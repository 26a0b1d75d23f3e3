/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/zygote.h"

#include "core/base/log.h"
#include "core/base/sandbox.h"
#include "worker/scene_process.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

/* The cached scenes, the spare, and as many that are on their way out. */
enum { CHILDREN_MAX = 4 * PEN_SCENES_CACHED_MAX, NICE = 10 };

struct zygote_process {
	const struct pen_worker_config *config;
	pid_t pid; /* our own */
	int channel, signals;
	struct {
		pid_t pid; /* 0 = free */
		uint32_t id;
	} children[CHILDREN_MAX];
};

static void tell_child(const struct zygote_process *self, uint32_t id, int status)
{
	struct pen_control control = {.type = PEN_CONTROL_CHILD, .id = id, .status = status};

	if (pen_channel_send(self->channel, &control, sizeof control, NULL, 0) < 0)
		_exit(EXIT_FAILURE);
}

static void fork_scene(struct zygote_process *self, uint32_t id, int channel, int results)
{
	size_t i = 0;
	pid_t pid;

	while (i < CHILDREN_MAX && self->children[i].pid != 0)
		i++;
	pid = i < CHILDREN_MAX ? fork() : -1;
	if (pid == 0)
		pen_scene_process_run(self->config, self->pid, channel, results);
	if (pid < 0) {
		tell_child(self, id, W_EXITCODE(EXIT_FAILURE, 0));
		return;
	}
	self->children[i].pid = pid;
	self->children[i].id = id;
}

static void kill_scene(const struct zygote_process *self, uint32_t id)
{
	for (size_t i = 0; i < CHILDREN_MAX; i++)
		if (self->children[i].pid != 0 && self->children[i].id == id)
			(void)kill(self->children[i].pid, SIGKILL);
}

static void reap(struct zygote_process *self)
{
	struct signalfd_siginfo info;
	int status;
	pid_t pid;

	(void)!read(self->signals, &info, sizeof info);
	while ((pid = waitpid(-1, &status, WNOHANG)) > 0)
		for (size_t i = 0; i < CHILDREN_MAX; i++)
			if (self->children[i].pid == pid) {
				self->children[i].pid = 0;
				tell_child(self, self->children[i].id, status);
			}
}

/* The pool has gone, or lets go: nobody is left behind, not even for init to wait for. */
static _Noreturn void leave(const struct zygote_process *self)
{
	for (size_t i = 0; i < CHILDREN_MAX; i++)
		if (self->children[i].pid != 0)
			(void)kill(self->children[i].pid, SIGKILL);
	while (wait(NULL) > 0)
		;
	_exit(EXIT_SUCCESS);
}

static void obey(struct zygote_process *self)
{
	struct pen_control control;
	int fds[2];

	if (pen_channel_receive(self->channel, &control, sizeof control, fds, 2, NULL) < 0)
		leave(self);
	if (control.type == PEN_CONTROL_FORK)
		fork_scene(self, control.id, fds[0], fds[1]);
	else if (control.type == PEN_CONTROL_KILL)
		kill_scene(self, control.id);
	for (size_t i = 0; i < 2; i++)
		if (fds[i] >= 0)
			(void)close(fds[i]);
}

/* Nothing of what the pool was started with, but a way to say why a process ends. */
static int forget_surroundings(struct pen_error *err)
{
	int null = open("/dev/null", O_RDWR | O_CLOEXEC);

	if (null < 0)
		return pen_error_system(err, errno, "/dev/null");
	(void)dup2(null, STDIN_FILENO);
	(void)dup2(null, STDOUT_FILENO);
	(void)close(null);
	(void)clearenv();
	return 0;
}

static int prepare(struct zygote_process *self, pid_t parent, struct pen_error *err)
{
	const struct sched_param batch = {0};
	sigset_t child;
	int r;

	(void)prctl(PR_SET_NAME, "pen-zygote");
	r = pen_process_bind(parent, SIGKILL, err);
	if (r == 0)
		r = pen_process_close_except(&self->channel, 1, err);
	if (r == 0)
		r = forget_surroundings(err);
	if (r < 0)
		return r;
	/* Render processes whose scene process has ended come to us, who waits for them. */
	if (prctl(PR_SET_CHILD_SUBREAPER, 1) < 0)
		return pen_error_system(err, errno, "PR_SET_CHILD_SUBREAPER");
	/* They are the pool's to heed, which lets units be finished: a terminal, systemd and Slurm
	 * send them to all processes that they started, or that these did. */
	(void)signal(SIGINT, SIG_IGN);
	(void)signal(SIGTERM, SIG_IGN);
	(void)setpriority(PRIO_PROCESS, 0, NICE);
	(void)sched_setscheduler(0, SCHED_BATCH, &batch);
	(void)sigemptyset(&child);
	(void)sigaddset(&child, SIGCHLD);
	(void)sigprocmask(SIG_SETMASK, &child, NULL);
	self->signals = signalfd(-1, &child, SFD_CLOEXEC);
	return self->signals < 0 ? pen_error_system(err, errno, "signalfd") : 0;
}

static _Noreturn void run(const struct pen_worker_config *config, pid_t parent, int channel)
{
	struct zygote_process self = {.config = config, .pid = getpid(), .channel = channel};
	struct pen_error err = PEN_ERROR_INIT;
	struct pollfd polls[2] = {{.fd = channel, .events = POLLIN}, {.events = POLLIN}};

	if (prepare(&self, parent, &err) < 0) {
		pen_log(PEN_LOG_ERROR, "zygote: %s", err.text);
		_exit(EXIT_FAILURE);
	}
	polls[1].fd = self.signals;
	for (;;) {
		if (poll(polls, 2, -1) < 0)
			continue;
		if (polls[1].revents)
			reap(&self);
		if (polls[0].revents)
			obey(&self);
	}
}

int pen_zygote_start(const struct pen_worker_config *config, struct pen_zygote *ret_zygote,
	struct pen_error *err)
{
	pid_t parent = getpid();
	int pool, child;
	pid_t pid;
	int r;

	r = pen_channel_pair(&pool, &child, err);
	if (r < 0)
		return r;
	pid = fork();
	if (pid == 0)
		run(config, parent, child);
	r = pid < 0 ? pen_error_system(err, errno, "fork") : 0;
	(void)close(child);
	if (r < 0)
		(void)close(pool);
	else
		*ret_zygote = (struct pen_zygote){pool, pid};
	return r;
}

void pen_zygote_stop(struct pen_zygote *zygote)
{
	(void)close(zygote->channel);
	while (waitpid(zygote->pid, NULL, 0) < 0 && errno == EINTR)
		;
}

int pen_zygote_fork(const struct pen_zygote *zygote, uint32_t id, int channel, int results)
{
	const struct pen_control control = {.type = PEN_CONTROL_FORK, .id = id};
	const int fds[2] = {channel, results};

	return pen_channel_send(zygote->channel, &control, sizeof control, fds, 2);
}

int pen_zygote_kill(const struct pen_zygote *zygote, uint32_t id)
{
	const struct pen_control control = {.type = PEN_CONTROL_KILL, .id = id};

	return pen_channel_send(zygote->channel, &control, sizeof control, NULL, 0);
}
