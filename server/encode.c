/* SPDX-License-Identifier: Apache-2.0 */
#include "server/encode.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "core/base/log.h"
#include "server/cache.h"
#include "server/helper.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
	HELPERS = 2,
	REQUESTS_MAX = 256, /* of one process, so that what a library leaks stays small */
	ATTEMPTS_MAX = 2,
	RESTART_MS = 1000 /* after a process that ended before its first reply */
};

struct waiter {
	struct waiter *next;
	pen_encoding_fn *fn;
	void *user;
};

/* An encoding that somebody waits for. */
struct pending {
	struct pending *next;
	char key[PEN_CACHE_KEY];
	struct pen_encoding_request request;
	int framebuffer_fd;
	unsigned attempts;
	struct waiter *waiters;
};

struct slot {
	struct pen_encoders *encoders;
	struct pen_helper *helper; /* NULL: not started */
	unsigned replies;
	struct pending *pending; /* what the helper works on */
	int file_fd;		 /* where its result appears */
};

struct pen_encoders {
	uv_loop_t *loop;
	char *program;
	enum pen_sandbox_mode sandbox; /* of the helpers */
	struct pen_cache cache;
	struct slot slots[HELPERS];
	struct pending *waiting; /* in order of arrival */
	unsigned waiting_count;
	uv_timer_t dispatch_timer;
	int64_t restart_ms; /* no process is started before */
};

static void dispatch(struct pen_encoders *encoders);

static void key_of(const struct pen_encoding *encoding, char ret_key[static PEN_CACHE_KEY])
{
	bool toned = encoding->format == PEN_IMAGE_PNG || encoding->format == PEN_IMAGE_JPEG;
	double exposure = toned ? encoding->exposure : 0.0;

	(void)snprintf(ret_key, PEN_CACHE_KEY, "%s/%u/%" PRIu64 "%s/%s/%a/%u,%u,%u,%u/%u,%u.%s",
		encoding->job_id, encoding->frame, encoding->revision,
		encoding->final ? "-final" : "", pen_layer_name(encoding->layer), exposure,
		encoding->region.x0, encoding->region.y0, encoding->region.x1, encoding->region.y1,
		encoding->out_width, encoding->out_height,
		pen_image_format_extension(encoding->format));
}

static void pending_destroy(struct pending *pending)
{
	while (pending->waiters) {
		struct waiter *waiter = pending->waiters;

		pending->waiters = waiter->next;
		free(waiter);
	}
	if (pending->framebuffer_fd >= 0)
		(void)close(pending->framebuffer_fd);
	free(pending);
}

/* Tells everybody who waits: the cached file, or why there is none. Frees pending. */
static void conclude(
	struct pen_encoders *encoders, struct pending *pending, const struct pen_error *err)
{
	for (struct waiter *waiter = pending->waiters; waiter; waiter = waiter->next) {
		struct pen_error why = *err;
		uint64_t size = 0;
		int fd = -1;

		if (why.code == 0) {
			fd = pen_cache_find(&encoders->cache, pending->key, &size);
			if (fd < 0)
				(void)pen_error_set(&why, PEN_EIO, "too many files are open");
		}
		waiter->fn(waiter->user, fd, size, &why);
	}
	pending_destroy(pending);
}

static void dispatch_timer_due(uv_timer_t *timer)
{
	dispatch(timer->data);
}

static void dispatch_later(struct pen_encoders *encoders, int64_t delay_ms)
{
	uint64_t delay = delay_ms > 0 ? (uint64_t)delay_ms : 0;

	(void)uv_timer_start(&encoders->dispatch_timer, dispatch_timer_due, delay, 0);
}

static void reply_came(struct slot *slot, const struct pen_encoding_reply *reply)
{
	struct pen_encoders *encoders = slot->encoders;
	struct pending *pending = slot->pending;
	struct pen_error err = PEN_ERROR_INIT;

	assert(pending);
	slot->pending = NULL;
	if (reply->code == 0) {
		pen_cache_put(&encoders->cache, pending->key, slot->file_fd, reply->size);
	} else {
		(void)close(slot->file_fd);
		(void)pen_error_set(&err, reply->code, "%s", reply->text);
	}
	if (++slot->replies == REQUESTS_MAX) {
		pen_helper_destroy(slot->helper);
		slot->helper = NULL;
	}
	conclude(encoders, pending, &err);
}

