/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_ZYGOTE_H
#define PEN_WORKER_ZYGOTE_H

#include "worker/channel.h"
#include "worker/config.h"

#include <sys/types.h>

/*
 * The process that forks scene processes: made first, while there is no key, loop, thread or
 * device that a process reading hostile input could inherit. It and all below it run at low
 * priority and leave SIGINT, which a terminal sends to everybody, to the pool.
 */
struct pen_zygote {
	int channel;
	pid_t pid;
};

/* config must outlive the zygote. */
int pen_zygote_start(const struct pen_worker_config *config, struct pen_zygote *ret_zygote,
	struct pen_error *err);

/* Ends it and all below it, and waits until they have gone. */
void pen_zygote_stop(struct pen_zygote *zygote);

/*
 * Asks for a scene process with these descriptors, which stay the caller's. Its end is told by a
 * PEN_CONTROL_CHILD with its id on the zygote's channel. PEN_ECLOSED: the zygote has gone.
 */
int pen_zygote_fork(const struct pen_zygote *zygote, uint32_t id, int channel, int results);

/* Ends a scene process by SIGKILL; nothing when it has ended already. */
int pen_zygote_kill(const struct pen_zygote *zygote, uint32_t id);

#endif
