/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SUPERVISOR_H
#define PEN_SERVER_SUPERVISOR_H

#include "core/base/error.h"

#include <stdbool.h>
#include <uv.h>

/*
 * The service manager that may have started the coordinator, spoken to as sd_notify(3) says: it
 * learns when the coordinator is ready and when it stops, and hears from its loop as often as its
 * watchdog asks. Without one, all of this does nothing.
 */
struct pen_supervisor {
	uv_timer_t watchdog; /* runs only when one is asked for */
	bool stopping;
};

/* Whether there is one. */
bool pen_supervisor_is_there(void);

void pen_supervisor_init(struct pen_supervisor *supervisor, uv_loop_t *loop);

/* Ready to serve; status is a line for people. */
void pen_supervisor_ready(struct pen_supervisor *supervisor, const char *status);

/* About to stop, which may take a while; closes the timer, whose memory goes when the loop ran. */
void pen_supervisor_stop(struct pen_supervisor *supervisor);

/*
 * The listening TCP socket that the manager passed under a name (FileDescriptorName=), or -1;
 * sd_listen_fds(3). It stays open for the life of the process.
 */
int pen_supervisor_socket(const char *name);

#endif
