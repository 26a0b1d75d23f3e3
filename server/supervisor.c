/* SPDX-License-Identifier: Apache-2.0 */
#include "server/supervisor.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <systemd/sd-daemon.h>

static void handle_watchdog(uv_timer_t *timer)
{
	(void)timer;
	(void)sd_notify(0, "WATCHDOG=1");
}

bool pen_supervisor_is_there(void)
{
	return getenv("NOTIFY_SOCKET") != NULL;
}

void pen_supervisor_init(struct pen_supervisor *supervisor, uv_loop_t *loop)
{
	uint64_t interval_us = 0;

	supervisor->stopping = false;
	(void)uv_timer_init(loop, &supervisor->watchdog);
	/* Half the time that is allowed, as the manual advises. The loop does not stay for it. */
	if (sd_watchdog_enabled(0, &interval_us) > 0)
		(void)uv_timer_start(
			&supervisor->watchdog, handle_watchdog, 0, interval_us / 2000 + 1);
	uv_unref((uv_handle_t *)&supervisor->watchdog);
}

void pen_supervisor_ready(struct pen_supervisor *supervisor, const char *status)
{
	if (!supervisor->stopping)
		(void)sd_notifyf(0, "READY=1\nSTATUS=%s", status);
}

void pen_supervisor_stop(struct pen_supervisor *supervisor)
{
	if (supervisor->stopping)
		return;
	supervisor->stopping = true;
	(void)sd_notify(0, "STOPPING=1");
	uv_close((uv_handle_t *)&supervisor->watchdog, NULL);
}

int pen_supervisor_socket(const char *name)
{
	char **names = NULL;
	int count = sd_listen_fds_with_names(0, &names);
	int fd = -1;

	for (int i = 0; i < count; i++) {
		const int candidate = SD_LISTEN_FDS_START + i;

		if (fd < 0 && strcmp(names[i], name) == 0 &&
			sd_is_socket(candidate, AF_UNSPEC, SOCK_STREAM, 1) > 0)
			fd = candidate;
		free(names[i]);
	}
	free(names);
	return fd;
}
