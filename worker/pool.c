/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/pool.h"

#include "core/base/clock.h"
#include "core/base/film.h"
#include "core/base/log.h"
#include "worker/cache.h"
#include "worker/session.h"
#include "worker/watch.h"

#include <assert.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/queue.h>
#include <uv.h>

enum {
	TICK_MS = 50,
	REVOKE_MS = 500, /* what a revoked unit may still take before its process is killed */
	DRAIN_MS = 10000,
	FLUSH_MS = 2000
};

struct lease {
	TAILQ_ENTRY(lease) link;
	struct pen_msg_lease msg;
	struct pen_host *host; /* NULL while it waits */
	uint32_t slot;
	int64_t end_ms; /* deadline, once it runs */
	bool revoked;	/* nobody wants its result */
	bool has_mask;
	uint8_t mask[]; /* PEN_MASK_BYTES_MAX, or none */
};

TAILQ_HEAD(lease_list, lease);

struct pool {
	const struct pen_worker_config *config;
	uv_loop_t loop;
	uv_timer_t tick, heartbeat;
	uv_signal_t terminate, interrupt;
	struct pen_watch *zygote_watch;
	struct pen_session *session;
	struct pen_cache *cache;
	struct lease_list leases; /* in order of arrival */
	uint32_t lease_count;
	struct lease *running[PEN_PROCESSES_MAX]; /* by slot */
	float *pixels;				  /* a result on its way from slot to connection */
	uint64_t worker;			  /* as the coordinator counts them, for logs */
	bool draining, finishing;
	int64_t drain_end_ms;
	int exit_code;
	struct pen_error *err;
};

static void remove_lease(struct pool *pool, struct lease *lease)
{
	if (lease->host)
		pool->running[lease->slot] = NULL;
	TAILQ_REMOVE(&pool->leases, lease, link);
	pool->lease_count--;
	free(lease);
}

static void send_failure(
	struct pool *pool, uint64_t lease, enum pen_fault fault, const char *reason)
{
	pen_session_send(pool->session, &(struct pen_msg){
						.type = PEN_FRAME_FAILURE,
						.u.failure = {lease, fault, reason},
					});
}

static void note(const struct pool *pool, const struct lease *lease, enum pen_log_level level,
	const char *what)
{
	const struct pen_msg_lease *msg = &lease->msg;
	const struct pen_log_about about = {.job = msg->render,
		.trace = msg->trace,
		.worker = pool->worker,
		.has_unit = true,
		.frame = msg->frame,
		.tile = msg->tile,
		.round = msg->round};

	pen_log_of(&about, level, "render %s, frame %u, tile %u, round %u: %s", msg->render,
		msg->frame, msg->tile, msg->round, what);
}

/* The lease ends without pixels. */
static void fail(struct pool *pool, struct lease *lease, enum pen_fault fault, const char *reason)
{
	if (!lease->revoked) {
		note(pool, lease, fault == PEN_FAULT_RETURNED ? PEN_LOG_DEBUG : PEN_LOG_WARNING,
			reason);
		send_failure(pool, lease->msg.lease, fault, reason);
	}
	remove_lease(pool, lease);
}

/* One that is still wanted: a coordinator that starts again counts its leases from 1 again. */
static struct lease *find_lease(struct pool *pool, uint64_t id)
{
	struct lease *lease;

	TAILQ_FOREACH (lease, &pool->leases, link)
		if (lease->msg.lease == id && !lease->revoked)
			return lease;
	return NULL;
}

static bool is_free(const struct pool *pool, const struct pen_host *host, uint32_t slot)
{
	return !pool->running[slot] && pen_host_idle(host, slot);
}

/* A free slot that is done with other frames shall have the one that is asked for now. */
static void turn_slot(struct pool *pool, struct pen_host *host, uint32_t frame)
{
	for (uint32_t i = 0; i < pool->config->processes; i++)
		if (is_free(pool, host, i) && !pen_host_has_frame(host, i, frame)) {
			pen_host_turn(host, i, frame);
			return;
		}
}

