/* SPDX-License-Identifier: Apache-2.0 */
#include "server/farm.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "core/base/log.h"
#include "core/base/mask.h"
#include "server/asset_file.h"
#include "server/link.h"
#include "server/scene_file.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BACKLOG = 64, TICK_MS = 500, PROTOCOL = 1, STRANGER_MS = 60000 };

/* Of the old rate in the rate that is shown, for each tick. */
#define RATE_MEMORY 0.8

struct worker {
	struct worker *next;
	struct pen_farm *farm;
	struct pen_link *link;
	struct pen_worker shown; /* id 0 until its hello is accepted */
	int64_t opened_ms, heard_ms;
	uint8_t key[PEN_SECURE_KEY]; /* that it was asked to have */
	uint64_t samples_at_tick;
};

struct pen_farm {
	uv_tcp_t listener;
	uv_timer_t timer;
	unsigned open_handles;
	bool closing;
	struct pen_dispatch *dispatch;
	const char *scenes_dir, *assets_dir;
	struct pen_muster *muster;
	int64_t stranger_ms;	/* when one was logged last */
	struct worker *workers; /* in order of connecting */
	uint32_t count;
	uint64_t id_last;
	struct pen_farm_totals totals;
	int64_t tick_ms;
};

static struct worker *find_worker(const struct pen_farm *farm, uint64_t id)
{
	struct worker *worker = farm->workers;

	while (worker && worker->shown.id != id)
		worker = worker->next;
	return worker;
}

/* Hello */

static void refuse(struct worker *worker, const char *reason)
{
	struct pen_msg msg = {.type = PEN_FRAME_REFUSE, .u.text.reason = reason};

	pen_log(PEN_LOG_WARNING, "worker %s refused: %s", pen_link_address(worker->link), reason);
	pen_link_send(worker->link, &msg);
	pen_link_finish(worker->link);
}

static bool is_local(const struct worker *worker)
{
	return strcmp(pen_link_name(worker->link), PEN_MUSTER_LOCAL) == 0;
}

/* One that is the worker's own from one connection to the next. */
static bool has_lasting_key(const struct worker *worker)
{
	return pen_link_name(worker->link)[0] != '\0' && !is_local(worker);
}

static uint32_t count_welcomed(const struct pen_farm *farm)
{
	uint32_t count = 0;

	for (const struct worker *worker = farm->workers; worker; worker = worker->next)
		count += worker->shown.id != 0;
	return count;
}

/* Why the worker cannot be taken, for its log; NULL when it can. */
static const char *find_objection(const struct worker *worker, const struct pen_msg_hello *hello)
{
	if (hello->protocol != PROTOCOL)
		return "this coordinator speaks version 1 of the tile protocol: install the same "
		       "version of Penumbra on both sides";
	if (strlen(hello->equivalence_class) > PEN_CLASS_BYTES_MAX)
		return "the equivalence class is too long";
	if (count_welcomed(worker->farm) >= PEN_WORKERS_MAX)
		return "the farm is full: raise the number of processes of the workers instead";
	if (is_local(worker) && !pen_muster_use_issued(worker->farm->muster))
		return "the key has been used already";
	return NULL;
}

static bool fill_shown(struct worker *worker, const struct pen_msg_hello *hello)
{
	struct pen_worker *shown = &worker->shown;

	shown->name = strdup(hello->name);
	shown->address = strdup(pen_link_address(worker->link));
	shown->equivalence_class = strdup(hello->equivalence_class);
	shown->version = strdup(hello->version);
	shown->processes = hello->processes;
	shown->connected_ms = shown->heartbeat_ms = pen_clock_wall_ms();
	return shown->name && shown->address && shown->equivalence_class && shown->version;
}

/* One key is one worker: whoever had it before has lost its connection, or shares what is not his.
 */
static void replace_twin(const struct worker *worker)
{
	const char *name = pen_link_name(worker->link);

	for (struct worker *other = worker->farm->workers; other; other = other->next)
		if (other != worker && other->shown.id != 0 && has_lasting_key(worker) &&
			strcmp(pen_link_name(other->link), name) == 0) {
			pen_log_of(&(struct pen_log_about){.worker = other->shown.id},
				PEN_LOG_WARNING, "worker %llu gives way to another with the key %s",
				(unsigned long long)other->shown.id, name);
			pen_link_close(other->link);
		}
}

