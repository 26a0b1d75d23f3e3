/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cache.h"

#include "core/base/clock.h"
#include "core/base/log.h"
#include "worker/blame.h"
#include "worker/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { BACKOFF_MIN_MS = 100, BACKOFF_MAX_MS = 5000, LATER_MS = 100, TOLD_MAX = 8 };

enum entry_state {
	ENTRY_FREE,
	ENTRY_FETCHING,
	ENTRY_TEXT,    /* the text is whole; a process for it at retry_ms */
	ENTRY_LOADING, /* since since_ms */
	ENTRY_READY,
	ENTRY_FAILED
};

struct entry {
	enum entry_state state;
	struct pen_sha256 sha256;
	bool has_world; /* see struct pen_msg_lease */
	struct pen_sha256 world;
	uint32_t frame; /* demanded last */
	uint64_t used;	/* when it was demanded last, in demands */
	int text;	/* sealed memory when whole; -1 = none */
	uint64_t text_size, text_received;
	struct pen_host *host;
	uint32_t assets_given; /* of those that the host needs */
	int64_t since_ms, retry_ms;
	uint32_t failures;    /* processes in a row that ended while building */
	enum pen_fault fault; /* of a failed one */
	bool forget;	      /* a failed one is tried again when somebody asks */
	char reason[PEN_REASON_MAX];
	struct pen_findings findings;
	uint64_t told[TOLD_MAX]; /* renders whose owner knows the findings, the last ones */
	uint32_t told_count;
};

struct pen_cache {
	uv_loop_t *loop;
	const struct pen_zygote *zygote;
	const struct pen_worker_config *config;
	const struct pen_cache_events *events;
	void *user;
	struct pen_assets *assets;
	struct pen_host *leaving; /* of a scene that has made room; NULL: none */
	int64_t leave_ms;
	struct pen_host *spare;
	int64_t spare_retry_ms;
	uint32_t spare_failures;
	uint32_t next_id;
	uint64_t demands;
	struct entry entries[PEN_SCENES_CACHED_MAX];
};

static int64_t backoff_ms(uint32_t failures)
{
	int64_t delay_ms = BACKOFF_MIN_MS;

	for (uint32_t i = 1; i < failures && delay_ms < BACKOFF_MAX_MS; i++)
		delay_ms *= 2;
	return delay_ms < BACKOFF_MAX_MS ? delay_ms : BACKOFF_MAX_MS;
}

static struct entry *find(struct pen_cache *cache, const struct pen_sha256 *sha256)
{
	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++)
		if (cache->entries[i].state != ENTRY_FREE &&
			pen_sha256_equal(&cache->entries[i].sha256, sha256))
			return &cache->entries[i];
	return NULL;
}

static struct entry *find_host(struct pen_cache *cache, const struct pen_host *host)
{
	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++)
		if (cache->entries[i].host == host)
			return &cache->entries[i];
	return NULL;
}

static void drop_host(struct entry *entry)
{
	pen_host_destroy(entry->host);
	entry->host = NULL;
}

static void drop_text(struct entry *entry)
{
	if (entry->text >= 0)
		(void)close(entry->text);
	entry->text = -1;
}

static void clear(struct entry *entry)
{
	drop_host(entry);
	drop_text(entry);
	pen_findings_finish(&entry->findings);
	*entry = (struct entry){.state = ENTRY_FREE, .text = -1};
}

/*
 * A scene that cannot be built stays known as such until its place is needed; one that was not to
 * be had is forgotten at the next tick, when those who wait have been told.
 */
static void fail(
	struct pen_cache *cache, struct entry *entry, enum pen_fault fault, const char *reason)
{
	drop_host(entry);
	drop_text(entry);
	entry->state = ENTRY_FAILED;
	entry->fault = fault;
	(void)snprintf(entry->reason, sizeof entry->reason, "%s", reason);
	cache->events->changed(cache->user);
}