static bool start_unit(struct pool *pool, struct lease *lease, struct pen_host *host)
{
	struct pen_order order = {
		.lease = lease->msg.lease,
		.unit = {lease->msg.rect, lease->msg.frame, lease->msg.sample_first,
			lease->msg.sample_end, lease->msg.at_centre, NULL},
		.channels = lease->msg.channels,
		.has_mask = lease->has_mask,
	};

	if (lease->has_mask)
		memcpy(order.mask, lease->mask, sizeof order.mask);

	for (uint32_t i = 0; i < pool->config->processes; i++) {
		if (!is_free(pool, host, i) || !pen_host_has_frame(host, i, order.unit.frame) ||
			!pen_host_order(host, i, &order))
			continue;
		lease->host = host;
		lease->slot = i;
		lease->end_ms = pen_clock_ms() + lease->msg.deadline_ms;
		pool->running[i] = lease;
		return true;
	}
	return false;
}

static void tell_findings(struct pool *pool, const struct lease *lease)
{
	struct pen_msg msg = {.type = PEN_FRAME_SCENE_REPORT};

	if (pen_cache_report(
		    pool->cache, &lease->msg.scene_sha256, lease->msg.job, &msg.u.scene_report))
		pen_session_send(pool->session, &msg);
}

/* Gives free slots the units that can be rendered now, and asks for the scenes of the others. */
static void dispatch(struct pool *pool)
{
	struct lease *lease, *next;

	for (lease = TAILQ_FIRST(&pool->leases); lease; lease = next) {
		struct pen_msg_failure failure;
		struct pen_host *host;

		next = TAILQ_NEXT(lease, link);
		if (lease->host)
			continue;
		switch (pen_cache_demand(pool->cache, &lease->msg, &host, &failure)) {
		case PEN_DEMAND_READY:
			tell_findings(pool, lease);
			if (!start_unit(pool, lease, host))
				turn_slot(pool, host, lease->msg.frame);
			break;
		case PEN_DEMAND_WAIT: break;
		case PEN_DEMAND_FAILED:
			tell_findings(pool, lease);
			fail(pool, lease, failure.fault, failure.reason);
			break;
		}
	}
}

static void finish(struct pool *pool, int exit_code)
{
	if (pool->finishing)
		return;
	pool->finishing = true;
	pool->exit_code = exit_code;
	pool->drain_end_ms = pen_clock_ms() + FLUSH_MS;
	pen_session_finish(pool->session);
}

static void finish_when_drained(struct pool *pool)
{
	if (pool->draining && TAILQ_EMPTY(&pool->leases))
		finish(pool, PEN_WORKER_DONE);
}

/* What the cache tells. */

static void handle_fetch(void *user, const struct pen_sha256 *sha256)
{
	struct pool *pool = user;

	pen_session_send(pool->session, &(struct pen_msg){
						.type = PEN_FRAME_SCENE_GET,
						.u.scene_get = {*sha256},
					});
}

static void handle_fetch_asset(void *user, const struct pen_sha256 *sha256)
{
	struct pool *pool = user;

	pen_session_send(pool->session, &(struct pen_msg){
						.type = PEN_FRAME_ASSET_GET,
						.u.scene_get = {*sha256},
					});
}

static bool handle_in_use(void *user, const struct pen_sha256 *sha256)
{
	struct pool *pool = user;
	struct lease *lease;

	TAILQ_FOREACH (lease, &pool->leases, link)
		if (pen_sha256_equal(&lease->msg.scene_sha256, sha256))
			return true;
	return false;
}

static bool handle_is_wanted(void *user, const struct pen_sha256 *sha256)
{
	struct pool *pool = user;
	struct lease *lease;

	TAILQ_FOREACH (lease, &pool->leases, link)
		if (!lease->revoked && pen_sha256_equal(&lease->msg.scene_sha256, sha256))
			return true;
	return false;
}

static void handle_crashed(
	void *user, const struct pen_sha256 *sha256, enum pen_fault fault, const char *reason)
{
	struct pool *pool = user;
	struct lease *lease;

	TAILQ_FOREACH (lease, &pool->leases, link)
		if (pen_sha256_equal(&lease->msg.scene_sha256, sha256)) {
			fail(pool, lease, fault, reason);
			return;
		}
}

static void handle_changed(void *user)
{
	dispatch(user);
}