static void handle_hello(struct worker *worker, const struct pen_msg_hello *hello)
{
	struct pen_farm *farm = worker->farm;
	const char *objection = find_objection(worker, hello);
	struct pen_msg welcome = {.type = PEN_FRAME_WELCOME};
	struct pen_sched_worker added;

	if (!objection && !fill_shown(worker, hello))
		objection = "the coordinator is out of memory";
	if (objection) {
		refuse(worker, objection);
		return;
	}
	replace_twin(worker);
	worker->shown.id = ++farm->id_last;
	worker->shown.quarantined =
		has_lasting_key(worker) && pen_muster_is_barred(farm->muster, worker->key);
	welcome.u.welcome = (struct pen_msg_welcome){worker->shown.id, PEN_HEARTBEAT_MS};
	pen_link_send(worker->link, &welcome);
	pen_log_of(&(struct pen_log_about){.worker = worker->shown.id}, PEN_LOG_INFO,
		"worker %llu: %s at %s, %u processes, class %s%s",
		(unsigned long long)worker->shown.id, worker->shown.name, worker->shown.address,
		worker->shown.processes, worker->shown.equivalence_class,
		worker->shown.quarantined ? ", in quarantine: its pixels were wrong before" : "");
	added = (struct pen_sched_worker){worker->shown.id, worker->shown.processes,
		worker->shown.equivalence_class, is_local(worker), worker->shown.quarantined};
	if (pen_dispatch_add_worker(farm->dispatch, &added, NULL) < 0)
		pen_link_close(worker->link);
}

/* Messages of a worker that has been welcomed */

static void send_scene(struct worker *worker, const struct pen_sha256 *sha256)
{
	uint64_t size = 0;
	int fd = -1;

	if (!pen_dispatch_text(worker->farm->dispatch, sha256, &fd, &size))
		(void)pen_scene_file_open(worker->farm->scenes_dir, sha256, &fd, &size, NULL);
	pen_link_send_file(worker->link, PEN_FRAME_SCENE_DATA, sha256, fd, size);
}

static void send_asset(struct worker *worker, const struct pen_sha256 *sha256)
{
	uint64_t size = 0;
	int fd = -1;

	(void)pen_asset_file_open(worker->farm->assets_dir, sha256, &fd, &size, NULL);
	pen_link_send_file(worker->link, PEN_FRAME_ASSET_DATA, sha256, fd, size);
}

static void note_outcome(struct worker *worker, enum pen_dispatch_outcome outcome, uint64_t samples)
{
	struct pen_farm_totals *totals = &worker->farm->totals;

	if (outcome == PEN_OUTCOME_GONE)
		return;
	totals->units += outcome == PEN_OUTCOME_GOOD;
	totals->failures += outcome == PEN_OUTCOME_BAD;
	totals->samples += samples;
	worker->shown.leases--;
	worker->shown.strikes += outcome == PEN_OUTCOME_BAD;
	worker->shown.units_done += outcome == PEN_OUTCOME_GOOD;
	worker->shown.samples_done += samples;
}

static void handle_result(struct worker *worker, const struct pen_msg *msg)
{
	uint64_t samples = 0;
	enum pen_dispatch_outcome outcome = pen_dispatch_result(worker->farm->dispatch,
		worker->shown.id, &msg->u.result, msg->payload, msg->payload_size, &samples);

	if (outcome == PEN_OUTCOME_GOOD)
		worker->farm->totals.render_us += msg->u.result.render_us;
	note_outcome(worker, outcome, samples);
}

static void handle_failure(struct worker *worker, const struct pen_msg_failure *failure)
{
	enum pen_dispatch_outcome outcome =
		pen_dispatch_failure(worker->farm->dispatch, worker->shown.id, failure);

	note_outcome(worker, outcome, 0);
}

static void handle_welcomed(struct worker *worker, const struct pen_msg *msg)
{
	struct pen_dispatch *dispatch = worker->farm->dispatch;

	worker->heard_ms = pen_clock_ms();
	worker->shown.heartbeat_ms = pen_clock_wall_ms();
	switch (msg->type) {
	case PEN_FRAME_SCENE_GET: send_scene(worker, &msg->u.scene_get.sha256); break;
	case PEN_FRAME_ASSET_GET: send_asset(worker, &msg->u.scene_get.sha256); break;
	case PEN_FRAME_RESULT: handle_result(worker, msg); break;
	case PEN_FRAME_FAILURE: handle_failure(worker, &msg->u.failure); break;
	case PEN_FRAME_HEARTBEAT:
		pen_dispatch_progress(dispatch, worker->shown.id, &msg->u.heartbeat);
		break;
	case PEN_FRAME_SCENE_REPORT: pen_dispatch_report(dispatch, &msg->u.scene_report); break;
	case PEN_FRAME_DRAIN:
		worker->shown.draining = worker->shown.leaving = true;
		pen_dispatch_drain_worker(dispatch, worker->shown.id);
		break;
	default: pen_link_close(worker->link); break;
	}
}