static void take_findings(struct entry *entry)
{
	pen_findings_finish(&entry->findings);
	entry->findings = pen_host_take_findings(entry->host);
}

static void handle_ready(void *user, struct pen_host *host)
{
	struct pen_cache *cache = user;
	struct entry *entry = find_host(cache, host);

	if (!entry)
		return;
	take_findings(entry);
	entry->state = ENTRY_READY;
	entry->failures = 0;
	cache->events->changed(cache->user);
}

/* Without its file no scene is whole; but the file may come, so nothing is remembered. */
static void lack_asset(
	struct pen_cache *cache, struct entry *entry, bool is_missing, const char *reason)
{
	entry->forget = true;
	fail(cache, entry, is_missing ? PEN_FAULT_SCENE : PEN_FAULT_NO_SCENE, reason);
}

/*
 * Hands the assets that a scene process needs over in its order, as they come; those behind the
 * next one are asked for meanwhile.
 */
static void give_assets(struct pen_cache *cache, struct entry *entry)
{
	enum { AHEAD = 4 };
	const struct pen_sha256 *needs;
	const uint32_t count = pen_host_needs(entry->host, &needs);

	if (entry->state != ENTRY_LOADING || entry->assets_given == count ||
		!cache->events->in_use(cache->user, &entry->sha256))
		return;
	for (uint32_t i = entry->assets_given; i < count && i < entry->assets_given + AHEAD; i++) {
		const char *reason = NULL;
		bool is_missing = false;
		int fd = -1;
		enum pen_demand demand =
			pen_assets_demand(cache->assets, &needs[i], &fd, &reason, &is_missing);

		if (demand == PEN_DEMAND_FAILED) {
			lack_asset(cache, entry, is_missing, reason);
			return;
		}
		if (demand == PEN_DEMAND_READY && i == entry->assets_given &&
			pen_host_give(entry->host, i, fd)) {
			entry->assets_given++;
			entry->since_ms = pen_clock_ms();
		}
	}
}

static void handle_needs(void *user, struct pen_host *host)
{
	struct pen_cache *cache = user;
	struct entry *entry = find_host(cache, host);

	if (entry)
		give_assets(cache, entry);
}

static void handle_fetch(void *user, const struct pen_sha256 *sha256)
{
	struct pen_cache *cache = user;

	cache->events->fetch_asset(cache->user, sha256);
}

static void handle_assets_changed(void *user)
{
	struct pen_cache *cache = user;

	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++)
		if (cache->entries[i].host)
			give_assets(cache, &cache->entries[i]);
}

static void handle_failed(void *user, struct pen_host *host, const char *reason)
{
	struct pen_cache *cache = user;
	struct entry *entry = find_host(cache, host);

	if (!entry)
		return;
	take_findings(entry);
	pen_host_ended(host, PEN_FAULT_SCENE, reason);
	fail(cache, entry, PEN_FAULT_SCENE, reason);
}

static void handle_idle(void *user, struct pen_host *host)
{
	struct pen_cache *cache = user;

	(void)host;
	cache->events->changed(cache->user);
}

static void handle_done(void *user, struct pen_host *host, uint32_t slot,
	const struct pen_answer *answer, const float *pixels)
{
	struct pen_cache *cache = user;

	cache->events->done(cache->user, host, slot, answer, pixels);
}

static void handle_lost(
	void *user, uint32_t slot, uint64_t lease, enum pen_fault fault, const char *reason)
{
	struct pen_cache *cache = user;

	cache->events->lost(cache->user, slot, lease, fault, reason);
}

static const struct pen_host_events host_events = {
	.needs = handle_needs,
	.ready = handle_ready,
	.failed = handle_failed,
	.idle = handle_idle,
	.done = handle_done,
	.lost = handle_lost,
};

static int make_spare(struct pen_cache *cache, struct pen_error *err)
{
	return pen_host_create(cache->loop, cache->zygote, cache->next_id++, cache->config,
		&host_events, cache, &cache->spare, err);
}

