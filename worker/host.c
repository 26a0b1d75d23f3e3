/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/host.h"

#include "core/base/clock.h"
#include "core/base/text.h"
#include "worker/blame.h"
#include "worker/memory.h"
#include "worker/watch.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/pidfd.h>
#include <sys/wait.h>
#include <unistd.h>

enum {
	UNITS_MAX = 4096, /* of one render process: what it leaks goes with it */
	HANG_MS = 10000,
	YOUNG_MS = 1000,
	BACKOFF_MIN_MS = 100,
	BACKOFF_MAX_MS = 5000
};

enum slot_state {
	SLOT_EMPTY,    /* no process; a new one at since_ms */
	SLOT_STARTING, /* asked for, not heard of yet */
	SLOT_IDLE,
	SLOT_BUSY,
	SLOT_ENDING /* it has gone or will at once; its parent has not told yet */
};

struct slot {
	struct pen_host *host;
	enum slot_state state;
	int64_t since_ms; /* of the state */
	int64_t start_ms; /* of the process */
	struct pen_watch *watch;
	int pidfd;			 /* -1 = not known yet */
	uint64_t lease;			 /* 0 = none */
	uint32_t place;			 /* of the last order's pixels */
	uint32_t units;			 /* rendered by this process */
	uint32_t serial;		 /* of the process */
	uint32_t frame;			 /* that it was started for */
	uint32_t frame_first, frame_end; /* that it has */
	uint32_t failures;		 /* processes in a row that died young */
};

struct pen_host {
	uv_loop_t *loop;
	const struct pen_zygote *zygote;
	const struct pen_host_events *events;
	void *user;
	uint32_t id;
	uint32_t slot_count;
	struct pen_watch *control;
	const struct pen_result *results;
	size_t results_size;
	int look; /* the text of a view that the scene process has not been told of; -1: none */
	bool ready, hangs;
	struct pen_findings findings;
	struct pen_sha256 *needs;
	uint32_t need_count, need_total;
	struct slot slots[];
};

static void set_state(struct slot *slot, enum slot_state state)
{
	slot->state = state;
	slot->since_ms = pen_clock_ms();
}

/* The process has no way to answer any more. */
static void cut(struct slot *slot)
{
	pen_watch_destroy(slot->watch);
	slot->watch = NULL;
	if (slot->pidfd >= 0)
		(void)close(slot->pidfd);
	slot->pidfd = -1;
	set_state(slot, SLOT_ENDING);
}

static void end(struct slot *slot)
{
	if (slot->pidfd >= 0)
		(void)pidfd_send_signal(slot->pidfd, SIGKILL, NULL, 0);
	cut(slot);
}

static void lose(struct slot *slot, enum pen_fault fault, const char *reason)
{
	struct pen_host *host = slot->host;
	uint64_t lease = slot->lease;

	slot->lease = 0;
	if (lease != 0)
		host->events->lost(
			host->user, (uint32_t)(slot - host->slots), lease, fault, reason);
}

static void handle_answer(struct slot *slot, const struct pen_answer *answer, pid_t sender)
{
	struct pen_host *host = slot->host;
	uint32_t index = (uint32_t)(slot - host->slots);

	if (slot->state == SLOT_STARTING && answer->lease == 0 && sender > 0) {
		if (slot->pidfd < 0)
			slot->pidfd = pidfd_open(sender, 0);
		slot->frame_first = answer->frame_first;
		slot->frame_end = answer->frame_end;
		set_state(slot, SLOT_IDLE);
		host->events->idle(host->user, host);
		return;
	}
	if (slot->state != SLOT_BUSY || answer->lease != slot->lease) {
		end(slot);
		lose(slot, PEN_FAULT_CRASH, "render process broke its protocol");
		return;
	}
	slot->lease = 0;
	slot->failures = 0;
	if (++slot->units < UNITS_MAX)
		set_state(slot, SLOT_IDLE);
	else
		cut(slot);
	host->events->done(
		host->user, host, index, answer, host->results[index].pixels[slot->place]);
}

static void handle_slot(void *user)
{
	struct slot *slot = user;
	struct pen_answer answer;
	pid_t sender;
	int r;

	r = pen_channel_receive(
		pen_watch_fd(slot->watch), &answer, sizeof answer, NULL, 0, &sender);
	if (r == 0)
		handle_answer(slot, &answer, sender);
	else if (r != PEN_EAGAIN)
		cut(slot);
}