static void send_result(
	struct pool *pool, const struct lease *lease, const struct pen_answer *answer, size_t size)
{
	struct pen_msg msg = {
		.type = PEN_FRAME_RESULT,
		.u.result =
			{
				.lease = lease->msg.lease,
				.job = lease->msg.job,
				.epoch = lease->msg.epoch,
				.tile = lease->msg.tile,
				.round = lease->msg.round,
				.xxh3 = answer->xxh3,
				.render_us = answer->render_us < UINT32_MAX
						     ? (uint32_t)answer->render_us
						     : UINT32_MAX,
				.rays = answer->stats.rays,
				.rays_dropped = answer->stats.rays_dropped,
				.samples_black = answer->stats.samples_black,
				.frame = lease->msg.frame,
			},
		.payload = pool->pixels,
		.payload_size = size,
	};

	pen_session_send(pool->session, &msg);
}

/* Ends a slot's process; what it has just begun waits again. */
static void replace_process(struct pool *pool, struct pen_host *host, uint32_t slot)
{
	struct lease *next = pool->running[slot];

	pen_host_abort(host, slot);
	pool->running[slot] = NULL;
	if (next)
		next->host = NULL;
}

/*
 * The pixels are copied before they are checked: their writer could still change them. Before
 * either its slot gets the next unit. Until the end the lease stays where it is, and its host with
 * it.
 */
static void handle_done(void *user, struct pen_host *host, uint32_t slot,
	const struct pen_answer *answer, const float *pixels)
{
	struct pool *pool = user;
	struct lease *lease = pool->running[slot];
	size_t count, size;

	assert(lease && lease->msg.lease == answer->lease && lease->host == host);
	pool->running[slot] = NULL;
	dispatch(pool);
	count = pen_rect_area(lease->msg.rect) * lease->msg.channels;
	size = count * sizeof *pool->pixels;
	memcpy(pool->pixels, pixels, size);
	lease->host = NULL;
	if (pen_xxh3(pool->pixels, size) != answer->xxh3 ||
		!pen_film_is_finite(pool->pixels, count)) {
		replace_process(pool, host, slot);
		fail(pool, lease, PEN_FAULT_CRASH, "render process gave damaged pixels");
	} else {
		note(pool, lease, PEN_LOG_DEBUG, "rendered");
		if (!lease->revoked)
			send_result(pool, lease, answer, size);
		remove_lease(pool, lease);
	}
	finish_when_drained(pool);
}

static void handle_lost(
	void *user, uint32_t slot, uint64_t id, enum pen_fault fault, const char *reason)
{
	struct pool *pool = user;
	struct lease *lease = pool->running[slot];

	if (lease && lease->msg.lease == id)
		fail(pool, lease, fault, reason);
}

static const struct pen_cache_events cache_events = {
	.fetch = handle_fetch,
	.fetch_asset = handle_fetch_asset,
	.in_use = handle_in_use,
	.is_wanted = handle_is_wanted,
	.crashed = handle_crashed,
	.changed = handle_changed,
	.done = handle_done,
	.lost = handle_lost,
};

/* What the coordinator says. */

static void accept_lease(struct pool *pool, const struct pen_msg *received)
{
	const struct pen_msg_lease *msg = &received->u.lease;
	const bool has_mask = received->payload_size > 0;
	struct lease *lease = NULL;

	if (!pool->draining && msg->lease != 0 && pool->lease_count < PEN_LEASES_MAX)
		lease = calloc(1, sizeof *lease + (has_mask ? PEN_MASK_BYTES_MAX : 0));
	if (!lease) {
		send_failure(pool, msg->lease, PEN_FAULT_RETURNED,
			pool->draining ? "the worker is leaving" : "the worker is full");
		return;
	}
	lease->msg = *msg;
	lease->has_mask = has_mask;
	if (has_mask)
		memcpy(lease->mask, received->payload, received->payload_size);
	TAILQ_INSERT_TAIL(&pool->leases, lease, link);
	pool->lease_count++;
	dispatch(pool);
}

/* A waiting unit goes; a running one may finish, unless that takes long. */
static void let_go(struct pool *pool, struct lease *lease)
{
	int64_t end_ms = pen_clock_ms() + REVOKE_MS;

	if (!lease->host) {
		remove_lease(pool, lease);
		return;
	}
	lease->revoked = true;
	if (end_ms < lease->end_ms)
		lease->end_ms = end_ms;
}