static void handle_message(void *user, const struct pen_msg *msg)
{
	struct worker *worker = user;

	if (worker->shown.id != 0)
		handle_welcomed(worker, msg);
	else if (msg->type == PEN_FRAME_HELLO)
		handle_hello(worker, &msg->u.hello);
	else
		refuse(worker, "the first message must be a hello");
}

/* Coming and going */

static void farm_free_when_closed(struct pen_farm *farm)
{
	if (farm->closing && farm->open_handles == 0 && !farm->workers)
		free(farm);
}

static void worker_free(struct worker *worker)
{
	free(worker->shown.name);
	free(worker->shown.address);
	free(worker->shown.equivalence_class);
	free(worker->shown.version);
	free(worker);
}

/* Once a minute is enough for who only knocks. */
static void note_stranger(struct worker *worker, const char *reason)
{
	struct pen_farm *farm = worker->farm;
	int64_t now_ms = pen_clock_ms();

	if (!pen_muster_is_closed(farm->muster) || reason[0] == '\0' ||
		(farm->stranger_ms != 0 && now_ms - farm->stranger_ms < STRANGER_MS))
		return;
	farm->stranger_ms = now_ms;
	pen_log(PEN_LOG_WARNING, "no worker at %s: %s", pen_link_address(worker->link), reason);
}

static void handle_closed(void *user, const char *reason)
{
	struct worker *worker = user;
	struct pen_farm *farm = worker->farm;
	struct worker **place = &farm->workers;

	while (*place != worker)
		place = &(*place)->next;
	*place = worker->next;
	farm->count--;
	if (worker->shown.id == 0 && !farm->closing)
		note_stranger(worker, reason);
	if (worker->shown.id != 0 && !farm->closing) {
		pen_log_of(&(struct pen_log_about){.worker = worker->shown.id},
			worker->shown.draining ? PEN_LOG_INFO : PEN_LOG_WARNING,
			"worker %llu (%s) is gone: %s", (unsigned long long)worker->shown.id,
			worker->shown.name, reason);
		pen_dispatch_remove_worker(farm->dispatch, worker->shown.id);
	}
	worker_free(worker);
	farm_free_when_closed(farm);
}

static bool find_key(void *user, const char *name, uint8_t *ret_key)
{
	struct worker *worker = user;

	if (!pen_muster_find(worker->farm->muster, name, worker->key))
		return false;
	memcpy(ret_key, worker->key, sizeof worker->key);
	return true;
}

/* Those who have not said who they are may not hold off others: the one who waited longest goes. */
static void drop_early(struct pen_farm *farm)
{
	struct worker *oldest = NULL;
	uint32_t count = 0;

	for (struct worker *worker = farm->workers; worker; worker = worker->next) {
		if (worker->shown.id != 0)
			continue;
		if (!oldest)
			oldest = worker;
		count++;
	}
	if (count > PEN_GREETINGS_MAX)
		pen_link_close(oldest->link);
}

static void accept_worker(struct pen_farm *farm)
{
	struct worker *worker = calloc(1, sizeof *worker);
	struct pen_link_events events = {handle_message, handle_closed, find_key, worker};
	struct worker **place = &farm->workers;

	if (!worker || pen_link_accept((uv_stream_t *)&farm->listener, &events,
			       !pen_muster_is_closed(farm->muster), &worker->link, NULL) < 0) {
		free(worker);
		return;
	}
	worker->farm = farm;
	worker->opened_ms = worker->heard_ms = pen_clock_ms();
	while (*place)
		place = &(*place)->next;
	*place = worker;
	farm->count++;
	drop_early(farm);
}

static void handle_connection(uv_stream_t *listener, int status)
{
	if (status == 0)
		accept_worker(listener->data);
}

static void check_worker(struct worker *worker, int64_t now_ms)
{
	struct pen_worker *shown = &worker->shown;
	double rate = (double)(shown->samples_done - worker->samples_at_tick) * 1000 / TICK_MS;

	worker->samples_at_tick = shown->samples_done;
	shown->samples_per_second += (1 - RATE_MEMORY) * (rate - shown->samples_per_second);
	if (shown->id == 0 && now_ms - worker->opened_ms > PEN_HELLO_MS) {
		pen_link_close(worker->link);
	} else if (shown->id != 0 && now_ms - worker->heard_ms > PEN_DEAD_MS) {
		pen_log_of(&(struct pen_log_about){.worker = shown->id}, PEN_LOG_WARNING,
			"worker %llu has been silent for %d s", (unsigned long long)shown->id,
			PEN_DEAD_MS / 1000);
		pen_link_close(worker->link);
	}
}