/* It needs to know no earlier than it forks, and the processes that render need the time now. */
static bool tell_look(struct pen_host *host)
{
	const struct pen_control control = {.type = PEN_CONTROL_LOOK};

	if (host->look < 0)
		return true;
	if (pen_channel_send(
		    pen_watch_fd(host->control), &control, sizeof control, &host->look, 1) < 0)
		return false;
	(void)close(host->look);
	host->look = -1;
	return true;
}

static void start(struct slot *slot)
{
	struct pen_host *host = slot->host;
	struct pen_control control = {
		.type = PEN_CONTROL_START,
		.id = (uint32_t)(slot - host->slots),
		.frame = slot->frame,
		.serial = slot->serial + 1,
	};
	int pool, child, r;

	if (!tell_look(host) || pen_channel_pair(&pool, &child, NULL) < 0)
		return;
	r = pen_channel_send(pen_watch_fd(host->control), &control, sizeof control, &child, 1);
	(void)close(child);
	if (r < 0) {
		(void)close(pool);
		return;
	}
	slot->units = 0;
	slot->serial++;
	slot->start_ms = pen_clock_ms();
	set_state(slot, SLOT_STARTING);
	if (pen_watch_create(host->loop, pool, handle_slot, slot, &slot->watch, NULL) < 0)
		set_state(slot, SLOT_ENDING);
}

/* When a slot whose process has ended may have a new one. */
static void plan_restart(struct slot *slot)
{
	int64_t now_ms = pen_clock_ms();
	int64_t delay_ms = 0;

	if (slot->units > 0 || now_ms - slot->start_ms > YOUNG_MS)
		slot->failures = 0;
	else
		slot->failures++;
	if (slot->failures > 1)
		delay_ms = BACKOFF_MIN_MS << (slot->failures < 8 ? slot->failures - 2 : 6);
	if (delay_ms > BACKOFF_MAX_MS)
		delay_ms = BACKOFF_MAX_MS;
	slot->state = SLOT_EMPTY;
	slot->since_ms = now_ms + delay_ms;
	if (delay_ms == 0)
		start(slot);
}

static void handle_child(struct pen_host *host, uint32_t index, int status)
{
	struct slot *slot = &host->slots[index];
	char reason[PEN_BLAME_TEXT];
	enum pen_fault fault = pen_blame_of("render process", status, reason);

	if (slot->state == SLOT_EMPTY)
		return;
	if (WIFSTOPPED(status)) {
		if (slot->state != SLOT_ENDING)
			end(slot);
	} else {
		if (slot->state != SLOT_ENDING)
			cut(slot);
		plan_restart(slot);
	}
	lose(slot, fault, reason);
}

/* One message of several; false when it makes no sense. */
static bool take_needs(struct pen_host *host, const struct pen_control *control)
{
	const uint32_t total = control->serial, count = control->id;

	if (host->ready || count == 0 || count > PEN_CONTROL_NEEDS_MAX || total > PEN_ASSETS_MAX ||
		(host->need_total != 0 && total != host->need_total) ||
		count > total - host->need_count)
		return false;
	if (!host->needs)
		host->needs = calloc(total, sizeof *host->needs);
	if (!host->needs)
		return false;
	host->need_total = total;
	memcpy(host->needs + host->need_count, control->reason, count * sizeof *host->needs);
	host->need_count += count;
	if (host->need_count == total)
		host->events->needs(host->user, host);
	return true;
}

/* false when it makes no sense. */
static bool take_control(struct pen_host *host, const struct pen_control *control)
{
	switch (control->type) {
	case PEN_CONTROL_CHILD:
		if (control->id >= host->slot_count)
			return false;
		if (control->serial == host->slots[control->id].serial)
			handle_child(host, control->id, control->status);
		return true;
	case PEN_CONTROL_ERROR:
	case PEN_CONTROL_WARNING:
		if (host->ready)
			return false;
		pen_findings_add(&host->findings, control);
		return true;
	case PEN_CONTROL_NEEDS: return take_needs(host, control);
	case PEN_CONTROL_READY:
		if (host->ready)
			return false;
		host->ready = true;
		for (uint32_t i = 0; i < host->slot_count; i++)
			start(&host->slots[i]);
		host->events->ready(host->user, host);
		return true;
	case PEN_CONTROL_FAILED:
		host->events->failed(host->user, host, control->reason);
		return true;
	default: return false;
	}
}

