/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/scene_process.h"

#include "core/base/log.h"
#include "core/render/pictures.h"
#include "core/render/shot.h"
#include "core/scene/gltf.h"
#include "core/scene/parse.h"
#include "worker/channel.h"
#include "worker/intake.h"
#include "worker/memory.h"
#include "worker/render_process.h"
#include "worker/view.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

struct scene_process {
	const struct pen_worker_config *config;
	pid_t pid; /* our own */
	int channel, results, signals;
	struct pen_view view;		   /* its shot is NULL until it has been built */
	pid_t children[PEN_PROCESSES_MAX]; /* of each slot; 0 = none */
	uint32_t serials[PEN_PROCESSES_MAX];
};

#define MEMORY_MIN (4ull << 30)

/* Half of the machine's memory. Address space counts, and every thread reserves some of it. */
static uint64_t memory_limit(void)
{
	uint64_t half = (uint64_t)sysconf(_SC_PHYS_PAGES) * (uint64_t)sysconf(_SC_PAGESIZE) / 2;

	return half > MEMORY_MIN ? half : MEMORY_MIN;
}

/* Before any thread exists: limits bind to the thread that takes them and to its children. */
static int confine(struct scene_process *self, pid_t parent, struct pen_error *err)
{
	const int keep[] = {self->channel, self->results};
	struct pen_sandbox_limits limits = {.memory_bytes = memory_limit()};
	sigset_t child;
	int r;

	(void)prctl(PR_SET_NAME, "pen-scene");
	r = pen_process_bind(parent, SIGKILL, err);
	if (r == 0)
		r = pen_process_close_except(keep, 2, err);
	if (r < 0)
		return r;
	(void)sigemptyset(&child);
	(void)sigaddset(&child, SIGCHLD);
	(void)sigprocmask(SIG_SETMASK, &child, NULL);
	self->signals = signalfd(-1, &child, SFD_CLOEXEC);
	if (self->signals < 0)
		return pen_error_system(err, errno, "signalfd");
	return pen_sandbox_enter(PEN_SANDBOX_SCENE, self->config->sandbox, &limits, err);
}

/* The pool has gone when it cannot be told. */
static void tell(const struct scene_process *self, const struct pen_control *control)
{
	if (pen_channel_send(self->channel, control, sizeof *control, NULL, 0) < 0)
		_exit(EXIT_FAILURE);
}

/* All of them; the first one is why it fails. */
static void tell_errors(const struct scene_process *self, const struct pen_scene_errors *errors,
	struct pen_error *err)
{
	if (errors->count > 0)
		(void)pen_error_set(err, PEN_EINVALID, "%s: %s", errors->items[0].pointer,
			errors->items[0].detail);
	for (size_t i = 0; i < errors->count; i++) {
		struct pen_control control = {.type = PEN_CONTROL_ERROR};

		(void)snprintf(
			control.pointer, sizeof control.pointer, "%s", errors->items[i].pointer);
		(void)snprintf(
			control.reason, sizeof control.reason, "%s", errors->items[i].detail);
		tell(self, &control);
	}
}

static void tell_warnings(const struct scene_process *self, const struct pen_scene *scene)
{
	for (uint32_t i = 0; i < scene->warning_count; i++) {
		struct pen_control control = {.type = PEN_CONTROL_WARNING};

		(void)snprintf(control.reason, sizeof control.reason, "%s", scene->warnings[i]);
		tell(self, &control);
	}
}

/* What a scene is built from and with. */
struct building {
	struct scene_process *self;
	struct pen_scene *scene;
	struct pen_pictures *pictures;
	struct pen_scene_errors *errors;
};

static int expand(void *user, const struct pen_blob *blobs, struct pen_error *err)
{
	struct building *building = user;
	int r = pen_scene_expand(building->scene, blobs, building->errors, err);

	if (r == 0)
		r = pen_pictures_load(
			building->scene, blobs, building->errors, &building->pictures, err);
	return r;
}

/* The scene's memory, and its pictures', stays for the life of the process. */
static int build(struct scene_process *self, const char *text, size_t size, struct pen_error *err)
{
	struct building building = {.self = self, .errors = calloc(1, sizeof *building.errors)};
	json_t *tree = NULL;
	int r;

	if (!building.errors)
		return pen_error_memory(err);
	r = pen_json_parse(text, size, &tree, err);
	if (r == 0)
		r = pen_scene_parse(tree, &building.scene, building.errors, err);
	if (r == 0)
		r = pen_intake_run(self->channel, building.scene, expand, &building, err);
	self->view.scene = building.scene;
	if (r < 0)
		tell_errors(self, building.errors, err);
	else
		r = pen_render_shot_create(building.scene, building.pictures, self->config->isa,
			&self->view.shot, err);
	if (r == 0)
		tell_warnings(self, building.scene);
	json_decref(tree);
	free(building.errors);
	return r;
}