/* One that has built another view of the scene, which nobody wants any more. */
static struct entry *find_view(struct pen_cache *cache, const struct entry *entry)
{
	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++) {
		struct entry *other = &cache->entries[i];

		if (other != entry && other->state == ENTRY_READY && other->has_world &&
			pen_sha256_equal(&other->world, &entry->world) &&
			!cache->events->is_wanted(cache->user, &other->sha256))
			return other;
	}
	return NULL;
}

static bool take_over(struct pen_cache *cache, struct entry *entry)
{
	struct entry *other = entry->has_world ? find_view(cache, entry) : NULL;

	if (!other || pen_host_look(other->host, entry->text, entry->frame, NULL) < 0)
		return false;
	entry->host = other->host;
	entry->findings = other->findings;
	entry->assets_given = other->assets_given;
	entry->state = ENTRY_READY;
	other->host = NULL;
	other->findings = (struct pen_findings){0};
	clear(other);
	return true;
}

/*
 * Gives the spare to a scene; tries again later when there is none. The next one is made in a
 * while: now all cores have better things to do.
 */
static void load(struct pen_cache *cache, struct entry *entry)
{
	struct pen_error err = PEN_ERROR_INIT;

	entry->state = ENTRY_TEXT;
	if (take_over(cache, entry))
		return;
	if (!cache->spare && make_spare(cache, &err) < 0)
		pen_log(PEN_LOG_WARNING, "no spare scene process: %s", err.text);
	if (!cache->spare || pen_host_load(cache->spare, entry->text, entry->frame, &err) < 0) {
		entry->retry_ms = pen_clock_ms() + BACKOFF_MIN_MS;
		return;
	}
	entry->host = cache->spare;
	entry->state = ENTRY_LOADING;
	entry->assets_given = 0;
	entry->since_ms = pen_clock_ms();
	cache->spare = NULL;
	cache->spare_retry_ms = pen_clock_ms() + LATER_MS;
}

/*
 * Ends the processes of a scene that makes room, in a while: unmapping them takes the cores that
 * the next scene needs now.
 */
static void let_leave(struct pen_cache *cache, struct entry *entry)
{
	if (entry->host) {
		pen_host_destroy(cache->leaving);
		cache->leaving = entry->host;
		cache->leave_ms = pen_clock_ms() + LATER_MS;
		entry->host = NULL;
	}
	clear(entry);
}

static struct entry *make_room(struct pen_cache *cache)
{
	struct entry *oldest = NULL;

	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++) {
		struct entry *entry = &cache->entries[i];

		if (entry->state == ENTRY_FREE)
			return entry;
		if ((!oldest || entry->used < oldest->used) &&
			!cache->events->in_use(cache->user, &entry->sha256))
			oldest = entry;
	}
	if (oldest)
		let_leave(cache, oldest);
	return oldest;
}

enum pen_demand pen_cache_demand(struct pen_cache *cache, const struct pen_msg_lease *lease,
	struct pen_host **ret_host, struct pen_msg_failure *ret_failure)
{
	struct entry *entry = find(cache, &lease->scene_sha256);

	if (!entry) {
		entry = make_room(cache);
		if (!entry)
			return PEN_DEMAND_WAIT;
		entry->state = ENTRY_FETCHING;
		entry->sha256 = lease->scene_sha256;
		entry->has_world = lease->has_world;
		entry->world = lease->world_sha256;
		cache->events->fetch(cache->user, &lease->scene_sha256);
	}
	entry->used = ++cache->demands;
	entry->frame = lease->frame;
	if (entry->state == ENTRY_READY) {
		*ret_host = entry->host;
		return PEN_DEMAND_READY;
	}
	if (entry->state != ENTRY_FAILED)
		return PEN_DEMAND_WAIT;
	ret_failure->fault = entry->fault;
	ret_failure->reason = entry->reason;
	return PEN_DEMAND_FAILED;
}

