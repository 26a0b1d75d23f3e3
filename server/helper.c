/* SPDX-License-Identifier: Apache-2.0 */
#include "server/helper.h"

#include "core/base/limits.h"
#include "core/base/log.h"

#include <assert.h>
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

struct pen_helper {
	uv_process_t process;
	uv_poll_t poll;
	uv_timer_t deadline;
	unsigned handles; /* open; the last that closes frees the helper */
	int socket_fd;
	bool busy, ended;
	pen_helper_fn *fn; /* NULL once destroyed */
	void *user;
};

static void handle_closed(uv_handle_t *handle)
{
	struct pen_helper *helper = handle->data;

	if (--helper->handles > 0)
		return;
	(void)close(helper->socket_fd);
	free(helper);
}

static void open_handle(struct pen_helper *helper, uv_handle_t *handle)
{
	handle->data = helper;
	helper->handles++;
}

static void close_handles(struct pen_helper *helper)
{
	uv_close((uv_handle_t *)&helper->process, handle_closed);
	uv_close((uv_handle_t *)&helper->poll, handle_closed);
	uv_close((uv_handle_t *)&helper->deadline, handle_closed);
}

static void stop(struct pen_helper *helper)
{
	(void)uv_poll_stop(&helper->poll);
	(void)uv_timer_stop(&helper->deadline);
	(void)uv_process_kill(&helper->process, SIGKILL);
}

static void process_ended(uv_process_t *process, int64_t status, int signal_number)
{
	struct pen_helper *helper = process->data;

	(void)status, (void)signal_number;
	helper->ended = true;
	if (!helper->fn) {
		close_handles(helper);
		return;
	}
	(void)uv_poll_stop(&helper->poll);
	(void)uv_timer_stop(&helper->deadline);
	helper->fn(helper->user, NULL);
}

static void deadline_passed(uv_timer_t *timer)
{
	stop(timer->data);
}

static void socket_readable(uv_poll_t *poll, int status, int events)
{
	struct pen_helper *helper = poll->data;
	struct pen_encoding_reply reply;
	ssize_t n;

	(void)events;
	n = status < 0 ? 0 : recv(helper->socket_fd, &reply, sizeof reply, MSG_DONTWAIT);
	if (n < 0 && (errno == EAGAIN || errno == EINTR))
		return;
	if (n != (ssize_t)sizeof reply || !helper->busy ||
		!memchr(reply.text, '\0', sizeof reply.text)) {
		stop(helper);
		return;
	}
	helper->busy = false;
	(void)uv_timer_stop(&helper->deadline);
	helper->fn(helper->user, &reply);
}

static int spawn(struct pen_helper *helper, uv_loop_t *loop, const char *program,
	enum pen_sandbox_mode sandbox, int socket_fd)
{
	const char *arguments[] = {program, "--sandbox", pen_sandbox_mode_name(sandbox),
		"--log-format", pen_log_format_name(pen_log_format()), NULL};
	uv_stdio_container_t stdio[PEN_ENCODER_SOCKET + 1] = {
		{.flags = UV_IGNORE},
		{.flags = UV_IGNORE},
		{.flags = UV_INHERIT_FD, .data.fd = STDERR_FILENO},
		{.flags = UV_INHERIT_FD, .data.fd = socket_fd},
	};
	uv_process_options_t options = {
		.file = program,
		.args = (char **)(uintptr_t)arguments,
		.stdio = stdio,
		.stdio_count = PEN_ENCODER_SOCKET + 1,
		.exit_cb = process_ended,
	};

	return uv_spawn(loop, &helper->process, &options);
}

int pen_helper_create(uv_loop_t *loop, const char *program, enum pen_sandbox_mode sandbox,
	pen_helper_fn *fn, void *user, struct pen_helper **ret_helper, struct pen_error *err)
{
	struct pen_helper *helper = calloc(1, sizeof *helper);
	int sockets[2];
	int r;

	if (!helper)
		return pen_error_memory(err);
	if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets) < 0) {
		free(helper);
		return pen_error_system(err, errno, "socketpair");
	}
	helper->socket_fd = sockets[0];
	helper->fn = fn;
	helper->user = user;
	(void)uv_timer_init(loop, &helper->deadline);
	open_handle(helper, (uv_handle_t *)&helper->deadline);
	/* Cannot fail: a fresh socket, which no other handle watches. */
	r = uv_poll_init(loop, &helper->poll, helper->socket_fd);
	assert(r == 0);
	open_handle(helper, (uv_handle_t *)&helper->poll);
	open_handle(helper, (uv_handle_t *)&helper->process);
	r = spawn(helper, loop, program, sandbox, sockets[1]);
	(void)close(sockets[1]);
	if (r < 0) {
		close_handles(helper);
		return pen_error_system(err, -r, "cannot start %s", program);
	}
	(void)uv_poll_start(&helper->poll, UV_READABLE, socket_readable);
	*ret_helper = helper;
	return 0;
}

void pen_helper_send(struct pen_helper *helper, const struct pen_encoding_request *request,
	int framebuffer_fd, int file_fd)
{
	int fds[2] = {framebuffer_fd, file_fd};
	union {
		struct cmsghdr header;
		char space[CMSG_SPACE(sizeof fds)];
	} control = {.header = {.cmsg_level = SOL_SOCKET, .cmsg_type = SCM_RIGHTS}};
	struct pen_encoding_request copy = *request;
	struct iovec data = {.iov_base = &copy, .iov_len = sizeof copy};
	struct msghdr message = {
		.msg_iov = &data,
		.msg_iovlen = 1,
		.msg_control = control.space,
		.msg_controllen = sizeof control.space,
	};

	assert(!helper->busy && helper->fn);
	control.header.cmsg_len = CMSG_LEN(sizeof fds);
	memcpy(CMSG_DATA(&control.header), fds, sizeof fds);
	helper->busy = true;
	(void)uv_timer_start(&helper->deadline, deadline_passed, pen_encoding_ms(request), 0);
	if (sendmsg(helper->socket_fd, &message, MSG_DONTWAIT | MSG_NOSIGNAL) < 0)
		stop(helper);
}

void pen_helper_destroy(struct pen_helper *helper)
{
	if (!helper)
		return;
	helper->fn = NULL;
	if (helper->ended)
		close_handles(helper);
	else
		stop(helper);
}