/* Whose key has been taken back, or who came without one before there were any, goes. */
static void check_keys(struct pen_farm *farm)
{
	uint8_t key[PEN_SECURE_KEY];

	for (struct worker *worker = farm->workers; worker; worker = worker->next) {
		if (!pen_muster_is_closed(farm->muster) || is_local(worker) ||
			(pen_muster_find(farm->muster, pen_link_name(worker->link), key) &&
				memcmp(key, worker->key, sizeof key) == 0))
			continue;
		pen_log_of(&(struct pen_log_about){.worker = worker->shown.id}, PEN_LOG_WARNING,
			"worker %llu has no key any more", (unsigned long long)worker->shown.id);
		pen_link_close(worker->link);
	}
	explicit_bzero(key, sizeof key);
}

static void handle_tick(uv_timer_t *timer)
{
	struct pen_farm *farm = timer->data;
	int64_t now_ms = pen_clock_ms();
	bool stalled = now_ms - farm->tick_ms > 4 * TICK_MS;

	/* After a stall of our own what the workers said meanwhile is still to be read. */
	farm->tick_ms = now_ms;
	for (struct worker *worker = farm->workers; worker; worker = worker->next) {
		if (stalled)
			worker->opened_ms = worker->heard_ms = now_ms;
		check_worker(worker, now_ms);
	}
	if (pen_muster_refresh(farm->muster, now_ms))
		check_keys(farm);
	pen_dispatch_tick(farm->dispatch);
}

/* For the dispatch */

static void send_lease(
	void *user, uint64_t id, const struct pen_msg_lease *lease, const uint8_t *mask)
{
	struct worker *worker = find_worker(user, id);
	struct pen_msg msg = {
		.type = PEN_FRAME_LEASE,
		.u.lease = *lease,
		.payload = mask,
		.payload_size = mask ? pen_mask_bytes(lease->rect) : 0,
	};

	if (!worker)
		return;
	worker->shown.leases++;
	pen_link_send(worker->link, &msg);
}

static void send_revoke(void *user, uint64_t id, uint64_t lease)
{
	struct worker *worker = find_worker(user, id);
	struct pen_msg msg = {.type = PEN_FRAME_REVOKE, .u.revoke.lease = lease};

	if (!worker)
		return;
	worker->shown.leases--;
	pen_link_send(worker->link, &msg);
}

static void note_quarantine(void *user, uint64_t id, enum pen_dispatch_custody custody)
{
	static const char *const texts[] = {
		[PEN_CUSTODY_NONE] = "is out of quarantine",
		[PEN_CUSTODY_STRIKES] = "is in quarantine: others could render what it failed at",
		[PEN_CUSTODY_LIAR] = "is in quarantine: its pixels were wrong",
	};
	struct worker *worker = find_worker(user, id);

	if (!worker)
		return;
	worker->shown.quarantined = custody != PEN_CUSTODY_NONE;
	if (custody == PEN_CUSTODY_LIAR && has_lasting_key(worker))
		pen_muster_bar(((struct pen_farm *)user)->muster, worker->key);
	pen_log_of(&(struct pen_log_about){.worker = id},
		custody == PEN_CUSTODY_NONE ? PEN_LOG_INFO : PEN_LOG_ERROR, "worker %llu (%s) %s",
		(unsigned long long)id, worker->shown.name, texts[custody]);
}

/* The farm itself */

static void handle_handle_closed(uv_handle_t *handle)
{
	struct pen_farm *farm = handle->data;

	farm->open_handles--;
	farm_free_when_closed(farm);
}

static int listen_on(
	struct pen_farm *farm, const struct sockaddr_storage *address, struct pen_error *err)
{
	int r = uv_tcp_bind(&farm->listener, (const struct sockaddr *)address, 0);

	if (r == 0)
		r = uv_listen((uv_stream_t *)&farm->listener, BACKLOG, handle_connection);
	if (r < 0)
		return pen_error_set(err, PEN_EIO,
			"cannot listen for workers: %s; choose another address with "
			"--worker-listen",
			uv_strerror(r));
	return 0;
}

int pen_farm_create(uv_loop_t *loop, const struct pen_farm_options *options,
	struct pen_farm **ret_farm, struct pen_error *err)
{
	struct pen_farm *farm = calloc(1, sizeof *farm);
	int r;