static bool note_told(struct entry *entry, uint64_t job)
{
	for (uint32_t i = 0; i < TOLD_MAX && i < entry->told_count; i++)
		if (entry->told[i] == job)
			return false;
	entry->told[entry->told_count++ % TOLD_MAX] = job;
	return true;
}

bool pen_cache_report(struct pen_cache *cache, const struct pen_sha256 *sha256, uint64_t job,
	struct pen_msg_scene_report *ret_report)
{
	struct pen_msg_scene_report report = {.job = job, .scene_sha256 = *sha256};
	struct entry *entry = find(cache, sha256);

	if (entry && entry->state == ENTRY_FAILED)
		pen_findings_report_errors(&entry->findings, &report);
	if (entry && entry->state == ENTRY_READY)
		pen_findings_report_warnings(&entry->findings, &report);
	if (report.error_count + report.warning_count == 0 || !note_told(entry, job))
		return false;
	*ret_report = report;
	return true;
}

/* Whether the bytes are what their name says. Seals them. */
static int check_text(const struct entry *entry, struct pen_error *err)
{
	struct pen_sha256 sha256;
	const void *text;
	size_t size;
	int r;

	r = pen_memory_seal(entry->text, err);
	if (r == 0)
		r = pen_memory_map(entry->text, &text, &size, err);
	if (r < 0)
		return r;
	r = pen_sha256_of(text, size, &sha256, err);
	(void)munmap((void *)(uintptr_t)text, size);
	if (r == 0 && !pen_sha256_equal(&sha256, &entry->sha256))
		r = pen_error_set(err, PEN_EPROTOCOL, "the scene's text was damaged on the way");
	return r;
}

static int append_text(struct entry *entry, const struct pen_msg *msg, struct pen_error *err)
{
	const struct pen_msg_scene_data *data = &msg->u.scene_data;
	int r;

	if (entry->text < 0) {
		r = pen_memory_create("pen-scene", data->size, &entry->text, err);
		if (r < 0)
			return r;
		entry->text_size = data->size;
	}
	if (data->size != entry->text_size || data->offset != entry->text_received)
		return pen_error_set(err, PEN_EPROTOCOL, "a scene's pieces come out of order");
	if (pwrite(entry->text, msg->payload, msg->payload_size, (off_t)data->offset) !=
		(ssize_t)msg->payload_size)
		return pen_error_set(err, PEN_EIO, "no memory for a scene's text");
	entry->text_received += msg->payload_size;
	return 0;
}

void pen_cache_receive(struct pen_cache *cache, const struct pen_msg *scene_data)
{
	struct entry *entry = find(cache, &scene_data->u.scene_data.sha256);
	struct pen_error err = PEN_ERROR_INIT;
	int r;

	if (!entry || entry->state != ENTRY_FETCHING)
		return;
	if (scene_data->u.scene_data.missing)
		r = pen_error_set(&err, PEN_ENOTFOUND, "the coordinator does not have the scene");
	else
		r = append_text(entry, scene_data, &err);
	if (r == 0 && entry->text_received < entry->text_size)
		return;
	if (r == 0)
		r = check_text(entry, &err);
	if (r == 0)
		load(cache, entry);
	else
		fail(cache, entry, PEN_FAULT_NO_SCENE, err.text);
}

void pen_cache_receive_asset(struct pen_cache *cache, const struct pen_msg *asset_data)
{
	pen_assets_receive(cache->assets, asset_data);
}

void pen_cache_disconnect(struct pen_cache *cache)
{
	pen_assets_disconnect(cache->assets);
	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++) {
		cache->entries[i].told_count = 0;
		if (cache->entries[i].state == ENTRY_FETCHING)
			clear(&cache->entries[i]);
	}
}

static void end_spare(struct pen_cache *cache, const char *reason)
{
	pen_host_destroy(cache->spare);
	cache->spare = NULL;
	cache->spare_failures++;
	cache->spare_retry_ms = pen_clock_ms() + backoff_ms(cache->spare_failures);
	pen_log(PEN_LOG_WARNING, "spare %s", reason);
}

