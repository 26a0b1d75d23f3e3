/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/watch.h"

#include <stdlib.h>
#include <unistd.h>

struct pen_watch {
	uv_poll_t poll;
	int fd;
	pen_watch_fn *fn;
	void *user;
};

static void handle_poll(uv_poll_t *poll, int status, int events)
{
	struct pen_watch *watch = poll->data;

	(void)status;
	(void)events;
	watch->fn(watch->user);
}

static void handle_closed(uv_handle_t *handle)
{
	free(handle->data);
}

int pen_watch_create(uv_loop_t *loop, int fd, pen_watch_fn *fn, void *user,
	struct pen_watch **ret_watch, struct pen_error *err)
{
	struct pen_watch *watch = calloc(1, sizeof *watch);
	int r;

	if (!watch) {
		(void)close(fd);
		return pen_error_memory(err);
	}
	*watch = (struct pen_watch){.fd = fd, .fn = fn, .user = user};
	r = uv_poll_init(loop, &watch->poll, fd);
	if (r < 0) {
		(void)close(fd);
		free(watch);
		return pen_error_system(err, -r, "uv_poll_init");
	}
	watch->poll.data = watch;
	(void)uv_poll_start(&watch->poll, UV_READABLE, handle_poll);
	*ret_watch = watch;
	return 0;
}

void pen_watch_destroy(struct pen_watch *watch)
{
	if (!watch)
		return;
	uv_close((uv_handle_t *)&watch->poll, handle_closed);
	(void)close(watch->fd);
}

int pen_watch_fd(const struct pen_watch *watch)
{
	return watch->fd;
}
