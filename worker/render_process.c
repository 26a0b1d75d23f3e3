/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render_process.h"

#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/base/log.h"
#include "worker/channel.h"
#include "worker/memory.h"

#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <unistd.h>

static int confine(const struct pen_worker_config *config, pid_t parent, int channel, int results,
	struct pen_error *err)
{
	const int keep[] = {channel, results};
	const struct pen_sandbox_limits limits = {0};
	sigset_t none;
	int r;

	(void)prctl(PR_SET_NAME, "pen-render");
	(void)sigemptyset(&none);
	(void)sigprocmask(SIG_SETMASK, &none, NULL);
	r = pen_process_bind(parent, SIGKILL, err);
	if (r == 0)
		r = pen_process_close_except(keep, 2, err);
	if (r == 0)
		r = pen_sandbox_enter(PEN_SANDBOX_RENDER, config->sandbox, &limits, err);
	return r;
}

struct render_process {
	struct pen_view *view;
	const struct pen_render_scene *scene; /* the frame rendered last */
	struct pen_renderer *renderer;
	struct pen_result *result;
};

/* False for a frame or a place that is not there: no pool orders that. */
static bool render(
	struct render_process *self, const struct pen_order *order, struct pen_answer *ret_answer)
{
	const struct pen_render_scene *scene =
		pen_render_shot_scene(self->view->shot, order->unit.frame);
	size_t size = pen_rect_area(order->unit.rect) * order->channels * sizeof(float);
	int64_t start_us = pen_clock_us();
	float *pixels;

	if (!scene || order->place >= PEN_RESULT_PLACES)
		return false;
	pixels = self->result->pixels[order->place];
	if (scene != self->scene)
		pen_renderer_set_scene(self->renderer, scene);
	self->scene = scene;
	*ret_answer = (struct pen_answer){.lease = order->lease};
	atomic_store(&self->result->progress, 0);
	pen_renderer_unit(
		self->renderer, &order->unit, pixels, &ret_answer->stats, &self->result->progress);
	ret_answer->xxh3 = pen_xxh3(pixels, size);
	ret_answer->render_us = (uint64_t)(pen_clock_us() - start_us);
	return true;
}

/* The frames of an animation cannot be made here: then none is ready. */
static bool look(
	struct render_process *self, int channel, size_t size, struct pen_answer *ret_answer)
{
	char *text = size > 0 && size <= PEN_LOOK_BYTES_MAX ? malloc(size) : NULL;
	struct pen_answer answer = {0};
	struct pen_error err = PEN_ERROR_INIT;
	bool looks;

	looks = text && read(channel, text, size) == (ssize_t)size &&
		pen_view_take(self->view, text, size, &err) == 0;
	free(text);
	pen_render_shot_ready(self->view->shot, &answer.frame_first, &answer.frame_end);
	if (looks && answer.frame_first < answer.frame_end) {
		pen_renderer_destroy(self->renderer);
		self->renderer = NULL;
		self->scene = pen_render_shot_scene(self->view->shot, answer.frame_first);
		looks = pen_renderer_create(self->scene, &self->renderer, &err) == 0;
	}
	*ret_answer = answer;
	return looks;
}

/* Plain read and write: the sandbox has no other way to use a socket. */
static void serve(struct render_process *self, int channel)
{
	struct pen_answer answer = {0};
	struct pen_order order;

	pen_render_shot_ready(self->view->shot, &answer.frame_first, &answer.frame_end);
	while (write(channel, &answer, sizeof answer) == sizeof answer &&
		read(channel, &order, sizeof order) == sizeof order) {
		order.unit.mask = order.has_mask ? order.mask : NULL;
		if (order.lease == 0 ? !look(self, channel, order.channels, &answer)
				     : !render(self, &order, &answer))
			return;
	}
}

void pen_render_process_run(const struct pen_worker_config *config, struct pen_view *view,
	pid_t parent, int channel, int results, uint32_t slot)
{
	struct render_process self = {.view = view};
	struct pen_error err = PEN_ERROR_INIT;
	uint32_t first, end;
	int r;

	pen_render_shot_ready(view->shot, &first, &end);
	self.scene = pen_render_shot_scene(view->shot, first);
	r = confine(config, parent, channel, results, &err);
	if (r == 0)
		r = pen_memory_map_result(results, slot, &self.result, &err);
	if (r == 0)
		r = pen_renderer_create(self.scene, &self.renderer, &err);
	if (r == 0)
		serve(&self, channel);
	else
		pen_log(PEN_LOG_ERROR, "render process: %s", err.text);
	_exit(r == 0 ? EXIT_SUCCESS : EXIT_FAILURE);
}