void pen_cache_child(struct pen_cache *cache, uint32_t id, int status)
{
	char reason[PEN_BLAME_TEXT];
	enum pen_fault fault = pen_blame_of("scene process", status, reason);

	if (cache->spare && pen_host_id(cache->spare) == id) {
		end_spare(cache, reason);
		return;
	}
	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++) {
		struct entry *entry = &cache->entries[i];

		if (!entry->host || pen_host_id(entry->host) != id)
			continue;
		pen_log(PEN_LOG_WARNING, "%s", reason);
		pen_host_ended(entry->host, fault, reason);
		if (entry->state == ENTRY_LOADING && fault == PEN_FAULT_SCENE) {
			fail(cache, entry, fault, reason);
			return;
		}
		if (entry->state == ENTRY_LOADING)
			cache->events->crashed(cache->user, &entry->sha256, fault, reason);
		drop_host(entry);
		entry->state = ENTRY_TEXT;
		entry->retry_ms = pen_clock_ms();
		if (entry->failures++ > 0)
			entry->retry_ms += backoff_ms(entry->failures);
		return;
	}
}

static void tick_entry(struct pen_cache *cache, struct entry *entry, int64_t now_ms)
{
	if (entry->state == ENTRY_FAILED && (entry->forget || entry->fault == PEN_FAULT_NO_SCENE))
		clear(entry);
	if (entry->state == ENTRY_TEXT && entry->retry_ms <= now_ms)
		load(cache, entry);
	if (entry->state == ENTRY_LOADING && now_ms - entry->since_ms > PEN_LEASE_HARD_MS)
		fail(cache, entry, PEN_FAULT_SCENE, "the scene took more than 10 minutes to build");
	if (entry->host)
		give_assets(cache, entry);
	if (entry->host)
		pen_host_tick(entry->host, now_ms);
}

void pen_cache_tick(struct pen_cache *cache, int64_t now_ms)
{
	struct pen_error err = PEN_ERROR_INIT;

	if (!cache->spare && cache->spare_retry_ms <= now_ms && make_spare(cache, &err) < 0) {
		cache->spare_failures++;
		cache->spare_retry_ms = now_ms + backoff_ms(cache->spare_failures);
		pen_log(PEN_LOG_WARNING, "no spare scene process: %s", err.text);
	}
	if (cache->leaving && cache->leave_ms <= now_ms) {
		pen_host_destroy(cache->leaving);
		cache->leaving = NULL;
	}
	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++)
		tick_entry(cache, &cache->entries[i], now_ms);
}

int pen_cache_create(uv_loop_t *loop, const struct pen_zygote *zygote,
	const struct pen_worker_config *config, const struct pen_cache_events *events, void *user,
	struct pen_cache **ret_cache, struct pen_error *err)
{
	struct pen_cache *cache = calloc(1, sizeof *cache);
	const struct pen_assets_events assets_events = {handle_fetch, handle_assets_changed, cache};
	int r;

	if (!cache)
		return pen_error_memory(err);
	cache->loop = loop;
	cache->zygote = zygote;
	cache->config = config;
	cache->events = events;
	cache->user = user;
	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++)
		cache->entries[i].text = -1;
	r = pen_assets_create(config->asset_bytes, &assets_events, &cache->assets, err);
	if (r == 0)
		r = make_spare(cache, err);
	if (r < 0)
		pen_cache_destroy(cache);
	else
		*ret_cache = cache;
	return r;
}

void pen_cache_destroy(struct pen_cache *cache)
{
	if (!cache)
		return;
	for (size_t i = 0; i < PEN_SCENES_CACHED_MAX; i++)
		clear(&cache->entries[i]);
	pen_host_destroy(cache->leaving);
	pen_host_destroy(cache->spare);
	pen_assets_destroy(cache->assets);
	free(cache);
}