	if (!farm)
		return pen_error_memory(err);
	farm->dispatch = options->dispatch;
	farm->muster = options->muster;
	farm->scenes_dir = options->scenes_dir;
	farm->assets_dir = options->assets_dir;
	farm->tick_ms = pen_clock_ms();
	(void)uv_tcp_init(loop, &farm->listener);
	(void)uv_timer_init(loop, &farm->timer);
	farm->listener.data = farm->timer.data = farm;
	farm->open_handles = 2;
	r = listen_on(farm, &options->address, err);
	if (r < 0) {
		pen_farm_destroy(farm);
		return r;
	}
	(void)uv_timer_start(&farm->timer, handle_tick, TICK_MS, TICK_MS);
	pen_dispatch_connect_farm(farm->dispatch,
		&(struct pen_dispatch_farm){send_lease, send_revoke, note_quarantine, farm});
	*ret_farm = farm;
	return 0;
}

void pen_farm_destroy(struct pen_farm *farm)
{
	struct pen_msg msg = {
		.type = PEN_FRAME_DRAIN, .u.text.reason = "the coordinator is stopping"};

	if (!farm)
		return;
	farm->closing = true;
	uv_close((uv_handle_t *)&farm->listener, handle_handle_closed);
	uv_close((uv_handle_t *)&farm->timer, handle_handle_closed);
	for (struct worker *worker = farm->workers; worker; worker = worker->next) {
		pen_link_send(worker->link, &msg);
		pen_link_finish(worker->link);
	}
}

uint16_t pen_farm_port(const struct pen_farm *farm)
{
	struct sockaddr_storage address;
	int size = sizeof address;

	if (uv_tcp_getsockname(&farm->listener, (struct sockaddr *)&address, &size) < 0)
		return 0;
	if (address.ss_family == AF_INET6)
		return ntohs(((const struct sockaddr_in6 *)&address)->sin6_port);
	return ntohs(((const struct sockaddr_in *)&address)->sin_port);
}

int pen_farm_issue_key(struct pen_farm *farm, char *ret_key, struct pen_error *err)
{
	return pen_muster_issue(farm->muster, ret_key, err);
}

const struct pen_worker *pen_farm_next(const struct pen_farm *farm, uint64_t after)
{
	const struct pen_worker *best = NULL;

	for (const struct worker *worker = farm->workers; worker; worker = worker->next)
		if (worker->shown.id > after && (!best || worker->shown.id < best->id))
			best = &worker->shown;
	return best;
}

int pen_farm_drain(struct pen_farm *farm, uint64_t id, struct pen_error *err)
{
	struct worker *worker = id != 0 ? find_worker(farm, id) : NULL;

	if (!worker)
		return pen_error_set(err, PEN_ENOTFOUND, "there is no such worker");
	worker->shown.draining = true;
	pen_dispatch_drain_worker(farm->dispatch, id);
	return 0;
}

int pen_farm_reset(struct pen_farm *farm, uint64_t id, struct pen_error *err)
{
	struct worker *worker = id != 0 ? find_worker(farm, id) : NULL;

	if (!worker)
		return pen_error_set(err, PEN_ENOTFOUND, "there is no such worker");
	if (worker->shown.leaving)
		return pen_error_set(err, PEN_ECONFLICT, "the worker is leaving");
	worker->shown.draining = false;
	worker->shown.strikes = 0;
	pen_muster_pardon(farm->muster, worker->key);
	pen_dispatch_reset_worker(farm->dispatch, id);
	pen_dispatch_tick(farm->dispatch);
	return 0;
}

struct pen_farm_totals pen_farm_totals(const struct pen_farm *farm)
{
	struct pen_farm_totals totals = farm->totals;

	totals.welcomed = farm->id_last;
	return totals;
}

size_t pen_farm_held(
	const struct pen_farm *farm, uint64_t number, struct pen_sched_held *ret_held, size_t max)
{
	return pen_dispatch_held(farm->dispatch, number, ret_held, max);
}

uint64_t pen_farm_queue_depth(const struct pen_farm *farm)
{
	return pen_dispatch_waiting(farm->dispatch);
}

const char *pen_farm_why_waiting(const struct pen_farm *farm)
{
	if (pen_dispatch_waiting(farm->dispatch) == 0)
		return "";
	if (pen_dispatch_processes(farm->dispatch) == 0)
		return farm->workers ? "Every worker is leaving or in quarantine."
				     : "No worker is connected.";
	if (pen_dispatch_lacks_class(farm->dispatch))
		return "Some work was begun by workers of a class that has none now: after a "
		       "minute it "
		       "starts again with others.";
	return "All render processes that may take this work are busy.";
}