static void handle_control(void *user)
{
	struct pen_host *host = user;
	struct pen_control control;
	int r;

	r = pen_channel_receive(
		pen_watch_fd(host->control), &control, sizeof control, NULL, 0, NULL);
	if (r == PEN_EAGAIN)
		return;
	if (r == 0) {
		/* What the coordinator would refuse must not reach it; hashes are no text. */
		control.pointer[sizeof control.pointer - 1] = '\0';
		if (control.type != PEN_CONTROL_NEEDS) {
			control.reason[sizeof control.reason - 1] = '\0';
			pen_text_clean(control.reason);
		}
	}
	if (r < 0 || !take_control(host, &control)) {
		/* It has gone, or it has gone mad; the zygote tells of its end. */
		(void)pen_zygote_kill(host->zygote, host->id);
		pen_watch_destroy(host->control);
		host->control = NULL;
	}
}

static int connect_process(struct pen_host *host, struct pen_error *err)
{
	const void *data;
	int results, pool, child, r;

	r = pen_memory_results(host->slot_count, &results, err);
	if (r < 0)
		return r;
	r = pen_memory_map(results, &data, &host->results_size, err);
	if (r < 0)
		goto out;
	host->results = data;
	r = pen_channel_pair(&pool, &child, err);
	if (r < 0)
		goto out;
	if (pen_zygote_fork(host->zygote, host->id, child, results) < 0)
		r = pen_error_set(err, PEN_ECLOSED, "the zygote does not answer");
	(void)close(child);
	if (r == 0)
		r = pen_watch_create(host->loop, pool, handle_control, host, &host->control, err);
	else
		(void)close(pool);
out:
	(void)close(results);
	return r;
}

int pen_host_create(uv_loop_t *loop, const struct pen_zygote *zygote, uint32_t id,
	const struct pen_worker_config *config, const struct pen_host_events *events, void *user,
	struct pen_host **ret_host, struct pen_error *err)
{
	struct pen_host *host = calloc(1, sizeof *host + config->processes * sizeof *host->slots);
	int r;

	if (!host)
		return pen_error_memory(err);
	host->loop = loop;
	host->zygote = zygote;
	host->events = events;
	host->user = user;
	host->id = id;
	host->look = -1;
	host->slot_count = config->processes;
	for (uint32_t i = 0; i < host->slot_count; i++)
		host->slots[i] = (struct slot){.host = host, .pidfd = -1};
	r = connect_process(host, err);
	if (r < 0)
		pen_host_destroy(host);
	else
		*ret_host = host;
	return r;
}

void pen_host_destroy(struct pen_host *host)
{
	if (!host)
		return;
	(void)pen_zygote_kill(host->zygote, host->id);
	for (uint32_t i = 0; i < host->slot_count; i++)
		cut(&host->slots[i]);
	pen_watch_destroy(host->control);
	if (host->results)
		(void)munmap((void *)(uintptr_t)host->results, host->results_size);
	if (host->look >= 0)
		(void)close(host->look);
	pen_findings_finish(&host->findings);
	free(host->needs);
	free(host);
}

struct pen_findings pen_host_take_findings(struct pen_host *host)
{
	const struct pen_findings findings = host->findings;

	host->findings = (struct pen_findings){0};
	return findings;
}

uint32_t pen_host_id(const struct pen_host *host)
{
	return host->id;
}

int pen_host_load(struct pen_host *host, int text, uint32_t frame, struct pen_error *err)
{
	const struct pen_control control = {.type = PEN_CONTROL_LOAD, .frame = frame};

	for (uint32_t i = 0; i < host->slot_count; i++)
		host->slots[i].frame = frame;
	if (!host->control || pen_channel_send(pen_watch_fd(host->control), &control,
				      sizeof control, &text, 1) < 0)
		return pen_error_set(err, PEN_ECLOSED, "the scene process does not answer");
	return 0;
}

/* An idle process looks for itself, if the text is short: that saves a fork. */
static bool send_look(struct slot *slot, const void *text, size_t size)
{
	const struct pen_order order = {.lease = 0, .channels = (uint32_t)size};
	const int fd = slot->state == SLOT_IDLE ? pen_watch_fd(slot->watch) : -1;

	if (fd < 0 || size > PEN_LOOK_BYTES_MAX ||
		pen_channel_send(fd, &order, sizeof order, NULL, 0) < 0 ||
		pen_channel_send(fd, text, size, NULL, 0) < 0)
		return false;
	slot->frame_first = slot->frame_end = 0;
	set_state(slot, SLOT_STARTING);
	return true;
}