static void handle_message(void *user, const struct pen_msg *msg)
{
	struct pool *pool = user;
	struct lease *lease;

	switch (msg->type) {
	case PEN_FRAME_LEASE: accept_lease(pool, msg); break;
	case PEN_FRAME_SCENE_DATA: pen_cache_receive(pool->cache, msg); break;
	case PEN_FRAME_ASSET_DATA: pen_cache_receive_asset(pool->cache, msg); break;
	case PEN_FRAME_REVOKE:
		lease = find_lease(pool, msg->u.revoke.lease);
		if (lease)
			let_go(pool, lease);
		finish_when_drained(pool);
		break;
	default: pen_log(PEN_LOG_INFO, "the coordinator sends no more work"); break;
	}
}

static void handle_heartbeat(uv_timer_t *timer)
{
	struct pool *pool = timer->data;
	uint64_t leases[PEN_PROCESSES_MAX], samples[PEN_PROCESSES_MAX];
	struct pen_msg msg = {
		.type = PEN_FRAME_HEARTBEAT,
		.u.heartbeat = {.leases = leases, .samples = samples},
	};

	for (uint32_t i = 0; i < pool->config->processes; i++) {
		const struct lease *lease = pool->running[i];

		if (!lease || lease->revoked)
			continue;
		leases[msg.u.heartbeat.count] = lease->msg.lease;
		samples[msg.u.heartbeat.count++] = pen_host_progress(lease->host, i);
	}
	pen_session_send(pool->session, &msg);
}

static void handle_open(void *user, const struct pen_msg_welcome *welcome)
{
	struct pool *pool = user;

	pool->worker = welcome->worker;
	(void)uv_timer_start(&pool->heartbeat, handle_heartbeat, 0, welcome->heartbeat_ms);
}

static void handle_closed(void *user)
{
	struct pool *pool = user;
	struct lease *lease, *next;

	(void)uv_timer_stop(&pool->heartbeat);
	for (lease = TAILQ_FIRST(&pool->leases); lease; lease = next) {
		next = TAILQ_NEXT(lease, link);
		let_go(pool, lease);
	}
	pen_cache_disconnect(pool->cache);
	finish_when_drained(pool);
}

static void handle_refused(void *user, const char *reason)
{
	struct pool *pool = user;

	(void)pen_error_set(
		pool->err, PEN_ECONFLICT, "the coordinator refuses this worker: %s", reason);
	pool->exit_code = PEN_WORKER_REFUSED;
	uv_stop(&pool->loop);
}

static void handle_finished(void *user)
{
	struct pool *pool = user;

	uv_stop(&pool->loop);
}

static const struct pen_session_events session_events = {
	.open = handle_open,
	.message = handle_message,
	.closed = handle_closed,
	.refused = handle_refused,
	.finished = handle_finished,
};

/* Time, signals and the zygote. */

static void check_deadlines(struct pool *pool, int64_t now_ms)
{
	for (uint32_t i = 0; i < pool->config->processes; i++) {
		struct lease *lease = pool->running[i];

		if (!lease || now_ms < lease->end_ms)
			continue;
		pen_host_abort(lease->host, i);
		fail(pool, lease, PEN_FAULT_DEADLINE, "rendering took longer than its deadline");
	}
}

static void return_leases(struct pool *pool, bool running)
{
	struct lease *lease, *next;

	for (lease = TAILQ_FIRST(&pool->leases); lease; lease = next) {
		next = TAILQ_NEXT(lease, link);
		if (lease->host && !running)
			continue;
		if (lease->host)
			pen_host_abort(lease->host, lease->slot);
		fail(pool, lease, PEN_FAULT_RETURNED, "the worker is leaving");
	}
}

static void handle_tick(uv_timer_t *timer)
{
	struct pool *pool = timer->data;
	int64_t now_ms = pen_clock_ms();

	pen_cache_tick(pool->cache, now_ms);
	check_deadlines(pool, now_ms);
	if (pool->draining && !pool->finishing && now_ms >= pool->drain_end_ms)
		return_leases(pool, true);
	if (pool->finishing && now_ms >= pool->drain_end_ms)
		uv_stop(&pool->loop);
	dispatch(pool);
	finish_when_drained(pool);
}