static void process_ended(struct slot *slot)
{
	struct pen_encoders *encoders = slot->encoders;
	struct pending *pending = slot->pending;
	struct pen_error err;

	pen_log(PEN_LOG_WARNING, "an encoder ended after %u images", slot->replies);
	pen_helper_destroy(slot->helper);
	slot->helper = NULL;
	if (slot->replies == 0)
		encoders->restart_ms = pen_clock_ms() + RESTART_MS;
	if (!pending)
		return;
	slot->pending = NULL;
	(void)close(slot->file_fd);
	if (pending->attempts < ATTEMPTS_MAX) {
		pending->next = encoders->waiting;
		encoders->waiting = pending;
		encoders->waiting_count++;
		return;
	}
	(void)pen_error_set(&err, PEN_EIO, "the encoder ended while it made this image");
	conclude(encoders, pending, &err);
}

static void helper_event(void *user, const struct pen_encoding_reply *reply)
{
	struct slot *slot = user;
	struct pen_encoders *encoders = slot->encoders;

	if (reply)
		reply_came(slot, reply);
	else
		process_ended(slot);
	dispatch_later(encoders, 0);
}

static int slot_start(struct slot *slot, struct pen_error *err)
{
	slot->replies = 0;
	return pen_helper_create(slot->encoders->loop, slot->encoders->program,
		slot->encoders->sandbox, helper_event, slot, &slot->helper, err);
}

/* An idle process is better than a new one, which takes a third of a second to start. */
static struct slot *free_slot(struct pen_encoders *encoders)
{
	struct slot *empty = NULL;

	for (unsigned i = 0; i < HELPERS; i++) {
		struct slot *slot = &encoders->slots[i];

		if (slot->helper && !slot->pending)
			return slot;
		if (!slot->helper)
			empty = slot;
	}
	return empty;
}

static int assign(struct slot *slot, struct pending *pending, struct pen_error *err)
{
	int write_fd;
	int r = pen_cache_file_create(&slot->encoders->cache, &write_fd, &slot->file_fd, err);

	if (r < 0)
		return r;
	pending->attempts++;
	slot->pending = pending;
	pen_helper_send(slot->helper, &pending->request, pending->framebuffer_fd, write_fd);
	(void)close(write_fd);
	return 0;
}

/* Gives the first that waits to a free process; false when there is nothing to do now. */
static bool dispatch_one(struct pen_encoders *encoders)
{
	struct slot *slot = free_slot(encoders);
	struct pending *pending = encoders->waiting;
	struct pen_error err = PEN_ERROR_INIT;
	int r = 0;

	if (!slot || !pending)
		return false;
	if (!slot->helper) {
		int64_t delay_ms = encoders->restart_ms - pen_clock_ms();

		if (delay_ms > 0) {
			dispatch_later(encoders, delay_ms);
			return false;
		}
		r = slot_start(slot, &err);
	}
	encoders->waiting = pending->next;
	encoders->waiting_count--;
	if (r == 0)
		r = assign(slot, pending, &err);
	if (r < 0)
		conclude(encoders, pending, &err);
	return true;
}

static void dispatch(struct pen_encoders *encoders)
{
	while (dispatch_one(encoders))
		;
}

int pen_encoders_create(uv_loop_t *loop, const char *program, enum pen_sandbox_mode sandbox,
	const char *cache_dir, struct pen_encoders **ret_encoders, struct pen_error *err)
{
	struct pen_encoders *encoders = calloc(1, sizeof *encoders);
	int r;

	if (!encoders)
		return pen_error_memory(err);
	encoders->loop = loop;
	encoders->sandbox = sandbox;
	(void)uv_timer_init(loop, &encoders->dispatch_timer);
	encoders->dispatch_timer.data = encoders;
	for (unsigned i = 0; i < HELPERS; i++)
		encoders->slots[i].encoders = encoders;
	encoders->program = strdup(program);
	r = encoders->program ? 0 : pen_error_memory(err);
	if (r == 0)
		r = pen_cache_init(&encoders->cache, cache_dir, err);
	if (r == 0)
		r = slot_start(&encoders->slots[0], err);
	if (r < 0) {
		pen_encoders_destroy(encoders);
		return r;
	}
	*ret_encoders = encoders;
	return 0;
}

static void timer_closed(uv_handle_t *handle)
{
	free(handle->data);
}