static void look(struct slot *slot, const void *text, size_t size, uint32_t frame)
{
	slot->frame = frame;
	if (send_look(slot, text, size))
		return;
	if (slot->state == SLOT_STARTING || slot->state == SLOT_IDLE || slot->state == SLOT_BUSY)
		end(slot);
	lose(slot, PEN_FAULT_KILLED, "another view was asked for");
	start(slot);
}

int pen_host_look(struct pen_host *host, int text, uint32_t frame, struct pen_error *err)
{
	const void *bytes;
	size_t size;
	int r;

	assert(host->ready);
	if (!host->control)
		return pen_error_set(err, PEN_ECLOSED, "the scene process does not answer");
	r = pen_memory_map(text, &bytes, &size, err);
	if (r < 0)
		return r;
	if (host->look >= 0)
		(void)close(host->look);
	host->look = fcntl(text, F_DUPFD_CLOEXEC, 3);
	if (host->look < 0)
		r = pen_error_system(err, errno, "no descriptor for a view");
	for (uint32_t i = 0; r == 0 && i < host->slot_count; i++)
		look(&host->slots[i], bytes, size, frame);
	(void)munmap((void *)(uintptr_t)bytes, size);
	return r;
}

uint32_t pen_host_needs(const struct pen_host *host, const struct pen_sha256 **ret_needs)
{
	*ret_needs = host->needs;
	return host->need_count == host->need_total ? host->need_count : 0;
}

bool pen_host_give(struct pen_host *host, uint32_t index, int asset)
{
	const struct pen_control control = {.type = PEN_CONTROL_ASSET, .id = index};

	return host->control && pen_channel_send(pen_watch_fd(host->control), &control,
					sizeof control, &asset, 1) == 0;
}

bool pen_host_idle(const struct pen_host *host, uint32_t slot)
{
	return host->slots[slot].state == SLOT_IDLE;
}

bool pen_host_has_frame(const struct pen_host *host, uint32_t slot, uint32_t frame)
{
	const struct slot *s = &host->slots[slot];

	return frame >= s->frame_first && frame < s->frame_end;
}

void pen_host_turn(struct pen_host *host, uint32_t slot, uint32_t frame)
{
	struct slot *s = &host->slots[slot];

	assert(s->state == SLOT_IDLE);
	s->frame = frame;
	if (!host->control)
		return;
	end(s);
	start(s);
}

bool pen_host_order(struct pen_host *host, uint32_t slot, struct pen_order *order)
{
	struct slot *s = &host->slots[slot];

	assert(s->state == SLOT_IDLE && order->lease != 0);
	s->place = (s->place + 1) % PEN_RESULT_PLACES;
	order->place = s->place;
	if (pen_channel_send(pen_watch_fd(s->watch), order, sizeof *order, NULL, 0) < 0) {
		cut(s);
		return false;
	}
	s->lease = order->lease;
	set_state(s, SLOT_BUSY);
	return true;
}

void pen_host_abort(struct pen_host *host, uint32_t slot)
{
	struct slot *s = &host->slots[slot];

	s->lease = 0;
	if (s->state != SLOT_EMPTY && s->state != SLOT_ENDING)
		end(s);
}

uint64_t pen_host_progress(const struct pen_host *host, uint32_t slot)
{
	return atomic_load(&host->results[slot].progress);
}

void pen_host_tick(struct pen_host *host, int64_t now_ms)
{
	for (uint32_t i = 0; i < host->slot_count; i++) {
		struct slot *slot = &host->slots[i];

		if (slot->state == SLOT_EMPTY && host->ready && host->control &&
			slot->since_ms <= now_ms)
			start(slot);
		/* One that starts may wait for its frame to be built. */
		if (slot->state == SLOT_STARTING && now_ms - slot->since_ms > PEN_LEASE_HARD_MS)
			host->hangs = true;
		if (slot->state == SLOT_ENDING && now_ms - slot->since_ms > HANG_MS)
			host->hangs = true;
	}
	if (host->hangs)
		(void)pen_zygote_kill(host->zygote, host->id);
}

void pen_host_ended(struct pen_host *host, enum pen_fault fault, const char *reason)
{
	for (uint32_t i = 0; i < host->slot_count; i++)
		lose(&host->slots[i], fault, reason);
}
