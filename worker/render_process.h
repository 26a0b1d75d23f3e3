/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_RENDER_PROCESS_H
#define PEN_WORKER_RENDER_PROCESS_H

#include "worker/config.h"
#include "worker/view.h"

#include <stdint.h>
#include <sys/types.h>

/*
 * A render process: takes orders from channel, renders them from the frames that it shares with its
 * parent, and leaves the pixels in the slot's result memory. Called after the fork; ends when the
 * pool closes the channel or the parent dies, with _exit: the parent's buffers and threads are not
 * its own.
 */
_Noreturn void pen_render_process_run(const struct pen_worker_config *config, struct pen_view *view,
	pid_t parent, int channel, int results, uint32_t slot);

#endif