/* The first signal lets running units finish, the second one does not wait. */
static void handle_signal(uv_signal_t *handle, int signal_number)
{
	struct pool *pool = handle->data;

	if (pool->draining) {
		pool->exit_code = PEN_WORKER_FAILED;
		uv_stop(&pool->loop);
		return;
	}
	pen_log(PEN_LOG_INFO, "SIG%s: finishing what is being rendered",
		sigabbrev_np(signal_number));
	pool->draining = true;
	pool->drain_end_ms = pen_clock_ms() + DRAIN_MS;
	pen_session_send(pool->session, &(struct pen_msg){
						.type = PEN_FRAME_DRAIN,
						.u.text = {"the worker is leaving"},
					});
	return_leases(pool, false);
	finish_when_drained(pool);
}

static void handle_zygote(void *user)
{
	struct pool *pool = user;
	struct pen_control control;
	int r;

	r = pen_channel_receive(
		pen_watch_fd(pool->zygote_watch), &control, sizeof control, NULL, 0, NULL);
	if (r == PEN_EAGAIN)
		return;
	if (r == 0) {
		pen_cache_child(pool->cache, control.id, control.status);
		finish_when_drained(pool);
		return;
	}
	(void)pen_error_set(pool->err, PEN_ECLOSED, "the zygote process has ended");
	pool->exit_code = PEN_WORKER_FAILED;
	uv_stop(&pool->loop);
}

static void init_handles(struct pool *pool)
{
	(void)uv_timer_init(&pool->loop, &pool->tick);
	(void)uv_timer_init(&pool->loop, &pool->heartbeat);
	(void)uv_signal_init(&pool->loop, &pool->terminate);
	(void)uv_signal_init(&pool->loop, &pool->interrupt);
	pool->tick.data = pool->heartbeat.data = pool;
	pool->terminate.data = pool->interrupt.data = pool;
}

static int start(struct pool *pool, const struct pen_zygote *zygote, const struct pen_key *key,
	struct pen_error *err)
{
	int watched = fcntl(zygote->channel, F_DUPFD_CLOEXEC, 3);
	int r;

	r = pen_watch_create(&pool->loop, watched, handle_zygote, pool, &pool->zygote_watch, err);
	if (r == 0)
		r = pen_cache_create(
			&pool->loop, zygote, pool->config, &cache_events, pool, &pool->cache, err);
	if (r == 0)
		r = pen_session_create(
			&pool->loop, pool->config, key, &session_events, pool, &pool->session, err);
	if (r < 0)
		return r;
	(void)uv_timer_start(&pool->tick, handle_tick, TICK_MS, TICK_MS);
	(void)uv_signal_start(&pool->terminate, handle_signal, SIGTERM);
	(void)uv_signal_start(&pool->interrupt, handle_signal, SIGINT);
	return 0;
}

/* Everything is freed, so that a leak checker sees what leaks. */
static void stop(struct pool *pool)
{
	while (!TAILQ_EMPTY(&pool->leases))
		remove_lease(pool, TAILQ_FIRST(&pool->leases));
	pen_cache_destroy(pool->cache);
	pen_session_destroy(pool->session);
	pen_watch_destroy(pool->zygote_watch);
	uv_close((uv_handle_t *)&pool->tick, NULL);
	uv_close((uv_handle_t *)&pool->heartbeat, NULL);
	uv_close((uv_handle_t *)&pool->terminate, NULL);
	uv_close((uv_handle_t *)&pool->interrupt, NULL);
	(void)uv_run(&pool->loop, UV_RUN_DEFAULT);
	(void)uv_loop_close(&pool->loop);
	free(pool->pixels);
}

int pen_pool_run(const struct pen_worker_config *config, const struct pen_zygote *zygote,
	const struct pen_key *key, struct pen_error *err)
{
	struct pool pool = {.config = config, .exit_code = PEN_WORKER_FAILED, .err = err};
	int r;

	TAILQ_INIT(&pool.leases);
	r = uv_loop_init(&pool.loop);
	if (r < 0) {
		(void)pen_error_system(err, -r, "uv_loop_init");
		return PEN_WORKER_FAILED;
	}
	init_handles(&pool);
	pool.pixels = malloc(PEN_TILE_BYTES_MAX);
	r = pool.pixels ? start(&pool, zygote, key, err) : pen_error_memory(err);
	if (r == 0)
		(void)uv_run(&pool.loop, UV_RUN_DEFAULT);
	stop(&pool);
	return pool.exit_code;
}
