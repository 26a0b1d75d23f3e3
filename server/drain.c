/* SPDX-License-Identifier: Apache-2.0 */
#include "server/drain.h"

#include "core/base/limits.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

enum { DRAINS_MAX = 64, PIECE = 64 << 10, PIECES_PER_EVENT = 64 };

struct pen_drain {
	struct pen_drains *drains;
	struct pen_drain *previous, *next;
	uv_poll_t poll;
	uv_timer_t deadline;
	unsigned handles;
	int fd;
	uint64_t left; /* bytes */
};

static void handle_closed(uv_handle_t *handle)
{
	struct pen_drain *drain = handle->data;

	if (--drain->handles > 0)
		return;
	(void)close(drain->fd);
	free(drain);
}

static void drain_close(struct pen_drain *drain)
{
	struct pen_drains *drains = drain->drains;

	if (drain->previous)
		drain->previous->next = drain->next;
	else
		drains->first = drain->next;
	if (drain->next)
		drain->next->previous = drain->previous;
	drains->count--;
	uv_close((uv_handle_t *)&drain->poll, handle_closed);
	uv_close((uv_handle_t *)&drain->deadline, handle_closed);
}

static void deadline_passed(uv_timer_t *timer)
{
	drain_close(timer->data);
}

static void bytes_came(uv_poll_t *poll, int status, int events)
{
	struct pen_drain *drain = poll->data;
	char piece[PIECE];

	(void)events;
	for (unsigned i = 0; status == 0 && i < PIECES_PER_EVENT; i++) {
		ssize_t n = recv(drain->fd, piece, sizeof piece, MSG_DONTWAIT);

		if (n < 0 && (errno == EAGAIN || errno == EINTR))
			return;
		if (n <= 0 || (uint64_t)n > drain->left) {
			drain_close(drain);
			return;
		}
		drain->left -= (uint64_t)n;
	}
	if (status < 0)
		drain_close(drain);
}

static void open_handle(struct pen_drain *drain, uv_handle_t *handle)
{
	handle->data = drain;
	drain->handles++;
}

void pen_drains_add(struct pen_drains *drains, int fd)
{
	struct pen_drain *drain = drains->count < DRAINS_MAX ? calloc(1, sizeof *drain) : NULL;

	if (!drain)
		return;
	drain->left = PEN_HTTP_DRAIN_MAX;
	drain->fd = fcntl(fd, F_DUPFD_CLOEXEC, 0);
	if (drain->fd < 0 || uv_poll_init(drains->loop, &drain->poll, drain->fd) < 0) {
		if (drain->fd >= 0)
			(void)close(drain->fd);
		free(drain);
		return;
	}
	open_handle(drain, (uv_handle_t *)&drain->poll);
	(void)uv_timer_init(drains->loop, &drain->deadline);
	open_handle(drain, (uv_handle_t *)&drain->deadline);
	(void)uv_timer_start(&drain->deadline, deadline_passed, PEN_HTTP_DRAIN_MS, 0);
	(void)uv_poll_start(&drain->poll, UV_READABLE, bytes_came);
	drain->drains = drains;
	drain->next = drains->first;
	if (drain->next)
		drain->next->previous = drain;
	drains->first = drain;
	drains->count++;
}

void pen_drains_finish(struct pen_drains *drains)
{
	while (drains->first)
		drain_close(drains->first);
}