static void tell_failure(const struct scene_process *self, const struct pen_error *err)
{
	struct pen_control control = {.type = PEN_CONTROL_FAILED};

	(void)snprintf(control.reason, sizeof control.reason, "%.*s",
		(int)sizeof control.reason - 1, err->text);
	tell(self, &control);
}

static void load(struct scene_process *self, int text_fd, uint32_t frame)
{
	struct pen_error err = PEN_ERROR_INIT;
	const void *text;
	size_t size;
	int r;

	r = pen_memory_map(text_fd, &text, &size, &err);
	(void)close(text_fd);
	if (r == 0) {
		r = build(self, text, size, &err);
		(void)munmap((void *)(uintptr_t)text, size);
	}
	if (r == 0)
		r = pen_render_shot_prepare(self->view.shot, frame, &err);
	if (r == 0)
		tell(self, &(struct pen_control){.type = PEN_CONTROL_READY});
	else
		tell_failure(self, &err);
}

static void look(struct scene_process *self, int text_fd)
{
	struct pen_error err = PEN_ERROR_INIT;
	const void *text;
	size_t size;
	int r = pen_memory_map(text_fd, &text, &size, &err);

	(void)close(text_fd);
	if (r == 0) {
		r = pen_view_take(&self->view, text, size, &err);
		(void)munmap((void *)(uintptr_t)text, size);
	}
	if (r < 0)
		tell_failure(self, &err);
}

static void tell_child(const struct scene_process *self, uint32_t slot, int status)
{
	tell(self, &(struct pen_control){
			   .type = PEN_CONTROL_CHILD,
			   .id = slot,
			   .status = status,
			   .serial = self->serials[slot],
		   });
}

/* The slot's process before, if there is one, has been ended by the pool, which knows. */
static void start(struct scene_process *self, const struct pen_control *control, int child_channel)
{
	struct pen_error err = PEN_ERROR_INIT;
	const uint32_t slot = control->id;
	pid_t pid;

	self->children[slot] = 0;
	self->serials[slot] = control->serial;
	if (pen_render_shot_prepare(self->view.shot, control->frame, &err) < 0) {
		(void)close(child_channel);
		tell_failure(self, &err);
		return;
	}
	pid = fork();
	if (pid == 0)
		pen_render_process_run(
			self->config, &self->view, self->pid, child_channel, self->results, slot);
	(void)close(child_channel);
	if (pid > 0)
		self->children[slot] = pid;
	else
		tell_child(self, slot, W_EXITCODE(EXIT_FAILURE, 0));
}

static void reap(struct scene_process *self)
{
	struct signalfd_siginfo info;
	int status;
	pid_t pid;

	(void)!read(self->signals, &info, sizeof info);
	while ((pid = waitpid(-1, &status, WNOHANG | WUNTRACED)) > 0)
		for (uint32_t slot = 0; slot < self->config->processes; slot++)
			if (self->children[slot] == pid) {
				if (!WIFSTOPPED(status))
					self->children[slot] = 0;
				tell_child(self, slot, status);
			}
}

/* An order that makes no sense comes from no pool: leave. */
static void obey(struct scene_process *self)
{
	struct pen_control control;
	int fd;

	if (pen_channel_receive(self->channel, &control, sizeof control, &fd, 1, NULL) < 0)
		_exit(EXIT_SUCCESS);
	if (control.type == PEN_CONTROL_LOAD && !self->view.shot && fd >= 0)
		load(self, fd, control.frame);
	else if (control.type == PEN_CONTROL_LOOK && self->view.shot && fd >= 0)
		look(self, fd);
	else if (control.type == PEN_CONTROL_START && self->view.shot && fd >= 0 &&
		 control.id < self->config->processes)
		start(self, &control, fd);
	else
		_exit(EXIT_FAILURE);
}

void pen_scene_process_run(
	const struct pen_worker_config *config, pid_t parent, int channel, int results)
{
	struct scene_process self = {
		.config = config,
		.pid = getpid(),
		.channel = channel,
		.results = results,
	};
	struct pen_error err = PEN_ERROR_INIT;
	struct pollfd polls[2] = {{.fd = channel, .events = POLLIN}, {.events = POLLIN}};
	int r;

	r = confine(&self, parent, &err);
	if (r == 0)
		r = pen_render_warm_up(config->isa, &err);
	if (r < 0) {
		pen_log(PEN_LOG_ERROR, "scene process: %s", err.text);
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