void pen_encoders_destroy(struct pen_encoders *encoders)
{
	struct pen_error err;

	if (!encoders)
		return;
	(void)pen_error_set(&err, PEN_ECLOSED, "the service is stopping");
	for (unsigned i = 0; i < HELPERS; i++) {
		struct slot *slot = &encoders->slots[i];

		pen_helper_destroy(slot->helper);
		if (!slot->pending)
			continue;
		(void)close(slot->file_fd);
		conclude(encoders, slot->pending, &err);
	}
	while (encoders->waiting) {
		struct pending *pending = encoders->waiting;

		encoders->waiting = pending->next;
		conclude(encoders, pending, &err);
	}
	pen_cache_finish(&encoders->cache);
	free(encoders->program);
	uv_close((uv_handle_t *)&encoders->dispatch_timer, timer_closed);
}

static struct pending *find_pending(struct pen_encoders *encoders, const char *key)
{
	for (unsigned i = 0; i < HELPERS; i++) {
		struct pending *pending = encoders->slots[i].pending;

		if (pending && strcmp(pending->key, key) == 0)
			return pending;
	}
	for (struct pending *pending = encoders->waiting; pending; pending = pending->next) {
		if (strcmp(pending->key, key) == 0)
			return pending;
	}
	return NULL;
}

static struct pending *pending_create(const struct pen_encoding *encoding, const char *key)
{
	struct pending *pending = calloc(1, sizeof *pending);
	struct pen_encoding_request *request;

	if (!pending)
		return NULL;
	pending->framebuffer_fd = -1;
	(void)snprintf(pending->key, sizeof pending->key, "%s", key);
	request = &pending->request;
	*request = (struct pen_encoding_request){
		.format = encoding->format,
		.final = encoding->final,
		.width = encoding->width,
		.height = encoding->height,
		.region = encoding->region,
		.out_width = encoding->out_width,
		.out_height = encoding->out_height,
		.crop = encoding->tiling.crop,
		.tile_px = encoding->tiling.tile_px,
		.planes = encoding->planes,
		.layers = encoding->layers,
		.layer = encoding->layer,
		.samples = encoding->samples,
		.frame = encoding->frame,
		.exposure = encoding->exposure,
	};
	if (encoding->content[0] == '\0' || !encoding->equivalence_class)
		return pending;
	(void)snprintf(request->content, sizeof request->content, "%s", encoding->content);
	(void)snprintf(request->equivalence_class, sizeof request->equivalence_class, "%s",
		encoding->equivalence_class);
	return pending;
}

static void append(struct pen_encoders *encoders, struct pending *pending)
{
	struct pending **end = &encoders->waiting;

	while (*end)
		end = &(*end)->next;
	*end = pending;
	encoders->waiting_count++;
}

static int add_waiter(
	struct pending *pending, pen_encoding_fn *fn, void *user, struct pen_error *err)
{
	struct waiter *waiter = malloc(sizeof *waiter);

	if (!waiter)
		return pen_error_memory(err);
	*waiter = (struct waiter){.next = pending->waiters, .fn = fn, .user = user};
	pending->waiters = waiter;
	return 0;
}

int pen_encoders_request(struct pen_encoders *encoders, const struct pen_encoding *encoding,
	int framebuffer_fd, pen_encoding_fn *fn, void *user, struct pen_error *err)
{
	char key[PEN_CACHE_KEY];
	struct pending *pending;
	int r;

	key_of(encoding, key);
	pending = find_pending(encoders, key);
	if (pending) {
		(void)close(framebuffer_fd);
		return add_waiter(pending, fn, user, err);
	}
	if (encoders->waiting_count >= PEN_ENCODINGS_WAITING_MAX) {
		(void)close(framebuffer_fd);
		return pen_error_set(err, PEN_EAGAIN, "too many images wait to be encoded");
	}
	pending = pending_create(encoding, key);
	r = pending ? add_waiter(pending, fn, user, err) : pen_error_memory(err);
	if (r < 0) {
		free(pending);
		(void)close(framebuffer_fd);
		return r;
	}
	pending->framebuffer_fd = framebuffer_fd;
	append(encoders, pending);
	dispatch_later(encoders, 0);
	return 0;
}

int pen_encoders_cached(
	struct pen_encoders *encoders, const struct pen_encoding *encoding, uint64_t *ret_size)
{
	char key[PEN_CACHE_KEY];

	key_of(encoding, key);
	return pen_cache_find(&encoders->cache, key, ret_size);
}

struct pen_shared_bytes *pen_encoders_hold(
	struct pen_encoders *encoders, const struct pen_encoding *encoding)
{
	char key[PEN_CACHE_KEY];

	key_of(encoding, key);
	return pen_cache_hold(&encoders->cache, key);
}

void pen_encoders_forget(struct pen_encoders *encoders, const char *job_id)
{
	pen_cache_forget(&encoders->cache, job_id);
}
