/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_events.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "server/api_render.h"
#include "server/fields.h"
#include "server/tree.h"
#include "server/watch.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>

enum { INTERVAL_MS = 200, PING_MS = 15000, RETRY_MS = 1000 };

/* One client's stream. */
struct events {
	struct pen_watch watch; /* first, so that a watch is its events */
	struct pen_api *api;
	struct pen_stream *stream;
	char id[PEN_JOB_ID_TEXT];
	uint64_t seen;	 /* revision, as the client knows it */
	int64_t told_ms; /* when it was told anything last; 0: never */
	bool watching;
	bool is_held; /* as the client knows it: by any worker */
};

static void handle_due(struct pen_watch *watch)
{
	struct events *events = (struct events *)watch;

	events->watching = false;
	pen_stream_wake(events->stream);
}

/* Nothing is told for now: the client waits until there is something, or for a ping. */
static bool wait_on(struct events *events, struct pen_stream *stream)
{
	events->stream = stream;
	events->watch = (struct pen_watch){
		.id = events->id,
		.revision = events->seen,
		.earliest_ms = events->told_ms + INTERVAL_MS,
		.latest_ms = events->told_ms + PING_MS,
		.due = handle_due,
	};
	events->watching = pen_watch_start(events->api->watches, &events->watch);
	return events->watching;
}

/* line is JSON; NULL when there was no memory for it. */
static void write_line(struct pen_buf *text, const char *name, const char *line)
{
	(void)pen_buf_printf(text, "event: %s\ndata: ", name);
	if (line)
		(void)pen_buf_text(text, line);
	else
		text->failed = true;
	(void)pen_buf_text(text, "\n");
}

static void write_event(struct pen_buf *text, const char *name, json_t *data)
{
	char *line = pen_tree_text(data);

	write_line(text, name, line);
	free(line);
}

static void write_id(struct pen_buf *text, uint64_t revision)
{
	(void)pen_buf_printf(text, "id: %" PRIu64 "\n\n", revision);
}

/* Without an id: who loses the progress that follows gets both once more. */
static void write_tiles(struct pen_buf *text, const struct pen_job *job,
	const struct pen_job_frame *frame, uint64_t since)
{
	struct pen_rect rects[PEN_EVENT_TILES_MAX];
	size_t count = pen_jobs_tiles_since(job, frame->number, since, rects, PEN_EVENT_TILES_MAX);
	json_t *list = json_array();

	for (size_t i = 0; i < count; i++)
		pen_tree_append(&list,
			json_pack("[I, I, I, I]", (json_int_t)rects[i].x0, (json_int_t)rects[i].y0,
				(json_int_t)pen_rect_width(rects[i]),
				(json_int_t)pen_rect_height(rects[i])));
	if (count == 0) {
		json_decref(list);
		return;
	}
	write_event(text, "tiles",
		json_pack("{s:I, s:I, s:o}", "frame", (json_int_t)frame->number, "revision",
			(json_int_t)frame->revision, "tiles", list));
	(void)pen_buf_text(text, "\n");
}

static void write_progress(struct pen_buf *text, const struct pen_job *job)
{
	write_event(text, "progress",
		json_pack("{s:s, s:f, s:I, s:I, s:I, s:o}", "state", pen_job_state_name(job->state),
			"progress", pen_api_render_progress(job), "samples_done",
			(json_int_t)job->samples_done, "tiles_done", (json_int_t)job->tiles_done,
			"frames_done", (json_int_t)job->frames_done, "eta_seconds",
			job->eta_seconds < 0 ? json_null() : json_real(job->eta_seconds)));
	write_id(text, job->revision);
}

/* Who is at work on what, if anybody is or was when it was told last; without an id, like tiles. */
static void write_held(struct events *events, struct pen_buf *text, const struct pen_job *job)
{
	struct pen_held *held = &events->api->held;

	pen_held_refresh(held, events->api->farm, job, pen_clock_ms());
	if (held->count == 0 && !events->is_held)
		return;
	events->is_held = held->count > 0;
	write_line(text, "held", held->text);
	(void)pen_buf_text(text, "\n");
}

static void write_change(
	struct events *events, struct pen_buf *text, const struct pen_job *job, uint64_t since)
{
	struct pen_job_frame frames[PEN_JOB_FRAMES_MAX];
	uint32_t count = pen_jobs_frames_running(job, frames);

	for (uint32_t i = 0; i < count; i++)
		write_tiles(text, job, &frames[i], since);
	write_held(events, text, job);
	write_progress(text, job);
}

/* The last event; job is NULL when the render has been removed. */
static bool write_done(struct pen_buf *text, const struct pen_job *job, uint64_t seen)
{
	write_event(text, "done", job ? pen_api_render_json(job) : json_null());
	write_id(text, job ? job->revision : seen + 1);
	return false;
}

static bool read_events(void *user, struct pen_stream *stream, struct pen_buf *text)
{
	struct events *events = user;
	const struct pen_job *job = pen_jobs_find(events->api->jobs, events->id);
	const int64_t now_ms = pen_clock_ms();
	const bool is_first = events->told_ms == 0;
	const uint64_t since = events->seen;

	if (!is_first && now_ms < events->told_ms + INTERVAL_MS)
		return wait_on(events, stream);
	if (!is_first && job && job->revision == since && now_ms < events->told_ms + PING_MS)
		return wait_on(events, stream);
	if (is_first)
		(void)pen_buf_printf(text, "retry: %d\n\n", RETRY_MS);
	events->told_ms = now_ms;
	if (!job || pen_job_is_over(job->state))
		return write_done(text, job, since);
	events->seen = job->revision;
	if (job->revision != since)
		write_change(events, text, job, since);
	else
		(void)pen_buf_text(text, ": ping\n\n");
	return true;
}

static void finish_events(void *user)
{
	struct events *events = user;

	if (events->watching)
		pen_watch_stop(events->api->watches, &events->watch);
	events->api->streams--;
	free(events);
}

static void begin_stream(struct pen_exchange *exchange, const struct pen_job *job, uint64_t seen)
{
	struct events *events = calloc(1, sizeof *events);
	struct pen_stream_source source = {read_events, finish_events, events};
	struct pen_answer answer;

	if (!events) {
		pen_exchange_problem(exchange, 503, "there is no memory for more streams");
		return;
	}
	events->api = exchange->api;
	events->api->streams++;
	events->seen = seen;
	(void)snprintf(events->id, sizeof events->id, "%s", job->id);
	pen_answer_init(&answer, 200);
	answer.content_type = "text/event-stream";
	pen_answer_field(&answer, "Cache-Control", "no-store");
	pen_answer_field(&answer, "X-Accel-Buffering", "no"); /* nginx passes events on at once */
	pen_exchange_stream(exchange, &answer, &source);
}

void pen_api_events(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	const char *last = pen_exchange_field(exchange, "Last-Event-ID");
	struct pen_answer answer;
	uint64_t seen = 0;

	if (!job)
		return;
	if (!last || !pen_field_number(last, job->revision, &seen))
		seen = 0; /* what is no revision of it says nothing */
	if (pen_job_is_over(job->state) && seen == job->revision) {
		pen_answer_init(&answer, 204); /* a browser does not come back then */
		pen_answer_field(&answer, "Cache-Control", "no-store");
		pen_exchange_answer(exchange, &answer);
	} else if (exchange->api->streams >= PEN_STREAMS_MAX) {
		pen_answer_problem(&answer, 503, "too many clients watch renders already");
		pen_answer_field(&answer, "Retry-After", "5");
		pen_exchange_answer(exchange, &answer);
	} else {
		begin_stream(exchange, job, seen);
	}
}
