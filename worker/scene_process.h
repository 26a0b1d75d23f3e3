/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_SCENE_PROCESS_H
#define PEN_WORKER_SCENE_PROCESS_H

#include "worker/config.h"

#include <sys/types.h>

/*
 * A scene process: confines itself, warms the renderer up, waits for one scene, builds it, and then
 * forks the render processes that the pool asks for and tells how they end (see channel.h). Called
 * after the fork; ends when the pool closes the channel or the parent dies.
 */
_Noreturn void pen_scene_process_run(
	const struct pen_worker_config *config, pid_t parent, int channel, int results);

#endif
