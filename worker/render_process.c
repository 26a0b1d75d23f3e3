/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render_process.h"

#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/base/log.h"
#include "worker/channel.h"
#include "worker/memory.h"

#include <signal.h>
#include <stdatomic.h>
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

static void render(struct pen_renderer *renderer, const struct pen_order *order,
	struct pen_result *result, struct pen_answer *ret_answer)
{
	size_t size = pen_rect_area(order->unit.rect) * order->channels * sizeof(float);
	int64_t start_us = pen_clock_us();

	*ret_answer = (struct pen_answer){.lease = order->lease};
	atomic_store(&result->progress, 0);
	pen_renderer_unit(
		renderer, &order->unit, result->pixels, &ret_answer->stats, &result->progress);
	ret_answer->xxh3 = pen_xxh3(result->pixels, size);
	ret_answer->render_us = (uint64_t)(pen_clock_us() - start_us);
}

/* Plain read and write: the sandbox has no other way to use a socket. */
static void serve(struct pen_renderer *renderer, int channel, struct pen_result *result)
{
	struct pen_answer answer = {0};
	struct pen_order order;

	while (write(channel, &answer, sizeof answer) == sizeof answer &&
		read(channel, &order, sizeof order) == sizeof order)
		render(renderer, &order, result, &answer);
}

void pen_render_process_run(const struct pen_worker_config *config,
	const struct pen_render_scene *scene, pid_t parent, int channel, int results, uint32_t slot)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_renderer *renderer;
	struct pen_result *result;
	int r;

	r = confine(config, parent, channel, results, &err);
	if (r == 0)
		r = pen_memory_map_result(results, slot, &result, &err);
	if (r == 0)
		r = pen_renderer_create(scene, &renderer, &err);
	if (r == 0)
		serve(renderer, channel, result);
	else
		pen_log(PEN_LOG_ERROR, "render process: %s", err.text);
	_exit(r == 0 ? EXIT_SUCCESS : EXIT_FAILURE);
}
