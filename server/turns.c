/* SPDX-License-Identifier: Apache-2.0 */
#include "server/turns.h"

#include <errno.h>
#include <malloc.h>
#include <microhttpd.h>

enum { RUNS_AT_ONCE = 8, STALLS = 16, STALLED_MS = 20, CROWD = 64 };

static void timer_due(uv_timer_t *timer);
static void idle_due(uv_idle_t *idle);

static unsigned connection_count(const struct pen_turns *turns)
{
	return MHD_get_daemon_info(turns->daemon, MHD_DAEMON_INFO_CURRENT_CONNECTIONS)
		->num_connections;
}

/* What a crowd has used stays with the process, in pieces, unless it is given back once it left. */
static void give_back_memory(struct pen_turns *turns)
{
	const unsigned count = connection_count(turns);

	if (count > turns->crowd)
		turns->crowd = count;
	if (turns->crowd < CROWD || count > turns->crowd / 4)
		return;
	turns->crowd = count;
	(void)malloc_trim(0);
}

/* It wants to run again. A timer of no time would be due before anything else on the loop. */
static void run_again(struct pen_turns *turns)
{
	const bool gets_on = turns->has_moved || pen_visitors_get_on(turns->visitors);

	turns->has_moved = false;
	turns->stalls = gets_on ? 0 : turns->stalls + 1;
	if (gets_on) {
		(void)uv_timer_stop(&turns->timer);
		(void)uv_idle_start(&turns->idle, idle_due);
		return;
	}
	(void)uv_idle_stop(&turns->idle);
	(void)uv_timer_start(&turns->timer, timer_due, turns->stalls < STALLS ? 1 : STALLED_MS, 0);
}

/*
 * Out of descriptors, libmicrohttpd stops listening; once connections have gone it listens again,
 * but only when it runs once more, for which nothing else may give a reason.
 */
static void take_turn(struct pen_turns *turns)
{
	MHD_UNSIGNED_LONG_LONG timeout_ms;
	bool has_timeout;
	unsigned before, runs = 0;

	do {
		before = connection_count(turns);
		(void)MHD_run(turns->daemon);
		has_timeout = MHD_get_timeout(turns->daemon, &timeout_ms) == MHD_YES;
	} while (connection_count(turns) < before ||
		 (has_timeout && timeout_ms == 0 && ++runs < RUNS_AT_ONCE));
	give_back_memory(turns);
	if (has_timeout && timeout_ms == 0) {
		run_again(turns);
		return;
	}
	turns->stalls = 0;
	(void)uv_idle_stop(&turns->idle);
	if (has_timeout)
		(void)uv_timer_start(&turns->timer, timer_due, timeout_ms, 0);
	else
		(void)uv_timer_stop(&turns->timer);
}

static void timer_due(uv_timer_t *timer)
{
	take_turn(timer->data);
}

static void idle_due(uv_idle_t *idle)
{
	take_turn(idle->data);
}

static void sockets_ready(uv_poll_t *poll, int status, int events)
{
	(void)status, (void)events;
	take_turn(poll->data);
}

int pen_turns_start(struct pen_turns *turns, uv_loop_t *loop, struct MHD_Daemon *daemon,
	struct pen_visitors *visitors, struct pen_error *err)
{
	const union MHD_DaemonInfo *info = MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_EPOLL_FD);
	int r;

	*turns = (struct pen_turns){.daemon = daemon, .visitors = visitors};
	r = uv_poll_init(loop, &turns->poll, info->epoll_fd);
	if (r < 0)
		return pen_error_system(err, -r, "cannot watch the HTTP server");
	(void)uv_timer_init(loop, &turns->timer);
	(void)uv_idle_init(loop, &turns->idle);
	turns->poll.data = turns->timer.data = turns->idle.data = turns;
	turns->handles = 3;
	(void)uv_poll_start(&turns->poll, UV_READABLE, sockets_ready);
	return 0;
}

void pen_turns_moved(struct pen_turns *turns)
{
	turns->has_moved = true;
}

void pen_turns_ask(struct pen_turns *turns)
{
	(void)uv_timer_start(&turns->timer, timer_due, 0, 0);
}

static void handle_closed(uv_handle_t *handle)
{
	struct pen_turns *turns = handle->data;

	if (--turns->handles == 0)
		turns->closed(turns->user);
}

void pen_turns_close(struct pen_turns *turns, void (*closed)(void *user), void *user)
{
	turns->closed = closed;
	turns->user = user;
	uv_close((uv_handle_t *)&turns->poll, handle_closed);
	uv_close((uv_handle_t *)&turns->timer, handle_closed);
	uv_close((uv_handle_t *)&turns->idle, handle_closed);
}
